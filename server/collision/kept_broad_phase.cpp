// Our broad phase: what it knows of the last call saves work, and never changes the result.
//
// Every body has a roomy box around its box, stretched along its last motion. Pairs of roomy boxes
// that overlap are kept (room_pairs.h); each call compares the true boxes of those in which one has
// changed. A body whose box leaves its room gets a new one and asks the trees for its pairs; when
// too many have left, all get new ones and the tree is joined with itself. (Verlet's neighbour
// list, 1967, with the fat boxes of Box2D.)
//
// Bodies that move and bodies that never yield have trees apart, and two of the latter never meet.
// Each has two: the old one of the last rebuild, from which those that left are taken out, and the
// young one of these, made anew for each call that needs it. So what rests costs a look at its
// box, and no tree decays.
//
// Where rooms would have to be renewed again and again, as in a gas, nothing is kept for a while:
// see fresh_pairs.cpp.
//
// Cost: 30 ns for a body that moves, 5 to 11 where one in twenty does (Zen 5; cradle_bench broad).
#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "server/collision/box_grid.h"
#include "server/collision/box_layer.h"
#include "server/collision/crowd.h"
#include "server/collision/fresh_pairs.h"
#include "server/collision/index.h"
#include "server/collision/pair_parts.h"
#include "server/collision/pair_rules.h"
#include "server/collision/room_pairs.h"

namespace cradle {
namespace {

/// How much room a box gets, in extents of the box: for any motion, and ahead of the last one.
constexpr float kRoom = 0.06F;
constexpr float kStepsAhead = 12;
constexpr float kStretchMax = 0.5F;
/// All rooms are renewed when one body in ... has left its own at once, or since the last time.
constexpr std::size_t kLeftAtOnce = 16;
constexpr std::size_t kLeftInAll = 8;
constexpr int kRefits = 8;
/// There may be this many times as many candidates as pairs.
constexpr std::size_t kCandidates = 2;
/// Worth a thread, at some nanoseconds each.
constexpr int kBoxes = 512;

/// `box`, with room to move on as it did from `before` to now.
FloatBox room_for(const FloatBox& box, const FloatBox& before) {
  FloatBox room = box;
  for (std::size_t k = 0; k < 3; ++k) {
    const float extent = box.upper[k] - box.lower[k];
    const float down = box.lower[k] - before.lower[k], up = box.upper[k] - before.upper[k];
    const float most = kStretchMax * extent;
    const auto ahead = [most](float step) {  // a leap is no motion to go by
      return std::abs(step) < 0.5F * most ? std::clamp(kStepsAhead * step, -most, most) : 0.0F;
    };
    constexpr auto reach = static_cast<float>(kFloatReach);
    room.lower[k] = std::max(-reach, room.lower[k] + std::min(0.0F, ahead(down)) - kRoom * extent);
    room.upper[k] = std::min(reach, room.upper[k] + std::max(0.0F, ahead(up)) + kRoom * extent);
  }
  return room;
}

/// Calls `act(i)` for every i whose byte is not 0. Where most are, eight at a time are passed by.
template <class F>
void for_each_marked(std::span<const std::uint8_t> marks, const F& act) {
  for (std::size_t i = 0; i < marks.size();) {
    std::uint64_t eight = 1;
    if (i + sizeof eight <= marks.size()) std::memcpy(&eight, &marks[i], sizeof eight);
    const std::size_t end = std::min(marks.size(), i + sizeof eight);
    if (eight == 0) {
      i = end;
      continue;
    }
    for (; i < end; ++i) {
      if (marks[i] != 0) act(i);
    }
  }
}

enum class Home : std::uint8_t { none, old, young };

class KeptBroadPhase final : public BroadPhase {
 public:
  BroadPhaseReport find_pairs(const BroadPhaseInput& input, std::vector<BodyPair>& pairs) override {
    report_ = {};
    most_ = pairs_max(input.boxes.size());
    if (fresh_pairs_.are_due() && find_fresh(input, pairs)) return report_;
    if (input.renumbered) renumber(input.ids);
    look(input);
    const bool is_renewal = should_renew();
    fresh_pairs_.note_call_with_rooms(is_renewal, method_ == "grid");
    const bool fits = is_renewal ? renew(input) : update(input);
    if (fits) {
      report_.boxes_seen += room_pairs_.compare(input, changed_, left_, pairs);
      add_planes(input, pairs);
    }
    remember(input);
    report_.method = method_;
    if (fits && pairs.size() <= most_) return report_;
    forget();
    const BroadPhaseReport crowd = find_crowd_pairs(input, pairs);
    report_.crowded = crowd.crowded;
    report_.boxes_seen += crowd.boxes_seen;
    report_.nodes_seen += crowd.nodes_seen;
    if (!crowd.method.empty()) report_.method = crowd.method;
    return report_;
  }

