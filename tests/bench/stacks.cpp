// Errors of bodies that must stay where they are: stacks, pyramids, piles.
#include "tests/bench/measure.h"

namespace cradle::bench {
namespace {

/// The largest distance of any dynamic body from where it began, over the whole run, m.
class Displacement final : public Measure {
 public:
  Displacement(const Scene& scene, const Vector& directions)
      : bodies_(dynamic_bodies(scene)), directions_(directions) {
    for (const std::size_t i : bodies_) start_.push_back(to_eigen(scene.bodies[i].p_WBo));
  }

  void tick(const Observation& now) override {
    for (std::size_t k = 0; k < bodies_.size(); ++k) {
      const Vector way = to_eigen(now.states[bodies_[k]].p_WBo) - start_[k];
      error_ = worse(error_, way.cwiseProduct(directions_).norm());
    }
  }
  double error() const override { return error_; }

 private:
  std::vector<std::size_t> bodies_;
  Vector directions_;  // one where a way counts, zero where not
  std::vector<Vector> start_;
  double error_ = 0;
};

/// The mean overlap of the pairs that overlap after the last tick, m.
class MeanPenetrationAtEnd final : public Measure {
 public:
  void tick(const Observation& now) override { last_m_ = now.penetration.mean_m; }
  double error() const override { return last_m_; }

 private:
  double last_m_ = 0;
};

}  // namespace

std::unique_ptr<Measure> displacement(const Scene& scene) {
  return std::make_unique<Displacement>(scene, Vector{1, 1, 1});
}
std::unique_ptr<Measure> horizontal_drift(const Scene& scene) {
  return std::make_unique<Displacement>(scene, Vector{1, 1, 0});
}
std::unique_ptr<Measure> mean_penetration_at_end(const Scene&) {
  return std::make_unique<MeanPenetrationAtEnd>();
}

}  // namespace cradle::bench
