// Errors of bodies that bounce: the heights they reach, the energy they keep.
#include <cmath>
#include <vector>

#include "tests/bench/conservation.h"
#include "tests/bench/measure.h"

namespace cradle::bench {
namespace {

enum class ApexBy { poses, energy };

/// Worst of five apexes of a sphere on a level floor at z = 0, relative: apex k is e^2k times the
/// height it was dropped from. By poses the highest one published, by energy z + v_z^2 / 2g of it.
/// An apex that never came is a height of zero.
class ApexError final : public Measure {
 public:
  ApexError(const Scene& scene, ApexBy by) : by_(by), body_(dynamic_bodies(scene).at(0)) {
    const BodySpec& sphere = scene.bodies[body_];
    g_ = -scene.settings.gravity_W.z;
    radius_ = sphere.shape.radius_m();
    ratio_ = sphere.material.restitution * sphere.material.restitution;
    drop_ = last_ = before_ = sphere.p_WBo.z - radius_;
    last_height_ = drop_;
  }

  void tick(const Observation& now) override {
    const BodyState& state = now.states[body_];
    const double z = state.p_WBo.z - radius_;
    if (before_ < last_ && last_ >= z) apexes_.push_back(last_height_);
    before_ = last_;
    last_ = z;
    const double v = state.v_WBcm.z;
    last_height_ = by_ == ApexBy::poses ? z : z + v * v / (2 * g_);
    if (z != z) apexes_.assign(kApexes, z);
  }

  double error() const override {
    double error = 0;
    double exact = drop_;
    for (std::size_t k = 0; k < kApexes; ++k) {
      exact *= ratio_;
      error = worse(error, std::abs((k < apexes_.size() ? apexes_[k] : 0) - exact) / exact);
    }
    return error;
  }

 private:
  static constexpr std::size_t kApexes = 5;
  ApexBy by_;
  std::size_t body_;
  double g_, radius_, ratio_, drop_;
  double before_, last_, last_height_;  // of the last two ticks
  std::vector<double> apexes_;
};

/// Largest relative change of the kinetic energy.
class DriftOfKineticEnergy final : public Measure {
 public:
  explicit DriftOfKineticEnergy(const Scene& scene)
      : scene_(scene), start_J_(budget_at_start(scene).kinetic_J()) {}

  void tick(const Observation& now) override {
    const double change_J = budget(scene_, now.states).kinetic_J() - start_J_;
    error_ = worse(error_, std::abs(change_J) / start_J_);
  }
  double error() const override { return error_; }

 private:
  const Scene& scene_;
  double start_J_;
  double error_ = 0;
};

}  // namespace

std::unique_ptr<Measure> apexes_by_poses(const Scene& scene) {
  return std::make_unique<ApexError>(scene, ApexBy::poses);
}
std::unique_ptr<Measure> apexes_by_energy(const Scene& scene) {
  return std::make_unique<ApexError>(scene, ApexBy::energy);
}
std::unique_ptr<Measure> drift_of_kinetic_energy(const Scene& scene) {
  return std::make_unique<DriftOfKineticEnergy>(scene);
}

}  // namespace cradle::bench
