// Errors of free motion, against closed form and what it conserves.
#include <cmath>

#include "tests/bench/conservation.h"
#include "tests/bench/measure.h"

namespace cradle::bench {
namespace {

/// Largest distance of the first dynamic body from x0 + v0 t + g t^2 / 2, m.
class DistanceFromParabola final : public Measure {
 public:
  explicit DistanceFromParabola(const Scene& scene)
      : body_(dynamic_bodies(scene).at(0)),
        x0_(to_eigen(scene.bodies[body_].p_WBo)),
        v0_(to_eigen(scene.bodies[body_].v_WBcm)),
        g_(to_eigen(scene.settings.gravity_W)) {}

  void tick(const Observation& now) override {
    const double t = now.time_s;
    const Vector exact = x0_ + v0_ * t + g_ * (t * t / 2);
    error_ = worse(error_, (to_eigen(now.states[body_].p_WBo) - exact).norm());
  }
  double error() const override { return error_; }

 private:
  std::size_t body_;
  Vector x0_, v0_, g_;
  double error_ = 0;
};

/// Largest relative change of the kinetic energy or of the angular momentum (as a vector) of bodies
/// that turn freely.
class DriftOfTumbling final : public Measure {
 public:
  explicit DriftOfTumbling(const Scene& scene) : scene_(scene), start_(budget_at_start(scene)) {}

  void tick(const Observation& now) override {
    const Budget b = budget(scene_, now.states);
    const double energy = std::abs(b.kinetic_J() - start_.kinetic_J()) / start_.kinetic_J();
    const double momentum = (b.angular_momentum_Nms - start_.angular_momentum_Nms).norm() /
                            start_.angular_momentum_Nms.norm();
    error_ = worse(error_, worse(energy, momentum));
  }
  double error() const override { return error_; }

 private:
  const Scene& scene_;
  Budget start_;
  double error_ = 0;
};

/// Largest relative change of the rotational energy of all bodies together.
class DriftOfRotationalEnergy final : public Measure {
 public:
  explicit DriftOfRotationalEnergy(const Scene& scene)
      : scene_(scene), start_J_(budget_at_start(scene).rotational_J) {}

  void tick(const Observation& now) override {
    const double change_J = budget(scene_, now.states).rotational_J - start_J_;
    error_ = worse(error_, std::abs(change_J) / start_J_);
  }
  double error() const override { return error_; }

 private:
  const Scene& scene_;
  double start_J_;
  double error_ = 0;
};

}  // namespace

std::unique_ptr<Measure> distance_from_parabola(const Scene& scene) {
  return std::make_unique<DistanceFromParabola>(scene);
}
std::unique_ptr<Measure> drift_of_tumbling(const Scene& scene) {
  return std::make_unique<DriftOfTumbling>(scene);
}
std::unique_ptr<Measure> drift_of_rotational_energy(const Scene& scene) {
  return std::make_unique<DriftOfRotationalEnergy>(scene);
}

}  // namespace cradle::bench