 private:
  /// All pairs without rooms. False: that does not suit them, or they are too many.
  bool find_fresh(const BroadPhaseInput& input, std::vector<BodyPair>& pairs) {
    bool fits = fresh_pairs_.find(input, most_, pairs, report_);
    if (fits) add_planes(input, pairs);
    fits &= pairs.size() <= most_;
    if (fits) {
      forget();
    } else {
      fresh_pairs_.stop();
      report_ = {};
    }
    if (fits && !fresh_pairs_.are_due()) last_.assign(input.boxes.begin(), input.boxes.end());
    return fits;
  }

  /// Those that are still here keep what is known of them.
  void renumber(std::span<const std::int64_t> ids) {
    if (ids.empty() || ids_.size() != last_.size()) {
      forget();
    } else if (ids.size() < ids_.size() || !std::equal(ids_.begin(), ids_.end(), ids.begin())) {
      now_.assign(ids_.size(), -1);
      for (std::size_t i = 0, k = 0; i < ids_.size(); ++i) {
        while (k < ids.size() && ids[k] < ids_[i]) ++k;
        if (k < ids.size() && ids[k] == ids_[i]) now_[i] = static_cast<std::int32_t>(k);
      }
      renumber_all(ids.size());
    }
    ids_.assign(ids.begin(), ids.end());
  }

  /// `now_` has the new slots.
  void renumber_all(std::size_t slots) {
    for (std::size_t i = 0; i < now_.size(); ++i) {
      housed_ -= now_[i] < 0 && homes_[i] != Home::none ? 1 : 0;
    }
    room_pairs_.renumber(now_);
    old_.moving.renumber(now_);
    old_.immovable.renumber(now_);
    young_.renumber(now_);
    young_changed_ = true;
    const auto carry = [&](auto& values) {
      std::remove_reference_t<decltype(values)> carried(slots);
      for (std::size_t i = 0; i < now_.size(); ++i) {
        if (now_[i] >= 0) carried[index(now_[i])] = values[i];
      }
      values.swap(carried);
    };
    carry(last_);
    carry(moves_);
    carry(rooms_);
    carry(homes_);
    carry(places_);
    resize(slots);
  }

  /// Who has changed, who has left his room, and who needs one.
  void look(const BroadPhaseInput& input) {
    const std::size_t slots = input.boxes.size();
    resize(std::max(slots, last_.size()));
    changed_slots_.clear();
    entering_.clear();
    newcomers_ = 0;
    has_left_ = false;
    std::fill(changed_.begin(), changed_.end(), std::uint8_t{0});
    std::fill(left_.begin(), left_.end(), std::uint8_t{0});
    stays_.resize(slots);
    input.executor->for_ranges(static_cast<int>(slots), kBoxes, [&](int begin, int end) {
      // By pointers that no byte that is written could be part of.
      const Aabb *const boxes = input.boxes.data(), *const last = last_.data();
      const std::uint8_t *const moves = input.moves.data(), *const moved = moves_.data();
      for (std::size_t i = index(begin); i < index(end); ++i) {
        const bool moves_alike = moves[i] == moved[i];
        if (same(boxes[i], last[i]) && moves_alike) continue;
        changed_[i] = 1;
        stays_[i] = homes_[i] != Home::none && is_usable(boxes[i]) && moves_alike &&
                    contains(rooms_[i], to_float(boxes[i], origin_));
      }
    });
    for_each_marked({changed_.data(), slots}, [&](std::size_t i) {
      const auto slot = static_cast<std::int32_t>(i);
      changed_slots_.push_back(slot);
      if (stays_[i] != 0) return;
      const bool usable = is_usable(input.boxes[i]);
      if (homes_[i] != Home::none) leave(i, usable && input.moves[i] == moves_[i]);
      if (!usable) return;
      entering_.push_back(slot);
      newcomers_ += homes_[i] == Home::none ? 1 : 0;
    });
    for (std::size_t i = slots; i < last_.size(); ++i) leave(i, false);
    report_.boxes_seen += static_cast<std::int64_t>(slots);
  }

  /// `returns`: it enters again at once, and stays young if it was.
  void leave(std::size_t i, bool returns) {
    if (homes_[i] == Home::none) return;
    left_[i] = changed_[i] = 1;  // its pairs are looked at, be its slot gone
    has_left_ = true;
    if (homes_[i] == Home::young && returns) return;
    if (homes_[i] == Home::old) (moves_[i] != 0 ? old_.moving : old_.immovable).remove(places_[i]);
    young_changed_ |= homes_[i] == Home::young;
    homes_[i] = Home::none;
    --housed_;
  }

