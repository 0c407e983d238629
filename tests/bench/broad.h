/// The broad phase by itself: cost a body, with FCL's tree on the same boxes in the same run.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "server/stopwatch.h"
#include "tests/bench/report.h"

namespace cradle::bench {

struct BoxScene;

struct BroadCase {
  std::string_view name;
  std::size_t bodies;
  double moving;  ///< part of the bodies that move in a step
  int steps, fcl_steps;
  void (*arrange)(BoxScene&);  ///< changes drifting_boxes; null: nothing
  void (*step)(BoxScene&, std::size_t moving);
  std::string_view about;
};

/// In the order in which they are listed and run.
std::span<const BroadCase> broad_cases();

/// One line of the report. Times are of everything a call does: update and pairs.
struct BroadRow {
  std::string name, method;
  std::size_t bodies = 0;
  double moving = 0;
  TickTimes us_per_step;       ///< ours, all steps
  TickTimes late_us_per_step;  ///< ours, of the last tenth of the steps
  TickTimes fcl_us_per_step;   ///< FCL's, of the first steps
  double pairs_per_body = 0;
  double work_per_body = 0;  ///< boxes and nodes looked at in a step
  std::int64_t differing =
      0;                     ///< pairs that only one of the two has found, of all steps they share
  std::int64_t crowded = 0;  ///< BroadPhaseReport::crowded, in the last step
};

BroadRow run(const BroadCase& which);

std::string broad_header(Format format);
std::string line(Format format, const BroadRow& row);

}  // namespace cradle::bench
