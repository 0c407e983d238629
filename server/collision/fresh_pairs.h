/// All pairs found anew, by a grid: for worlds in which nearly everything moves on. Private to this
/// folder.
#pragma once

#include <vector>

#include "server/collision/box_grid.h"
#include "server/collision/broad_phase.h"
#include "server/collision/pair_parts.h"
#include "server/collision/pair_rules.h"

namespace cradle {

class FreshPairs {
 public:
  /// Whether this call is to do without rooms.
  bool are_due() const { return calls_left_ > 0; }
  /// A call had rooms. If these have to be renewed soon after the last time, and a grid had suited
  /// the bodies, the next calls are to do without.
  void note_call_with_rooms(bool are_renewed, bool is_by_grid);
  void stop();

  /// As BroadPhase::find_pairs, but without planes. False, and no use, if bodies do not suit a
  /// grid; `pairs` may then have any. Ends early when there are more than `most`.
  bool find(const BroadPhaseInput& input, std::size_t most, std::vector<BodyPair>& pairs,
            BroadPhaseReport& report);

 private:
  /// Rooms that last for fewer calls are not worth it. So many calls go by before the next attempt,
  /// twice as many after each in vain.
  static constexpr int kWorthRooms = 8, kCalls = 16, kCallsMax = 64;

  bool sort_out(const BroadPhaseInput& input);

  int calls_left_ = 0, next_calls_ = kCalls;
  int calls_with_rooms_ = kWorthRooms;  // since they were renewed; so many: it was worth it
  std::vector<FloatBox> boxes_;
  std::vector<std::int32_t> moving_, immovable_;
  BoxGrid grid_;
  PairParts parts_;
  PairSorter sorter_;
};

}  // namespace cradle
