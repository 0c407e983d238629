/// What `cradled simulate` writes: the trace of all bodies (CSV) and the summary of a run (JSON).
///
/// All numbers have 17 digits, which is every bit of a double.
#pragma once

#include <array>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/stopwatch.h"
#include "server/world/world.h"

namespace cradle {

/// An output file that cannot be opened or written: "FILE: reason".
class OutputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file, or standard output for the path "-".
class Output {
 public:
  /// Throws OutputError.
  explicit Output(const std::string& path);
  void write(const std::string& text);
  /// Call it when all is written. Throws OutputError if any of it could not be.
  void finish();

 private:
  std::ostream& stream();

  std::string path_;
  std::ofstream file_;
  int error_ = 0;  // of the first write that failed
};

/// First line of a trace.
inline constexpr const char* kTraceHeader =
    "tick,time_s,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n";

/// The line of one body: its pose, the velocity of its centre of mass and its angular velocity, m,
/// m/s, rad/s, in W. `name` as CSV quotes it.
std::string trace_line(Tick tick, double time_s, const std::string& name, const BodyState& state);

/// `text` in quotes if CSV needs them (RFC 4180).
std::string csv_field(const std::string& text);

struct Summary {
  std::string scene;
  WorldSettings settings;
  int threads = 1;
  Tick ticks = 0;
  double wall_time_s = 0;  ///< of all steps
  TickTimes tick_times;
  std::int64_t bodies = 0;
  std::int64_t steps_unsolved = 0;       ///< as StepReport::unsolved, of all ticks
  std::int64_t islands_makeshift = 0;    ///< likewise
  std::int64_t springs_unconverged = 0;  ///< as StepReport's, of all ticks
  std::int64_t quarantined = 0;
  std::int64_t not_colliding = 0;  ///< bodies of shapes that do not collide yet
  StepReport last_step;
  /// Of all ticks: the largest, and sums over those that had a balance.
  double residual_max_mps = 0, residual_relative_max = 0;
  StepBalance balance;       ///< `tick`: how many there were
  double energy_paid_J = 0;  ///< StepReport::paid_J of all ticks
  double energy_unaccounted_max_J = 0, momentum_unaccounted_max_Ns = 0;
  std::int64_t crowded_max = 0;        ///< StepReport::crowded, of all ticks
  std::int64_t stopped_at_impact = 0;  ///< of StepReport, over all ticks
  std::int64_t impacts = 0, impacts_ordered = 0, impacts_spent = 0;  ///< likewise
  int sub_steps_max = 0;                                             ///< of all ticks
  std::int64_t impacts_unresolved = 0, spins_cut = 0;                ///< likewise
  std::int64_t ticks_in_halves = 0;                                  ///< StepReport::parts
  int surfaces_passing_max = 0;  ///< StepReport::surfaces_passing, of all ticks
  double penetration_max_m = 0;  ///< of all ticks
  Totals totals;
  std::array<std::uint8_t, 8> hash{};
};
std::string to_json(const Summary& summary);

}  // namespace cradle
