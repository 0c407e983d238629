#include "server/pacer.h"

namespace cradle {

void Pacer::begin_tick(Clock::time_point now) {
  const auto period = std::chrono::duration<double>(1 / rate_hz_);
  if (now - deadline() > period) {
    ++overruns_;
    restart(now);
  } else {
    ++ticks_;
  }
}

double Pacer::real_time_factor(std::int64_t tick, Clock::time_point now) {
  const double wall = std::chrono::duration<double>(now - last_).count();
  if (wall >= 1) {
    factor_ = static_cast<double>(tick - last_tick_) / rate_hz_ / wall;
    last_ = now;
    last_tick_ = tick;
  }
  return factor_;
}

}  // namespace cradle
