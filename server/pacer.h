/// Absolute deadlines of the monotonic clock: tick k is due at start + k / rate, without drift.
///
/// Under overload simulated time slows down: a tick that comes more than one period late moves the
/// schedule, so that nothing is skipped and nothing is caught up in a spiral.
#pragma once

#include <chrono>
#include <cstdint>

namespace cradle {

class Pacer {
 public:
  using Clock = std::chrono::steady_clock;

  Pacer(double rate_hz, Clock::time_point now) : rate_hz_(rate_hz), anchor_(now), last_(now) {}

  /// When the next tick is due.
  Clock::time_point deadline() const {
    const double seconds = static_cast<double>(ticks_ + 1) / rate_hz_;
    return anchor_ + std::chrono::nanoseconds(static_cast<std::int64_t>(seconds * 1e9));
  }

  /// The tick that was due is being done at `now`.
  void begin_tick(Clock::time_point now);

  /// Starts afresh at `now`, as after a pause.
  void restart(Clock::time_point now) {
    anchor_ = now;
    ticks_ = 0;
  }

  std::int64_t overruns() const { return overruns_; }

  /// Simulated over wall time, measured over spans of a second or more: the last whole one.
  double real_time_factor(std::int64_t tick, Clock::time_point now);

 private:
  double rate_hz_;
  Clock::time_point anchor_;
  std::int64_t ticks_ = 0;  ///< since the anchor
  std::int64_t overruns_ = 0;
  Clock::time_point last_;
  std::int64_t last_tick_ = 0;
  double factor_ = 1;
};

}  // namespace cradle
