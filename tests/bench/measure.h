/// How wrong a run was: each scene is measured against its closed form, or by an independent check,
/// on published poses alone; nothing here asks the engine how well it did.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/collision/geometry.h"
#include "server/scene.h"
#include "tests/bench/penetration.h"

namespace cradle::bench {

/// What there is to see after a tick.
struct Observation {
  double time_s = 0;                  ///< since the start
  std::span<const BodyState> states;  ///< one for each of Scene::bodies, in their order
  Penetration penetration;            ///< by our own check, at the last tick looked at
};

/// Watches one run. Made from the scene, which also tells where everything starts.
class Measure {
 public:
  virtual ~Measure() = default;
  /// After every tick.
  virtual void tick(const Observation& now) = 0;
  /// After the last tick; the unit is in Case::error_kind. NaN as soon as anything watched was NaN.
  virtual double error() const = 0;
};

/// The larger of two errors; NaN counts as larger than any number, so that it is never dropped.
inline double worse(double a, double b) { return a > b || a != a ? a : b; }

/// The places in Scene::bodies of those that move.
inline std::vector<std::size_t> dynamic_bodies(const Scene& scene) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    if (scene.bodies[i].kind == BodyKind::dynamic) found.push_back(i);
  }
  return found;
}

// One function a kind of error, by subject. Where two bodies touch, the scene lists the support
// first.

// flight.cpp
std::unique_ptr<Measure> distance_from_parabola(const Scene& scene);
std::unique_ptr<Measure> drift_of_tumbling(const Scene& scene);
std::unique_ptr<Measure> drift_of_rotational_energy(const Scene& scene);

// bouncing.cpp
std::unique_ptr<Measure> apexes_by_poses(const Scene& scene);
std::unique_ptr<Measure> apexes_by_energy(const Scene& scene);
std::unique_ptr<Measure> drift_of_kinetic_energy(const Scene& scene);

// sliding.cpp
std::unique_ptr<Measure> stopping_distance(const Scene& scene);
std::unique_ptr<Measure> rolling_speed(const Scene& scene);
std::unique_ptr<Measure> end_of_slip(const Scene& scene);
std::unique_ptr<Measure> creep_on_slope(const Scene& scene);
std::unique_ptr<Measure> acceleration_on_slope(const Scene& scene);

// stacks.cpp
std::unique_ptr<Measure> displacement(const Scene& scene);
std::unique_ptr<Measure> horizontal_drift(const Scene& scene);
std::unique_ptr<Measure> mean_penetration_at_end(const Scene& scene);

// terrain.cpp
std::unique_ptr<Measure> bodies_below_terrain(const Scene& scene);

// impact.cpp
std::unique_ptr<Measure> cradle_speeds(const Scene& scene);
std::unique_ptr<Measure> passage_through_wall(const Scene& scene);
std::unique_ptr<Measure> parting_speed(const Scene& scene);

// simbenchmark.cpp
std::unique_ptr<Measure> pushed_from_under(const Scene& scene);
std::unique_ptr<Measure> mean_square_energy_change(const Scene& scene);
std::unique_ptr<Measure> mean_square_overlap(const Scene& scene);

}  // namespace cradle::bench
