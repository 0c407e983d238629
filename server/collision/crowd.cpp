#include "server/collision/crowd.h"

#include <algorithm>

#include "server/collision/box_tree.h"
#include "server/collision/index.h"
#include "server/collision/pair_rules.h"

namespace cradle {
namespace {

class Crowd {
 public:
  Crowd(const BroadPhaseInput& input, std::vector<BodyPair>& pairs)
      : input_(input), pairs_(pairs), origin_(median_of(input.boxes)), boxes_(input.boxes.size()) {
    std::vector<std::int32_t> moving, immovable;
    for (std::size_t slot = 0; slot < boxes_.size(); ++slot) {
      if (!is_usable(input.boxes[slot])) continue;
      boxes_[slot] = to_float(input.boxes[slot], origin_);
      (input.moves[slot] != 0 ? moving : immovable).push_back(static_cast<std::int32_t>(slot));
    }
    moving_.build(boxes_, moving, MortonCurve(boxes_, moving));
    immovable_.build(boxes_, immovable, MortonCurve(boxes_, immovable));
    report_.boxes_seen = static_cast<std::int64_t>(boxes_.size());
  }

  BroadPhaseReport report() const { return report_; }

  /// All pairs, in no order of use; false if there are more than `most`.
  bool find_all(std::size_t most) {
    add_plane_pairs(input_, most, pairs_);
    const auto add = [&](std::int32_t i, std::int32_t j) {
      if (pairs_.size() > most) return false;
      if (meet(i, j)) add_pair(i, j);
      return true;
    };
    report_.nodes_seen += moving_.join(add);
    immovable_.for_each_place([&](std::int32_t, std::int32_t slot) {
      if (pairs_.size() > most) return;
      report_.nodes_seen +=
          moving_.query(boxes_[index(slot)], [&](std::int32_t other) { add(slot, other); });
    });
    return pairs_.size() <= most;
  }

  /// Those that one of the two keeps, if each keeps those with its `k` oldest partners.
  void find_oldest(std::size_t k) {
    report_.method = "crowd";
    moving_.index_oldest();
    immovable_.index_oldest();
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
      const auto slot = static_cast<std::int32_t>(i);
      partners_.clear();
      add_partners(slot, k + 1);
      std::sort(partners_.begin(), partners_.end());
      if (partners_.size() > k) {
        ++report_.crowded;
        partners_.resize(k);
      }
      for (const std::int32_t partner : partners_) add_pair(slot, partner);
    }
  }

 private:
  bool meet(std::int32_t i, std::int32_t j) {
    ++report_.boxes_seen;
    return overlap(input_.boxes[index(i)], input_.boxes[index(j)]);
  }
  void add_pair(std::int32_t i, std::int32_t j) {
    pairs_.push_back({std::min(i, j), std::max(i, j)});
  }

  /// The `count` oldest of each sort: planes, bodies that move, bodies that do not.
  void add_partners(std::int32_t slot, std::size_t count) {
    const bool moves = input_.moves[index(slot)] != 0;
    for (const Plane& plane : input_.planes) {
      if (plane.slot == slot) return add_partners_of(plane, count);
    }
    const Aabb& box = input_.boxes[index(slot)];
    if (!is_usable(box)) return;
    for (const Plane& plane : input_.planes) {
      const bool counts = moves || input_.moves[index(plane.slot)] != 0;
      if (counts && overlap(box, plane)) partners_.push_back(plane.slot);
    }
    add_oldest(moving_, slot, count);
    if (moves) add_oldest(immovable_, slot, count);
  }

  void add_partners_of(const Plane& plane, std::size_t count) {
    const bool moves = input_.moves[index(plane.slot)] != 0;
    for (std::size_t i = 0; i < boxes_.size() && partners_.size() < count; ++i) {
      const bool counts = (moves || input_.moves[i] != 0) && is_usable(input_.boxes[i]);
      if (counts && overlap(input_.boxes[i], plane)) {
        partners_.push_back(static_cast<std::int32_t>(i));
      }
    }
  }

  void add_oldest(const BoxTree& tree, std::int32_t slot, std::size_t count) {
    const auto accept = [&](std::int32_t other) { return other != slot && meet(slot, other); };
    report_.nodes_seen += tree.find_oldest(boxes_[index(slot)], count, accept, oldest_);
    partners_.insert(partners_.end(), oldest_.begin(), oldest_.end());
  }

  const BroadPhaseInput& input_;
  std::vector<BodyPair>& pairs_;
  Vector origin_;
  std::vector<FloatBox> boxes_;
  BoxTree moving_, immovable_;
  std::vector<std::int32_t> partners_, oldest_;
  BroadPhaseReport report_;
};

}  // namespace

BroadPhaseReport find_crowd_pairs(const BroadPhaseInput& input, std::vector<BodyPair>& pairs) {
  const std::size_t slots = input.boxes.size();
  const std::size_t most = pairs_max(slots);
  pairs.clear();
  Crowd crowd(input, pairs);
  if (!crowd.find_all(most)) {
    pairs.clear();
    crowd.find_oldest(partners_kept(slots));
  }
  PairSorter().sort(slots, pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return crowd.report();
}

}  // namespace cradle