  bool should_renew() const {
    const std::size_t bodies = housed_ + newcomers_;
    return entering_.size() * kLeftAtOnce > bodies ||
           (young_.size() + newcomers_) * kLeftInAll > bodies;
  }

  /// New rooms and trees for all. False: too many pairs.
  bool renew(const BroadPhaseInput& input) {
    origin_ = median_of(input.boxes);
    old_.clear();
    young_.clear();
    young_changed_ = true;
    housed_ = 0;
    for (std::size_t i = 0; i < input.boxes.size(); ++i) {
      if (!is_usable(input.boxes[i])) continue;
      homes_[i] = Home::old;
      old_.add(static_cast<std::int32_t>(i), input.moves[i] != 0);
      ++housed_;
    }
    for_each_index(*input.executor, input.boxes.size(), kBoxes, [&](std::size_t i) {
      if (is_usable(input.boxes[i])) make_room(i, input);
    });
    const bool any_moves = !old_.moving_slots.empty();
    curve_ = MortonCurve(rooms_, any_moves ? old_.moving_slots : old_.immovable_slots);
    old_.build(rooms_, curve_);
    const auto note = [this](std::int32_t place, std::int32_t slot) {
      places_[index(slot)] = place;
    };
    old_.moving.for_each_place(note);
    old_.immovable.for_each_place(note);
    report_.boxes_seen += static_cast<std::int64_t>(housed_);

    fresh_.clear();
    std::fill(changed_.begin(), changed_.end(), std::uint8_t{0});  // marks the large, for now
    const auto add = [this](std::int32_t i, std::int32_t j) {
      const auto [a, b] = std::minmax(i, j);
      fresh_.push_back({a, b});
      return fresh_.size() <= kCandidates * most_;
    };
    join_moving(*input.executor, add);
    const bool few_move = old_.moving.size() < old_.immovable.size();
    const BoxTree& tree = few_move ? old_.immovable : old_.moving;
    for (const std::int32_t slot : few_move ? old_.moving_slots : old_.immovable_slots) {
      if (fresh_.size() > kCandidates * most_) return false;
      report_.nodes_seen +=
          tree.query(rooms_[index(slot)], [&](std::int32_t other) { add(slot, other); });
    }
    if (fresh_.size() > kCandidates * most_) return false;
    sorter_.sort(input.boxes.size(), fresh_);
    room_pairs_.replace(fresh_);
    std::fill(changed_.begin(), changed_.end(), std::uint8_t{1});
    return true;
  }

  /// Pairs among those that move: by a grid if it suits them.
  template <class F>
  void join_moving(Executor& executor, const F& add) {
    method_ = grid_.build(rooms_, old_.moving_slots) ? "grid" : "tree";
    if (method_ == "tree") {
      report_.nodes_seen += old_.moving.join(add);
      return;
    }
    report_.nodes_seen +=
        parts_.find(executor, grid_.boxes(), fresh_,
                    [this](std::size_t begin, std::size_t end, std::vector<BodyPair>& found) {
                      return grid_.join(begin, end, [&](std::int32_t i, std::int32_t j) {
                        const auto [a, b] = std::minmax(i, j);
                        found.push_back({a, b});
                        return found.size() <= kCandidates * most_;
                      });
                    });
    for (const std::int32_t slot : grid_.large()) changed_[index(slot)] = 1;
    for (const std::int32_t slot : grid_.large()) {
      report_.nodes_seen += old_.moving.query(rooms_[index(slot)], [&](std::int32_t other) {
        if (changed_[index(other)] == 0 || slot < other) add(slot, other);
      });
    }
  }

  /// Rooms and pairs for those that enter. False: too many pairs.
  bool update(const BroadPhaseInput& input) {
    if (!has_left_ && entering_.empty()) return true;
    if (young_changed_) {
      young_.keep([this](std::int32_t slot) { return homes_[index(slot)] == Home::young; });
    }
    for (const std::int32_t slot : entering_) {
      const std::size_t i = index(slot);
      make_room(i, input);
      left_[i] = 1;  // its old pairs, too, go
      if (homes_[i] == Home::young) continue;
      homes_[i] = Home::young;
      young_.add(slot, input.moves[i] != 0);
      young_changed_ = true;
      ++housed_;
    }
    fresh_.clear();
    if (!entering_.empty()) plant_young();
    report_.nodes_seen += parts_.find(
        *input.executor, entering_.size(), fresh_,
        [&](std::size_t begin, std::size_t end, std::vector<BodyPair>& found) {
          std::int64_t seen = 0;
          for (std::size_t k = begin; k < end && found.size() <= kCandidates * most_; ++k) {
            seen += find_partners(entering_[k], input, found);
          }
          return seen;
        });
    if (room_pairs_.size() + fresh_.size() > kCandidates * most_) return false;
    sorter_.sort(last_.size(), fresh_);
    room_pairs_.insert(fresh_);
    return true;
  }

