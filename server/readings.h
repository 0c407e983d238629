/// What the metrics page tells of a daemon: counters since the start, and how things are now.
#pragma once

#include <cradle/result.h>
#include <cradle/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>

#include "protocol/transport/transport.h"
#include "server/inbox.h"
#include "server/world/world.h"

namespace cradle {

/// How often something took how long.
struct DurationHistogram {
  static constexpr std::array kBounds_s = {1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3,
                                           5e-3, 0.01, 0.02, 0.05, 0.1,  0.2,  0.5,  1.0};

  std::array<std::int64_t, kBounds_s.size() + 1> counts{};  ///< by bucket; the last: beyond
  double sum_s = 0;

  void add(double duration_s);
};

/// Wall time of the ticks that stepped the world: in all, and its parts.
struct TickHistograms {
  DurationHistogram whole, apply, collide, solve, publish;
};

struct Readings {
  std::string world;
  double period_s = 0;  ///< of a tick
  Tick tick = 0;
  TickHistograms ticks;
  std::int64_t overruns = 0;
  double real_time_factor = 0;

  std::int64_t bodies = 0, awake = 0, contacts = 0, wrenches = 0, crowded = 0, surfaces_passing = 0;
  StepReport last_step;                  ///< its balance is that of the last tick that had one
  std::int64_t quarantines = 0;          ///< since the start
  std::int64_t steps_unsolved = 0;       ///< since the start
  double energy_paid_J = 0;              ///< likewise, StepReport::paid_J
  std::int64_t springs_unconverged = 0;  ///< parts of ticks, since the start
  std::int64_t islands_makeshift = 0;    ///< as StepReport, likewise
  std::int64_t impacts = 0;              ///< of flying balls, likewise
  std::int64_t impacts_ordered = 0, impacts_spent = 0;  ///< as StepReport, likewise
  std::int64_t stopped_at_impact = 0;                   ///< bodies, in all ticks since the start
  std::int64_t impacts_unresolved = 0;                  ///< likewise
  std::int64_t spins_cut = 0;                           ///< likewise
  std::int64_t ticks_in_halves = 0;                     ///< since the start
  std::int64_t clients = 0;
  std::array<std::int64_t, kServerResults> answers{};  ///< by Result
  std::int64_t repeated_answers = 0;

  TransportStats control, states;
  Inbox::Counters inbox;
  std::int64_t unknown_channel = 0;
  std::int64_t malformed = 0;
  std::int64_t chunks_overtaken = 0;
  std::int64_t log_lines_left_out = 0;
};

/// In Prometheus' text format 0.0.4 (prometheus.io/docs/instrumenting/exposition_formats).
std::string metrics_text(const Readings& readings);

/// Hands readings from the tick to whoever shows them.
class ReadingsBoard {
 public:
  /// Never waits: if the board is being read at this moment, the old readings stay.
  void put(const Readings& readings);

  /// Calls `look(readings)`. They stay as they are meanwhile.
  template <class F>
  auto read(F&& look) const {
    const std::lock_guard lock(mutex_);
    return look(latest_);
  }

 private:
  mutable std::mutex mutex_;
  Readings latest_;
};

}  // namespace cradle
