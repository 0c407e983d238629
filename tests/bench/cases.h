/// The table of what is measured.
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "tests/bench/measure.h"

namespace cradle::bench {

struct Case {
  std::string_view name;
  std::string_view scene_file;  ///< in tests/scenes
  double duration_s;
  double warm_up_s;  ///< not timed, but watched for errors
  std::unique_ptr<Measure> (*measure)(const Scene&);
  std::string_view error_kind;
  std::string_view about;
  /// Penetration is looked for at each so-manieth tick and the last: the check of hulls takes
  /// longer than the tick.
  int ticks_a_look = 1;
  /// What happens changes from tick to tick: beside others its time is the mean, else the median.
  bool time_is_mean = false;
};

/// In the order in which they are listed and run.
std::span<const Case> cases();

/// Null if there is none of that name.
const Case* find_case(std::string_view name);

}  // namespace cradle::bench
