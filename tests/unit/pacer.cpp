// Deadlines without drift, and what overload does to simulated time. The clock is the test's.
#include "server/pacer.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <deque>
#include <random>

namespace cradle {
namespace {

using namespace std::chrono_literals;
using PacerTime = Pacer::Clock::time_point;
using Duration = Pacer::Clock::duration;

constexpr PacerTime kPacerStart{1000h};

double seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }
Duration period_of(double rate_hz) {
  return Duration(static_cast<std::int64_t>(std::llround(1e9 / rate_hz)));
}

}  // namespace

TEST_CASE("a million deadlines at awkward rates do not drift by a nanosecond") {
  for (const double rate_hz : {1.0, 60.0, 144.0, 999.9, 1000.0 / 7, 10'000.0}) {
    CAPTURE(rate_hz);
    Pacer pacer(rate_hz, kPacerStart);
    std::int64_t worst_ns = 0;
    for (std::int64_t k = 1; k <= 1'000'000; ++k) {
      // Tick k is due k / rate after the start; long double holds that to 1e-4 ns.
      const auto due_ns = static_cast<long double>(k) / static_cast<long double>(rate_hz) * 1e9L;
      const auto off_ns = (pacer.deadline() - kPacerStart).count() - std::llround(due_ns);
      worst_ns = std::max<std::int64_t>(worst_ns, std::abs(off_ns));
      pacer.begin_tick(pacer.deadline() + 20us);  // always a little late, as sleeping is
    }
    CHECK(worst_ns <= 1);
    CHECK(pacer.overruns() == 0);
  }
}

TEST_CASE("a tick up to one period late is made up for, a later one moves the schedule") {
  const Duration period = 10ms;
  Pacer pacer(100, kPacerStart);
  pacer.begin_tick(pacer.deadline() + period);
  CHECK(pacer.overruns() == 0);
  CHECK(pacer.deadline() == kPacerStart + 2 * period);

  const PacerTime late = pacer.deadline() + period + 1ns;
  pacer.begin_tick(late);
  CHECK(pacer.overruns() == 1);
  CHECK(pacer.deadline() == late + period);
}

TEST_CASE("after a stall of any length there is no burst of ticks to catch up") {
  // Ticks of random cost, some much longer than a period. In any span of wall time there are never
  // more than one tick beyond what the rate gives, whatever was missed before.
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    std::mt19937_64 random(seed);
    const double rate_hz = 144;
    const double period_s = 1 / rate_hz;
    Pacer pacer(rate_hz, kPacerStart);
    PacerTime now = kPacerStart;
    std::deque<PacerTime> begins;
    for (int k = 0; k < 5000; ++k) {
      now = std::max(now, pacer.deadline());
      pacer.begin_tick(now);
      begins.push_back(now);
      for (std::size_t back = 1; back < std::min<std::size_t>(begins.size(), 200); ++back) {
        const double span_s = seconds(now - begins[begins.size() - 1 - back]);
        REQUIRE(static_cast<double>(back) <= span_s * rate_hz + 1 + 1e-6);
      }
      const double cost_s = random() % 50 == 0
                                ? 20 * period_s * static_cast<double>(random() % 8)
                                : period_s * 1e-3 * static_cast<double>(random() % 1500);
      now += Duration(static_cast<std::int64_t>(cost_s * 1e9));
    }
    CHECK(pacer.overruns() > 0);
  }
}

TEST_CASE("ticks that cost twice their period slow simulated time by half") {
  const double rate_hz = 100;
  Pacer pacer(rate_hz, kPacerStart);
  PacerTime now = kPacerStart;
  std::int64_t ticks = 0;
  while (now < kPacerStart + 100s) {
    now = std::max(now, pacer.deadline());
    pacer.begin_tick(now);
    ++ticks;
    now += 2 * period_of(rate_hz);
  }
  CHECK(std::abs(ticks - 5000) <= 1);
  CHECK(pacer.overruns() > 2000);
  CHECK(pacer.real_time_factor(ticks, now) == Approx(0.5).epsilon(1e-3));
}

TEST_CASE("the real-time factor is simulated over wall time of the last second or more") {
  Pacer pacer(100, kPacerStart);
  CHECK(pacer.real_time_factor(0, kPacerStart) == 1);  // nothing is known yet
  CHECK(pacer.real_time_factor(20, kPacerStart + 500ms) == 1);
  CHECK(pacer.real_time_factor(50, kPacerStart + 1s) == Approx(0.5));
  CHECK(pacer.real_time_factor(150, kPacerStart + 1500ms) ==
        Approx(0.5));                                                   // too short a span to tell
  CHECK(pacer.real_time_factor(250, kPacerStart + 3s) == Approx(1.0));  // 200 ticks in 2 s
  CHECK(pacer.real_time_factor(250, kPacerStart + 5s) == Approx(0.0).margin(1e-12));
}

TEST_CASE("a restart forgets the time before it and is no overrun") {
  Pacer pacer(100, kPacerStart);
  for (int i = 0; i < 5; ++i) pacer.begin_tick(pacer.deadline());
  pacer.restart(kPacerStart + 60s);
  CHECK(pacer.deadline() == kPacerStart + 60s + 10ms);
  CHECK(pacer.overruns() == 0);
}

}  // namespace cradle
