// Errors of bodies that slide, against Coulomb's law. The support is the scene's first body, what
// slides its second; n is the support's outward normal, its z axis.
#include <cmath>
#include <vector>

#include "tests/bench/measure.h"

namespace cradle::bench {
namespace {

double friction_between(const BodySpec& a, const BodySpec& b) {
  return std::sqrt(a.material.friction * b.material.friction);
}

/// A box that slides to rest on a level floor: how far, in the plane of the floor, it ends from
/// where v0^2 / (2 mu g) would bring it, over that distance.
class StoppingDistance final : public Measure {
 public:
  explicit StoppingDistance(const Scene& scene) {
    const BodySpec& box = scene.bodies.at(1);
    const Vector v0 = to_eigen(box.v_WBcm);
    const double deceleration =
        friction_between(scene.bodies[0], box) * to_eigen(scene.settings.gravity_W).norm();
    distance_ = v0.squaredNorm() / (2 * deceleration);
    exact_ = to_eigen(box.p_WBo) + distance_ * v0.normalized();
  }

  void tick(const Observation& now) override { x_ = to_eigen(now.states[1].p_WBo); }
  double error() const override { return (x_ - exact_).head<2>().norm() / distance_; }

 private:
  double distance_ = 0;
  Vector exact_, x_ = Vector::Zero();
};

/// A sphere that slides until it rolls: its velocity at the end against 5/7 of the first one,
/// relative.
class RollingSpeed final : public Measure {
 public:
  explicit RollingSpeed(const Scene& scene) : exact_(to_eigen(scene.bodies.at(1).v_WBcm) * 5 / 7) {}

  void tick(const Observation& now) override { v_ = to_eigen(now.states[1].v_WBcm); }
  double error() const override { return (v_ - exact_).norm() / exact_.norm(); }

 private:
  Vector exact_, v_ = Vector::Zero();
};

/// The same sphere: when it stops to slip against 2 v0 / (7 mu g), relative. The slip falls on a
/// straight line: the end is where the line through its last two values above a hundredth of v0
/// meets zero, which does not depend on the tick.
class EndOfSlip final : public Measure {
 public:
  explicit EndOfSlip(const Scene& scene) {
    const BodySpec& sphere = scene.bodies.at(1);
    v0_ = to_eigen(sphere.v_WBcm).norm();
    radius_ = sphere.shape.radius_m();
    exact_s_ =
        2 * v0_ /
        (7 * friction_between(scene.bodies[0], sphere) * to_eigen(scene.settings.gravity_W).norm());
  }

  void tick(const Observation& now) override {
    const BodyState& s = now.states[1];
    const Vector arm{0, 0, -radius_};
    const double slip = (to_eigen(s.v_WBcm) + to_eigen(s.w_WB).cross(arm)).head<2>().norm();
    if (slip < v0_ / 100) return;
    before_ = last_;
    last_ = {now.time_s, slip};
  }
  double error() const override {
    const double slope = (last_.slip - before_.slip) / (last_.time_s - before_.time_s);
    return std::abs(last_.time_s - last_.slip / slope - exact_s_) / exact_s_;
  }

 private:
  struct Sample {
    double time_s = 0, slip = 0;
  };
  double v0_ = 0, radius_ = 0, exact_s_ = 0;
  Sample before_, last_;
};

/// What slides on a slope, remembered.
class OnSlope : public Measure {
 public:
  void tick(const Observation& now) override {
    x_.push_back(to_eigen(now.states[1].p_WBo));
    time_s_.push_back(now.time_s);
  }

 protected:
  std::vector<Vector> x_;
  std::vector<double> time_s_;
};

/// The speed that a box which must rest has over the second half of the run, m/s.
class Creep final : public OnSlope {
 public:
  double error() const override {
    const std::size_t end = x_.size() - 1, middle = end / 2;
    return (x_[end] - x_[middle]).norm() / (time_s_[end] - time_s_[middle]);
  }
};

/// The acceleration of a box that slides down, by the second difference of three poses a third of
/// the run apart, against g (sin - mu cos) downhill; as vectors, relative.
class AccelerationOnSlope final : public OnSlope {
 public:
  explicit AccelerationOnSlope(const Scene& scene) {
    const Vector g = to_eigen(scene.settings.gravity_W);
    const Vector n = to_eigen(scene.bodies.at(0).q_WB).normalized() * Vector::UnitZ();
    const Vector along = g - n * n.dot(g);
    const double mu = friction_between(scene.bodies[0], scene.bodies.at(1));
    exact_ = along - mu * std::abs(n.dot(g)) * along.normalized();
  }

  double error() const override {
    const std::size_t end = x_.size() - 1, k = x_.size() / 3;
    const double span_s = (time_s_[end] - time_s_[end - 2 * k]) / 2;
    const Vector a = (x_[end] - 2 * x_[end - k] + x_[end - 2 * k]) / (span_s * span_s);
    return (a - exact_).norm() / exact_.norm();
  }

 private:
  Vector exact_;
};

}  // namespace

std::unique_ptr<Measure> stopping_distance(const Scene& scene) {
  return std::make_unique<StoppingDistance>(scene);
}
std::unique_ptr<Measure> rolling_speed(const Scene& scene) {
  return std::make_unique<RollingSpeed>(scene);
}
std::unique_ptr<Measure> end_of_slip(const Scene& scene) {
  return std::make_unique<EndOfSlip>(scene);
}
std::unique_ptr<Measure> creep_on_slope(const Scene&) { return std::make_unique<Creep>(); }
std::unique_ptr<Measure> acceleration_on_slope(const Scene& scene) {
  return std::make_unique<AccelerationOnSlope>(scene);
}

}  // namespace cradle::bench
