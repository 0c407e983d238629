/// A bounding volume hierarchy over many boxes, built all at once.
///
/// The boxes are sorted along a Morton curve; each four neighbours are a leaf, each four nodes a
/// node of the next level, so that children need no pointers. The curve's scale is squashed towards
/// infinity: bodies far away do not make the rest of the world one point.
/// Cost: O(n) to build (a radix sort), O(log n) a query, O(n) to join if density is bounded.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/collision/box_lanes.h"
#include "server/collision/broad_phase.h"

namespace cradle {

/// Where along the Morton curve a box is. Made for bodies of which it sees a sample: their median,
/// and their widest spread along an axis; a few outliers change neither.
class MortonCurve {
 public:
  MortonCurve() = default;
  /// Through the boxes of these slots.
  MortonCurve(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots);

  /// 48 bits.
  std::uint64_t place(const FloatBox& box) const;

 private:
  std::array<float, 3> centre_{};
  float scale_ = 1;
};

class BoxTree {
 public:
  /// Over the boxes of these slots, in ascending order; `boxes` has one for every slot there is.
  void build(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots,
             const MortonCurve& curve);

  /// The boxes are others now, though not their slots. The order stays: should boxes travel, build
  /// anew in time.
  void refit(std::span<const FloatBox> boxes);

  std::size_t size() const { return slots_.size(); }

  /// Calls `visit(place, slot)` for every slot: `remove` takes its place.
  template <class F>
  void for_each_place(F&& visit) const {
    for (std::size_t i = 0; i < slots_.size(); ++i) visit(static_cast<std::int32_t>(i), slots_[i]);
  }
  /// From now on this box meets nothing. The boxes above it stay as they are.
  void remove(std::int32_t place) {
    const auto i = static_cast<std::size_t>(place);
    nodes_[i / kFloatLanes].clear(i % kFloatLanes);
  }

  /// Slots have changed: `now` has the new one of each, negative for boxes that are no more.
  void renumber(std::span<const std::int32_t> now);

  /// Calls `visit(slot)` for every box that overlaps `box`. Returns the nodes looked at.
  template <class F>
  std::int64_t query(const FloatBox& box, F&& visit) const {
    const Probe probe(box);
    return query_lanes([&probe](const BoxLanes& node) { return probe.overlaps(node); }, visit);
  }

  /// Calls `visit(slot)` for every box for which `may(box)` is true, as it has to be for every box
  /// around such a one; false for boxes of infinite numbers. Returns the nodes looked at.
  template <class May, class F>
  std::int64_t query_if(May&& may, F&& visit) const {
    const auto lanes_of = [&may](const BoxLanes& node) {
      unsigned lanes = 0;
      for (std::size_t lane = 0; lane < kFloatLanes; ++lane) {
        if (may(node.get(lane))) lanes |= 1U << lane;
      }
      return lanes;
    };
    return query_lanes(lanes_of, visit);
  }

  /// Likewise, `overlaps(node)` telling which of four boxes, as bits.
  template <class Overlaps, class F>
  std::int64_t query_lanes(Overlaps&& overlaps, F&& visit) const {
    if (levels_.empty()) return 0;
    Nodes root;
    root[0] = 0;
    return query_below(levels_.size() - 1, root, 1, overlaps, visit);
  }

  /// Calls `visit(slot, slot)` for every pair of boxes here that overlap, until it returns false.
  /// Returns the nodes looked at.
  template <class F>
  std::int64_t join(F&& visit) const {
    Join<F> join{*this, visit};
    if (!levels_.empty()) join.inside(levels_.size() - 1, 0);
    return join.nodes;
  }

  /// Fills `slots` with the `count` smallest whose boxes overlap `box` and that `accept(slot)`
  /// takes, in ascending order. Has to come after `index_oldest`. Returns the nodes looked at.
  template <class F>
  std::int64_t find_oldest(const FloatBox& box, std::size_t count, F&& accept,
                           std::vector<std::int32_t>& slots) const {
    slots.clear();
    Oldest<F> search{*this, Probe(box), count, accept, slots};
    if (!levels_.empty()) search.look(levels_.size() - 1, 0);
    return search.nodes;
  }
  void index_oldest();

 private:
  template <class F>
  struct Join;
  template <class F>
  struct Oldest;
  static constexpr std::size_t kTogether = 32;  // nodes of one level

  using Nodes = std::array<std::uint32_t, kFloatLanes*(kTogether + 1)>;

