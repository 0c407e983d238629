/// Energy and momentum of a scene from published states, by formulas of our own.
#pragma once

#include <optional>
#include <span>

#include "server/collision/geometry.h"
#include "server/scene.h"

namespace cradle::bench {

/// Sums over dynamic bodies, in W, about the world's origin.
struct Budget {
  double translational_J = 0;
  double rotational_J = 0;
  double potential_J = 0;  ///< in the scene's gravity, zero at the origin
  Vector momentum_Ns = Vector::Zero();
  Vector angular_momentum_Nms = Vector::Zero();
  double momentum_sum_Ns = 0;  ///< of the magnitudes: what a change of the momentum is held against
  double angular_momentum_sum_Nms = 0;

  double kinetic_J() const { return translational_J + rotational_J; }
  double energy_J() const { return kinetic_J() + potential_J; }
};

/// `states` has one entry for each of Scene::bodies.
Budget budget(const Scene& scene, std::span<const BodyState> states);

/// The budget of the scene before its first step.
Budget budget_at_start(const Scene& scene);

/// How far energy and momentum moved since the start of a run.
class Drift {
 public:
  explicit Drift(const Scene& scene);

  /// After every tick.
  void tick(const Budget& now);

  /// (E - E0) / |E0|: the largest gain of all ticks, or the last change if nothing was gained
  /// beyond rounding (1e-12). None if there was no energy at the start.
  std::optional<double> energy() const;

  /// The largest |P - P0| of all ticks over the sum of the bodies' |P|, and the same of the angular
  /// momentum; the larger of the two. None where something outside pushes: gravity, or bodies that
  /// are not dynamic.
  std::optional<double> momentum() const;

 private:
  Budget start_;
  bool isolated_ = true;
  double last_energy_ = 0;
  double largest_energy_ = 0;
  double momentum_ = 0;
};

}  // namespace cradle::bench
