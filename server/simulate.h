/// `cradled simulate`: a scene, the same core, no network, as fast as it goes.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "server/scene.h"
#include "server/world/world.h"

namespace cradle {

/// A scene in motion: the world with its bodies in it, and the wrenches still to come.
class SceneRun {
 public:
  /// Throws SceneError if the world refuses a body, its drag or a spring.
  explicit SceneRun(Scene scene);

  /// Begins the wrenches that are due, then steps once.
  StepReport step(Executor& executor, StepObserver* observer = nullptr);

  World& world() { return world_; }
  const World& world() const { return world_; }
  /// The id of the scene's body number `index`.
  BodyId id(std::size_t index) const;
  const Scene& scene() const { return scene_; }
  /// Wrenches that the world refused when they were due: their body was in quarantine, or gone.
  std::int64_t wrenches_left_out() const { return wrenches_left_out_; }

 private:
  void begin_due_wrenches();
  void accept(const Outcome& outcome, const char* what, std::size_t number) const;

  Scene scene_;
  World world_;
  BodyId first_;
  std::size_t next_wrench_ = 0;
  std::int64_t wrenches_left_out_ = 0;
};

struct SimulateOptions {
  std::string scene;                  ///< path
  double duration_s = 0;              ///< rounded to whole ticks, 1 or more
  std::optional<double> dt_s;         ///< instead of the scene's 1 / rate_hz
  std::optional<int> sub_steps;       ///< instead of the scene's
  std::optional<std::string> solver;  ///< of solver_names(), instead of the scene's
  std::optional<std::string> scheme;  ///< of scheme_names(), likewise
  bool is_full = false;               ///< the full model, see WorldSettings
  std::string trace;                  ///< path of a CSV file, "-": standard output, empty: none
  std::string summary;                ///< path of a JSON file, likewise
  int threads = 1;
};

/// Options that are out of range or contradict each other.
class OptionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The scene's settings, as far as no option overrides them. Throws OptionError.
WorldSettings settings_of(const SimulateOptions& options, WorldSettings settings);

/// A duration (s) in whole ticks. Throws OptionError if that is not 1 to 1e9.
std::int64_t ticks_of(double duration_s, const WorldSettings& settings);

/// Opens the outputs before the run. Throws what load_scene does, OptionError, and OutputError of
/// trace.h.
void simulate(const SimulateOptions& options);

}  // namespace cradle
