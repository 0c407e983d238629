// Errors of impacts: Newton's cradle, a fast sphere against a thin wall, bodies that begin in one
// another.
#include <algorithm>

#include "tests/bench/measure.h"

namespace cradle::bench {
namespace {

/// Equal spheres on a line, touching: they must leave with the velocities of those that came, in
/// reverse order. The largest deviation of a final velocity from that, m/s.
class CradleSpeeds final : public Measure {
 public:
  explicit CradleSpeeds(const Scene& scene) {
    for (const BodySpec& body : scene.bodies) exact_.push_back(to_eigen(body.v_WBcm));
    std::reverse(exact_.begin(), exact_.end());
  }

  void tick(const Observation& now) override {
    error_ = 0;
    for (std::size_t i = 0; i < exact_.size(); ++i) {
      error_ = worse(error_, (to_eigen(now.states[i].v_WBcm) - exact_[i]).norm());
    }
  }
  double error() const override { return error_; }

 private:
  std::vector<Vector> exact_;
  double error_ = 0;
};

/// A sphere that flies along x against a wall, the scene's first body: how far beyond the wall's
/// near face its front ends, or how far it still moves in the second half of the run, whichever is
/// more, m. Zero if it was stopped on its own side.
class PassageThroughWall final : public Measure {
 public:
  explicit PassageThroughWall(const Scene& scene) {
    const BodySpec& wall = scene.bodies.at(0);
    const double near_face = wall.p_WBo.x - wall.shape.half_extents_m().x;
    farthest_ = near_face - scene.bodies.at(1).shape.radius_m();
  }

  void tick(const Observation& now) override { x_.push_back(to_eigen(now.states[1].p_WBo)); }
  double error() const override {
    const double moved = (x_.back() - x_[x_.size() / 2]).norm();
    return worse(worse(0, x_.back().x() - farthest_), moved);
  }

 private:
  double farthest_ = 0;  // x of the centre
  std::vector<Vector> x_;
};

/// The largest speed of any dynamic body, m/s.
class PartingSpeed final : public Measure {
 public:
  explicit PartingSpeed(const Scene& scene) : bodies_(dynamic_bodies(scene)) {}

  void tick(const Observation& now) override {
    for (const std::size_t i : bodies_) {
      error_ = worse(error_, to_eigen(now.states[i].v_WBcm).norm());
    }
  }
  double error() const override { return error_; }

 private:
  std::vector<std::size_t> bodies_;
  double error_ = 0;
};

}  // namespace

std::unique_ptr<Measure> cradle_speeds(const Scene& scene) {
  return std::make_unique<CradleSpeeds>(scene);
}
std::unique_ptr<Measure> passage_through_wall(const Scene& scene) {
  return std::make_unique<PassageThroughWall>(scene);
}
std::unique_ptr<Measure> parting_speed(const Scene& scene) {
  return std::make_unique<PartingSpeed>(scene);
}

}  // namespace cradle::bench