  /// Below the first `count` of `some` nodes of one level, no more than kTogether, level by level:
  /// waiting for one is waiting for all, and no branch depends on which of them are hit.
  template <class Overlaps, class F>
  std::int64_t query_below(std::size_t level, Nodes& some, std::size_t count, Overlaps& overlaps,
                           F& visit) const {
    Nodes others;
    Nodes *at = &some, *below = &others;
    for (std::int64_t nodes = 0;; --level, std::swap(at, below)) {
      nodes += static_cast<std::int64_t>(count);
      std::size_t hits = 0;
      for (std::size_t k = 0; k < count; ++k) {
        const std::uint32_t index = (*at)[k];
        hits += put_lanes(overlaps(node(level, index)),
                          static_cast<std::uint32_t>(kFloatLanes) * index, &(*below)[hits]);
      }
      count = hits;
      if (level == 0) {
        for (std::size_t k = 0; k < count; ++k) visit(slots_[(*below)[k]]);
        return nodes;
      }
      if (count <= kTogether) continue;
      for (std::size_t k = 0; k < count; k += kTogether) {
        const std::size_t part = std::min(kTogether, count - k);
        std::copy_n(below->begin() + static_cast<std::ptrdiff_t>(k), part, at->begin());
        nodes += query_below(level - 1, *at, part, overlaps, visit);
      }
      return nodes;
    }
  }

  static std::size_t lane_of(unsigned hits) {
    return static_cast<std::size_t>(std::countr_zero(hits));
  }
  const BoxLanes& node(std::size_t level, std::size_t index) const {
    return nodes_[levels_[level] + index];
  }
  void sort(std::span<const FloatBox> boxes, const MortonCurve& curve);
  std::size_t nodes_in(std::size_t level) const {
    return (level + 1 < levels_.size() ? levels_[level + 1] : nodes_.size()) - levels_[level];
  }

  std::vector<std::int32_t> slots_;  // in the order of the curve
  std::vector<BoxLanes> nodes_;      // level 0 first: its lanes are the boxes
  std::vector<std::size_t> levels_;  // where each begins in nodes_; the last is the root's
  std::vector<std::array<std::int32_t, kFloatLanes>> oldest_;  // smallest slot below each lane
  struct Key {
    std::uint64_t code;
    std::int32_t slot;
  };
  std::vector<Key> keys_, spare_;
};

/// The tree against itself, pairs of nodes at a time.
template <class F>
struct BoxTree::Join {
  const BoxTree& tree;
  F& visit;
  std::int64_t nodes = 0;

  /// Pairs below one node. False: no more are wanted.
  bool inside(std::size_t level, std::size_t index) {
    const BoxLanes& node = tree.node(level, index);
    for (std::size_t lane = 0; lane < kFloatLanes; ++lane) {
      const std::size_t child = index * kFloatLanes + lane;
      if (level > 0) {
        if (child >= tree.nodes_in(level - 1)) return true;
        if (!inside(level - 1, child)) return false;
      }
      const unsigned later = ~0U << (lane + 1);
      if (!meet(level, child, Probe(node.get(lane)).overlaps(node) & later, index)) return false;
    }
    return true;
  }

  /// Pairs of one below one node, and one below another.
  bool between(std::size_t level, std::size_t one, std::size_t other, const Probe& other_box) {
    const BoxLanes& node = tree.node(level, one);
    const BoxLanes& against = tree.node(level, other);
    for (unsigned lanes = other_box.overlaps(node); lanes != 0; lanes &= lanes - 1) {
      const std::size_t lane = lane_of(lanes);
      const unsigned hits = Probe(node.get(lane)).overlaps(against);
      if (!meet(level, one * kFloatLanes + lane, hits, other)) return false;
    }
    return true;
  }

  bool meet(std::size_t level, std::size_t child, unsigned hits, std::size_t index) {
    ++nodes;
    for (; hits != 0; hits &= hits - 1) {
      const std::size_t lane = lane_of(hits);
      const std::size_t other = index * kFloatLanes + lane;
      if (level == 0) {
        if (!visit(tree.slots_[child], tree.slots_[other])) return false;
      } else {
        const Probe other_box(tree.node(level, index).get(lane));
        if (!between(level - 1, child, other, other_box)) return false;
      }
    }
    return true;
  }
};

/// Depth first, the child with the smallest slot below it first; the rest cannot matter once there
/// are enough smaller ones.
template <class F>
struct BoxTree::Oldest {
  const BoxTree& tree;
  Probe probe;
  std::size_t count;
  F& accept;
  std::vector<std::int32_t>& slots;
  std::int64_t nodes = 0;

  bool matters(std::int32_t slot) const { return slots.size() < count || slot < slots.back(); }

  void look(std::size_t level, std::size_t index) {
    ++nodes;
    const auto& oldest = tree.oldest_[tree.levels_[level] + index];
    std::array<std::size_t, kFloatLanes> lanes{};
    std::size_t found = 0;
    for (unsigned hits = probe.overlaps(tree.node(level, index)); hits != 0; hits &= hits - 1) {
      std::size_t at = found++;
      const std::size_t lane = lane_of(hits);
      for (; at > 0 && oldest[lane] < oldest[lanes[at - 1]]; --at) lanes[at] = lanes[at - 1];
      lanes[at] = lane;
    }
    for (std::size_t k = 0; k < found; ++k) {
      const std::int32_t slot = oldest[lanes[k]];
      if (!matters(slot)) return;
      if (level > 0) {
        look(level - 1, index * kFloatLanes + lanes[k]);
      } else if (accept(slot)) {
        slots.insert(std::upper_bound(slots.begin(), slots.end(), slot), slot);
        if (slots.size() > count) slots.pop_back();
      }
    }
  }
};

}  // namespace cradle