  /// Sorting is half the work of a young tree, and not needed every time.
  void plant_young() {
    if (young_changed_ || ++refits_ >= kRefits) {
      young_.build(rooms_, curve_);
      young_changed_ = false;
      refits_ = 0;
    } else {
      young_.refit(rooms_);
    }
    report_.boxes_seen += static_cast<std::int64_t>(young_.size());
  }

  void make_room(std::size_t i, const BroadPhaseInput& input) {
    const FloatBox box = to_float(input.boxes[i], origin_);
    rooms_[i] = room_for(box, is_usable(last_[i]) ? to_float(last_[i], origin_) : box);
  }

  std::int64_t find_partners(std::int32_t slot, const BroadPhaseInput& input,
                             std::vector<BodyPair>& found) const {
    const auto add = [&](std::int32_t other) {
      if (other == slot) return;
      if (left_[index(other)] != 0 && other < slot) return;  // it has found this one already
      const auto [a, b] = std::minmax(slot, other);
      found.push_back({a, b});
    };
    std::int64_t seen = 0;
    for (const Layer* layer : {&old_, &young_}) {
      seen += layer->moving.query(rooms_[index(slot)], add);
      if (input.moves[index(slot)] != 0) seen += layer->immovable.query(rooms_[index(slot)], add);
    }
    return seen;
  }

  void add_planes(const BroadPhaseInput& input, std::vector<BodyPair>& pairs) {
    if (input.planes.empty()) return;
    report_.boxes_seen += static_cast<std::int64_t>(input.planes.size() * input.boxes.size());
    fresh_.clear();
    add_plane_pairs(input, most_, fresh_);
    sorter_.sort(input.boxes.size(), fresh_);
    spare_.resize(pairs.size() + fresh_.size());
    std::merge(pairs.begin(), pairs.end(), fresh_.begin(), fresh_.end(), spare_.begin());
    pairs.swap(spare_);
  }

  void remember(const BroadPhaseInput& input) {
    for_each_index(*input.executor, changed_slots_.size(), kBoxes, [&](std::size_t k) {
      const std::size_t i = index(changed_slots_[k]);
      last_[i] = input.boxes[i];
      moves_[i] = input.moves[i];
    });
    resize(input.boxes.size());
  }

  void forget() {
    resize(0);
    ids_.clear();
    room_pairs_.clear();
    old_.clear();
    old_.build({}, curve_);  // no renewal follows where no box is usable
    young_.clear();
    young_changed_ = true;
    housed_ = 0;
  }

  void resize(std::size_t slots) {
    last_.resize(slots);
    moves_.resize(slots);
    rooms_.resize(slots);
    homes_.resize(slots, Home::none);
    places_.resize(slots);
    changed_.resize(slots);
    left_.resize(slots);
  }

  // By slot.
  std::vector<Aabb> last_;           // what the last call was told
  std::vector<std::uint8_t> moves_;  // likewise
  std::vector<std::int64_t> ids_;    // likewise; none: not known
  std::vector<FloatBox> rooms_;
  std::vector<Home> homes_;
  std::vector<std::int32_t> places_;   // in the old tree
  std::vector<std::uint8_t> changed_;  // in this call
  std::vector<std::uint8_t> left_;     // its room, in this call
  std::vector<std::uint8_t> stays_;    // in its room, or as it was

  Vector origin_ = Vector::Zero();  // of the rooms
  Layer old_, young_;
  BoxGrid grid_;
  std::string_view method_ = "tree";  // of the last renewal
  MortonCurve curve_;
  std::size_t housed_ = 0;      // slots with a home
  std::size_t newcomers_ = 0;   // those entering that had none
  bool young_changed_ = false;  // its slots are not those of its trees
  int refits_ = 0;
  RoomPairs room_pairs_;
  std::vector<std::int32_t> changed_slots_, entering_;
  bool has_left_ = false;
  std::size_t most_ = 0;           // pairs
  std::vector<std::int32_t> now_;  // the slot of each, after a change of slots
  std::vector<BodyPair> fresh_, spare_;
  PairParts parts_;
  PairSorter sorter_;
  FreshPairs fresh_pairs_;
  BroadPhaseReport report_;
};

}  // namespace

std::unique_ptr<BroadPhase> make_kept_broad_phase() { return std::make_unique<KeptBroadPhase>(); }

}  // namespace cradle
