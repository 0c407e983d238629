/// Wall time of ticks, for `cradled simulate` and the benchmark: their one place that reads a
/// clock.
#pragma once

#include <chrono>
#include <vector>

namespace cradle {

class Stopwatch {
 public:
  double elapsed_us() const {
    return std::chrono::duration<double, std::micro>(Clock::now() - start_).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

/// By nearest rank: the median of an even number is the lower of the two in the middle.
struct TickTimes {
  double median_us = 0, mean_us = 0, p99_us = 0;
};
/// All zero if there are none.
TickTimes summarise(std::vector<double> times_us);

}  // namespace cradle
