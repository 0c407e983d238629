// Nothing is kept from call to call, so nothing has to be kept up. Bodies that move go into a grid
// by their boxes as they are; the few that do not, and the few too large for its cells, ask it for
// their partners. Boxes are culled in single precision, and those left compared in double.
//
// Cost: 25 ns a body (Xeon, 3 GHz), of which a third to sort them into the cells.
#include "server/collision/fresh_pairs.h"

#include <algorithm>

#include "server/collision/index.h"

namespace cradle {
namespace {

constexpr std::size_t kFewImmovable = 64;  // their boxes may be of any size
constexpr std::size_t kPairsOfLarge = 4;   // to compare, for each body at most

}  // namespace

void FreshPairs::note_call_with_rooms(bool are_renewed, bool is_by_grid) {
  if (!are_renewed) {
    calls_with_rooms_ = std::min(calls_with_rooms_ + 1, kWorthRooms);
    if (calls_with_rooms_ == kWorthRooms) next_calls_ = kCalls;
    return;
  }
  if (calls_with_rooms_ < kWorthRooms && is_by_grid) {
    calls_left_ = next_calls_;
    next_calls_ = std::min(2 * next_calls_, kCallsMax);
  }
  calls_with_rooms_ = 0;
}

void FreshPairs::stop() {
  calls_left_ = 0;
  calls_with_rooms_ = kWorthRooms;
}

bool FreshPairs::find(const BroadPhaseInput& input, std::size_t most, std::vector<BodyPair>& pairs,
                      BroadPhaseReport& report) {
  if (--calls_left_ == 0) calls_with_rooms_ = kWorthRooms;
  if (!sort_out(input)) return false;
  pairs.clear();
  const auto adding_to = [&](std::vector<BodyPair>& found) {
    return [&](std::int32_t i, std::int32_t j) {
      if (overlap(input.boxes[index(i)], input.boxes[index(j)])) {
        const std::int32_t ascending[] = {j, i, j}, first = i < j ? 1 : 0;  // it is chance
        found.push_back({ascending[first], ascending[first + 1]});
      }
      return found.size() <= most;
    };
  };
  report.method = "grid";
  report.nodes_seen +=
      parts_.find(*input.executor, grid_.boxes(), pairs,
                  [&](std::size_t begin, std::size_t end, std::vector<BodyPair>& found) {
                    return grid_.join(begin, end, adding_to(found));
                  });
  const auto add = adding_to(pairs);
  const auto large = grid_.large();
  for (std::size_t k = 0; k < large.size(); ++k) {
    report.nodes_seen += grid_.query(boxes_[index(large[k])], large[k], add);
    for (std::size_t j = 0; j < k; ++j) add(large[k], large[j]);
  }
  for (const std::int32_t slot : immovable_) {
    report.nodes_seen += grid_.query(boxes_[index(slot)], slot, add);
    for (const std::int32_t other : large) add(slot, other);
  }
  report.boxes_seen += static_cast<std::int64_t>(input.boxes.size() + pairs.size());
  if (pairs.size() <= most) sorter_.sort(input.boxes.size(), pairs);
  return true;
}

/// Who goes into the grid. False: it does not suit them.
bool FreshPairs::sort_out(const BroadPhaseInput& input) {
  const Vector origin = median_of(input.boxes);
  boxes_.resize(input.boxes.size());
  constexpr int kWorthAThread = 1024;  // some nanoseconds each
  for_each_index(*input.executor, input.boxes.size(), kWorthAThread,
                 [&](std::size_t i) { boxes_[i] = to_float(input.boxes[i], origin); });
  moving_.clear();
  immovable_.clear();
  for (std::size_t i = 0; i < input.boxes.size(); ++i) {
    if (!is_usable(input.boxes[i])) continue;
    (input.moves[i] != 0 ? moving_ : immovable_).push_back(static_cast<std::int32_t>(i));
    if (immovable_.size() > kFewImmovable) return false;
  }
  if (!grid_.build(boxes_, moving_)) return false;
  const std::size_t large = grid_.large().size();
  return large * (large + immovable_.size()) <= kPairsOfLarge * moving_.size();
}

}  // namespace cradle
