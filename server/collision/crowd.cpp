#include "server/collision/crowd.h"

#include <algorithm>

#include "server/collision/box_tree.h"
#include "server/collision/pair_rules.h"

namespace cradle {
namespace {

std::size_t index(std::int32_t slot) { return static_cast<std::size_t>(slot); }

class Crowd {
 public:
  explicit Crowd(const BroadPhaseInput& input)
      : input_(input), origin_(median_of(input.boxes)), boxes_(input.boxes.size()) {
    std::vector<std::int32_t> moving, immovable;
    for (std::size_t slot = 0; slot < boxes_.size(); ++slot) {
      if (!is_usable(input.boxes[slot])) continue;
      boxes_[slot] = to_float(input.boxes[slot], origin_);
      (input.moves[slot] != 0 ? moving : immovable).push_back(static_cast<std::int32_t>(slot));
    }
    moving_.build(boxes_, moving, MortonCurve(boxes_, moving));
    immovable_.build(boxes_, immovable, MortonCurve(boxes_, immovable));
  }

  /// All pairs, in no order of use; false if there are more than `most`.
  bool find_all(std::size_t most, std::vector<BodyPair>& pairs) {
    const auto add = [&](std::int32_t i, std::int32_t j) {
      if (!meet(i, j)) return true;
      const auto [a, b] = std::minmax(i, j);
      pairs.push_back({a, b});
      return pairs.size() <= most;
    };
    add_plane_pairs(input_, most, pairs);
    if (pairs.size() > most) return false;
    moving_.join(add);
    immovable_.for_each_place([&](std::int32_t, std::int32_t slot) {
      if (pairs.size() > most) return;
      moving_.query(boxes_[index(slot)], [&](std::int32_t other) {
        if (pairs.size() <= most) add(slot, other);
      });
    });
    return pairs.size() <= most;
  }

  /// Those that a slot keeps with at most `k` partners each. Returns the number of slots that have
  /// more.
  std::int64_t find_oldest(std::size_t k, std::vector<BodyPair>& pairs) {
    moving_.index_oldest();
    immovable_.index_oldest();
    std::int64_t crowded = 0;
    std::vector<std::int32_t> partners;
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
      const auto slot = static_cast<std::int32_t>(i);
      partners.clear();
      add_partners(slot, k + 1, partners);
      std::sort(partners.begin(), partners.end());
      if (partners.size() > k) {
        ++crowded;
        partners.resize(k);
      }
      for (const std::int32_t partner : partners) {
        const auto [a, b] = std::minmax(slot, partner);
        pairs.push_back({a, b});
      }
    }
    return crowded;
  }

 private:
  bool meet(std::int32_t i, std::int32_t j) const {
    return overlap(input_.boxes[index(i)], input_.boxes[index(j)]);
  }

  /// The `count` oldest of each sort: planes, bodies that move, bodies that do not.
  void add_partners(std::int32_t slot, std::size_t count, std::vector<std::int32_t>& partners) {
    const bool moves = input_.moves[index(slot)] != 0;
    for (const Plane& plane : input_.planes) {
      if (plane.slot == slot) return add_of_plane(plane, count, partners);
    }
    const Aabb& box = input_.boxes[index(slot)];
    if (!is_usable(box)) return;
    for (const Plane& plane : input_.planes) {
      if ((moves || input_.moves[index(plane.slot)] != 0) && overlap(box, plane)) {
        partners.push_back(plane.slot);
      }
    }
    add_oldest(moving_, slot, count, partners);
    if (moves) add_oldest(immovable_, slot, count, partners);
  }

  void add_of_plane(const Plane& plane, std::size_t count, std::vector<std::int32_t>& partners) {
    const bool moves = input_.moves[index(plane.slot)] != 0;
    for (std::size_t i = 0; i < boxes_.size() && partners.size() < count; ++i) {
      if ((moves || input_.moves[i] != 0) && is_usable(input_.boxes[i]) &&
          overlap(input_.boxes[i], plane)) {
        partners.push_back(static_cast<std::int32_t>(i));
      }
    }
  }

  void add_oldest(const BoxTree& tree, std::int32_t slot, std::size_t count,
                  std::vector<std::int32_t>& partners) {
    BoxTree::OldestFirst search(tree, boxes_[index(slot)]);
    for (std::size_t found = 0; found < count;) {
      const std::int32_t other = search.next();
      if (other < 0) return;
      if (other == slot || !meet(slot, other)) continue;
      partners.push_back(other);
      ++found;
    }
  }

  const BroadPhaseInput& input_;
  Vector origin_;
  std::vector<FloatBox> boxes_;
  BoxTree moving_, immovable_;
};

}  // namespace

BroadPhaseReport find_crowd_pairs(const BroadPhaseInput& input, std::vector<BodyPair>& pairs) {
  BroadPhaseReport report;
  const std::size_t slots = input.boxes.size();
  const std::size_t most = pairs_max(slots);
  pairs.clear();
  Crowd crowd(input);
  if (!crowd.find_all(most, pairs)) {
    report.method = "crowd";
    pairs.clear();
    report.crowded = crowd.find_oldest(most / slots, pairs);
  }
  PairSorter().sort(slots, pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return report;
}

}  // namespace cradle
