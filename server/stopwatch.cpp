#include "server/stopwatch.h"

#include <algorithm>
#include <numeric>

namespace cradle {

TickTimes summarise(std::vector<double> times_us) {
  const std::size_t n = times_us.size();
  if (n == 0) return {};
  std::sort(times_us.begin(), times_us.end());
  const double sum = std::accumulate(times_us.begin(), times_us.end(), 0.0);
  // The least value that `percent` of all do not exceed, which is number ceil(percent n / 100).
  const auto percentile = [&](std::size_t percent) {
    return times_us[(percent * n + 99) / 100 - 1];
  };
  return {percentile(50), sum / static_cast<double>(n), percentile(99)};
}

}  // namespace cradle
