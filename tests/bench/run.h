/// One run of one case: what it cost and how wrong it was.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/stopwatch.h"
#include "tests/bench/cases.h"

namespace cradle::bench {

/// What a run changes in its scene.
struct Options {
  std::optional<std::string> method;  ///< one of solver_names()
  std::optional<double> dt_s;
  std::optional<int> sub_steps;
  int threads = 1;
  int lanes = 0;  ///< one of machine_lanes(), or 0 for the most
};

/// One line of the report. NaN where a number came out unusable; none where it has no meaning.
struct Row {
  std::string scene, engine, method;  ///< of a peer, the method is its iterations
  double dt_s = 0;
  int sub_steps = 0;
  int threads = 1;
  int lanes = 1;
  TickTimes us_per_tick;   ///< wall time of a step, everything included
  double ns_per_body = 0;  ///< of the median, dynamic bodies
  double error = 0;        ///< NaN also if the engine had to quarantine a body
  std::string error_kind;
  std::optional<double> energy_drift;    ///< Drift::energy
  std::optional<double> momentum_drift;  ///< Drift::momentum
  double penetration_max_m = 0;          ///< at any tick that was looked at
  double penetration_mean_m = 0;         ///< after the last tick
  std::string hash;                      ///< of the world after the last tick, hexadecimal
};

/// The scene of a case, as its file has it. Throws what load_scene does.
Scene scene_of(const Case& which);

/// Whatever has bodies in motion: it is stepped, and looked at.
struct Engine {
  std::function<void()> step;                                ///< a tick: what is timed
  std::function<void(std::vector<BodyState>& states)> look;  ///< as Observation::states
};

/// Called between ticks with the part of the run that is done, 0 to 1.
using Between = std::function<void(double done)>;

/// Steps the engine through the case; the row lacks what only the engine knows (engine, method,
/// sub_steps, threads, lanes, hash). `scene` is that of the case, with the rate of the run.
Row watch(const Case& which, const Scene& scene, const Engine& engine, const Between& between);

/// Throws SceneError.
Row run(const Case& which, Scene scene, const Options& options, const Between& between = {});
/// Of the case's own scene. Throws what load_scene does, too.
Row run(const Case& which, const Options& options);

}  // namespace cradle::bench
