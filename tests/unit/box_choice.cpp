// Which four of eight points stand for a face of two boxes: those of the last time, while they can.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "server/collision/box_batch.h"
#include "server/collision/machine_lanes.h"

using namespace cradle;

namespace {

const Shape kCube = Shape::box({0.5, 0.5, 0.5});

struct Last final : MadeManifolds {
  void take(std::size_t, const Manifold& made) override { manifold = made; }
  Manifold manifold;
};

Manifold meet(const Pose& X_WB, std::uint64_t choice, int lanes) {
  static const Pose kFloor;
  Last last;
  BoxBatch batch(last, lanes);
  batch.add(0, {kCube, kFloor}, {kCube, X_WB}, 0.005, 0, choice);
  batch.finish();
  return last.manifold;
}

std::set<std::uint32_t> features(const Manifold& manifold) {
  std::set<std::uint32_t> all;
  for (int k = 0; k < manifold.count; ++k) {
    all.insert(manifold.points[static_cast<std::size_t>(k)].feature);
  }
  return all;
}

double deepest(const Manifold& manifold) {
  double least = 1;
  for (int k = 0; k < manifold.count; ++k) {
    least = std::min(least, manifold.points[static_cast<std::size_t>(k)].separation);
  }
  return least;
}

/// A cube on another, turned so that eight points meet, and leaning by up to `lean` rad.
Pose swaying(std::mt19937_64& random, double lean) {
  std::uniform_real_distribution<double> tilt(-lean, lean);
  const Rotation q = Eigen::AngleAxisd(tilt(random), Vector::UnitX()) *
                     Eigen::AngleAxisd(tilt(random), Vector::UnitY()) *
                     Eigen::AngleAxisd(0.7, Vector::UnitZ());
  return {{0.01, 0.02, 0.9998}, q.toRotationMatrix()};
}

}  // namespace

TEST_CASE("what sways on eight points keeps the four that it had, and its depth") {
  for (const int lanes : machine_lanes()) {
    CAPTURE(lanes);
    std::mt19937_64 random(1);
    int changes = 0, changes_without = 0;
    Manifold last, last_without;
    for (int k = 0; k < 300; ++k) {
      const Pose X_WB = swaying(random, 2e-4);
      const Manifold now = meet(X_WB, last.choice, lanes), without = meet(X_WB, 0, lanes);
      REQUIRE(now.count == 4);
      CHECK(std::abs(deepest(now) - deepest(without)) < 1e-12);
      changes += k > 0 && features(now) != features(last) ? 1 : 0;
      changes_without += k > 0 && features(without) != features(last_without) ? 1 : 0;
      last = now;
      last_without = without;
    }
    CHECK(changes == 0);
    CHECK(changes_without > 100);
  }
}

TEST_CASE(
    "another four are chosen where one of the others is deeper by far, or the faces are others") {
  const Pose level{{0.01, 0.02, 0.9998},
                   Eigen::AngleAxisd(0.7, Vector::UnitZ()).toRotationMatrix()};
  const Manifold first = meet(level, 0, 0);
  int changes = 0;
  for (int k = 0; k < 16; ++k) {  // by 8 mm over a face of 1 m
    const double way = 0.4 * k;
    const Vector axis(std::cos(way), std::sin(way), 0);
    const Rotation q = Eigen::AngleAxisd(8e-3, axis) * Eigen::AngleAxisd(0.7, Vector::UnitZ());
    const Manifold now = meet({level.x, q.toRotationMatrix()}, first.choice, 0);
    const Manifold without = meet({level.x, q.toRotationMatrix()}, 0, 0);
    CHECK(std::abs(deepest(now) - deepest(without)) < 1e-12);
    changes += features(now) != features(first) ? 1 : 0;
  }
  CHECK(changes >= 8);
  // The lower side of a cube that has been turned over is another face.
  const Pose over{
      level.x, level.R * Eigen::AngleAxisd(std::numbers::pi, Vector::UnitX()).toRotationMatrix()};
  CHECK(features(meet(over, first.choice, 0)) == features(meet(over, 0, 0)));
}
