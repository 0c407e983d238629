// The errors of SimBenchmark (github.com/leggedrobotics/SimBenchmark): means over time of squares.
#include <cmath>

#include "tests/bench/conservation.h"
#include "tests/bench/measure.h"

namespace cradle::bench {
namespace {

class MeanSquare : public Measure {
 public:
  void tick(const Observation& now) final {
    sum_ += square(now);
    ++ticks_;
  }
  double error() const final { return sum_ / static_cast<double>(ticks_); }

 protected:
  virtual double square(const Observation& now) = 0;

 private:
  double sum_ = 0;
  std::int64_t ticks_ = 0;
};

/// A box, the scene's second body, that a force pushes over the ground, its first, from under equal
/// spheres: the velocities of the box and of the first sphere against those of sliding below and
/// rolling above, (m/s)^2.
class PushedFromUnder final : public MeanSquare {
 public:
  explicit PushedFromUnder(const Scene& scene) {
    const BodySpec &ground = scene.bodies.at(0), &box = scene.bodies.at(1),
                   &ball = scene.bodies.at(2);
    const double n = static_cast<double>(scene.bodies.size() - 2);
    const Vector force = to_eigen(scene.wrenches.at(0).wrench.value);
    const double mu = std::sqrt(ground.material.friction * box.material.friction);
    const double weight = (box.mass_kg + n * ball.mass_kg) * -scene.settings.gravity_W.z;
    const double rest = force.norm() - mu * weight;  // what friction below leaves
    // A ball rolls under a force f at its foot with a_foot = 7/2 f/m.
    const double f = rest / box.mass_kg / (3.5 / ball.mass_kg + n / box.mass_kg);
    const Vector along = force.normalized();
    box_mps2_ = (rest - n * f) / box.mass_kg * along;
    ball_mps2_ = f / ball.mass_kg * along;
  }

 private:
  double square(const Observation& now) override {
    const Vector box = to_eigen(now.states[1].v_WBcm) - now.time_s * box_mps2_;
    const Vector ball = to_eigen(now.states[2].v_WBcm) - now.time_s * ball_mps2_;
    return box.squaredNorm() + ball.squaredNorm();
  }
  Vector box_mps2_, ball_mps2_;
};

/// The change of the energy, J^2.
class EnergyChange final : public MeanSquare {
 public:
  explicit EnergyChange(const Scene& scene)
      : scene_(scene), start_J_(budget_at_start(scene).energy_J()) {}

 private:
  double square(const Observation& now) override {
    const double change_J = budget(scene_, now.states).energy_J() - start_J_;
    return change_J * change_J;
  }
  const Scene& scene_;
  double start_J_;
};

/// Of all overlaps together, m^2.
class Overlaps final : public MeanSquare {
  double square(const Observation& now) override { return now.penetration.squares_m2; }
};

}  // namespace

std::unique_ptr<Measure> pushed_from_under(const Scene& scene) {
  return std::make_unique<PushedFromUnder>(scene);
}
std::unique_ptr<Measure> mean_square_energy_change(const Scene& scene) {
  return std::make_unique<EnergyChange>(scene);
}
std::unique_ptr<Measure> mean_square_overlap(const Scene&) { return std::make_unique<Overlaps>(); }

}  // namespace cradle::bench
