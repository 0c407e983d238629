// Which four of eight points stand for a face of two boxes: those of the last time, while they can.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "server/collision/box_batch.h"
#include "server/collision/machine_lanes.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/collision_support.h"

using namespace cradle;

namespace {

struct Last final : MadeManifolds {
  Manifold& room(std::size_t) override { return manifold; }
  void take(std::size_t, const Manifold& made) override { manifold = made; }
  Manifold manifold;
};

Manifold meet_floor(const Pose& X_WB, std::uint64_t choice, int lanes) {
  static const Pose kFloorPose;
  Last last;
  BoxBatch batch(last, lanes);
  batch.add(0, {kCube, kFloorPose}, {kCube, X_WB}, 0.005, 0, choice);
  batch.finish();
  return last.manifold;
}

double lowest_separation(const Manifold& manifold) {
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
      const Manifold now = meet_floor(X_WB, last.choice, lanes),
                     without = meet_floor(X_WB, 0, lanes);
      REQUIRE(now.count == 4);
      CHECK(std::abs(lowest_separation(now) - lowest_separation(without)) < 1e-12);
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
  const Manifold first = meet_floor(level, 0, 0);
  int changes = 0;
  for (int k = 0; k < 16; ++k) {  // by 8 mm over a face of 1 m
    const double way = 0.4 * k;
    const Vector axis(std::cos(way), std::sin(way), 0);
    const Rotation q = Eigen::AngleAxisd(8e-3, axis) * Eigen::AngleAxisd(0.7, Vector::UnitZ());
    const Manifold now = meet_floor({level.x, q.toRotationMatrix()}, first.choice, 0);
    const Manifold without = meet_floor({level.x, q.toRotationMatrix()}, 0, 0);
    CHECK(std::abs(lowest_separation(now) - lowest_separation(without)) < 1e-12);
    changes += features(now) != features(first) ? 1 : 0;
  }
  CHECK(changes >= 8);
  // The lower side of a cube that has been turned over is another face.
  const Pose over{
      level.x, level.R * Eigen::AngleAxisd(std::numbers::pi, Vector::UnitX()).toRotationMatrix()};
  CHECK(features(meet_floor(over, first.choice, 0)) == features(meet_floor(over, 0, 0)));
}

TEST_CASE("boxes that met by edges stay with them while these overlap by less than the slack") {
  // Two cubes of a heap that changed in every tick between edges, which part them by 0.29 mm or
  // overlap by 0.15 mm, and a face 1.4 mm deep, which pushed them apart again.
  Matrix R_A, R_B;
  R_A << -0.847102962, -0.482427633, -0.222890448, -0.498431077, 0.866735557, 0.018328549,
      0.184344878, 0.126621694, -0.974671182;
  R_B << 0.783666085, 0.614778292, -0.088966959, -0.279101096, 0.220524730, -0.934596930,
      -0.554950490, 0.757242693, 0.344403046;
  const Pose A{{-1.488459252, -0.120395329, 1.953689025}, R_A};
  const Pose B{{-2.098558642, 0.883830170, 2.313001022}, R_B};
  const auto at = [&](double up, std::uint64_t choice, int lanes) {
    Last last;
    BoxBatch batch(last, lanes);
    Pose moved = B;
    moved.x += up * Vector(-0.4800, 0.8665, 0.1373);  // along the edges' normal
    batch.add(0, {kCube, A}, {kCube, moved}, 0.005, 0, choice);
    batch.finish();
    return last.manifold;
  };
  for (const int lanes : machine_lanes()) {
    CAPTURE(lanes);
    const Manifold apart = at(4.4e-4, 0, lanes);
    REQUIRE(apart.count > 0);
    CHECK(apart.points[0].separation == Approx(0.29e-3).margin(2e-6));
    const Manifold met = at(0, apart.choice, lanes);
    CHECK(met.points[0].separation == Approx(-0.15e-3).margin(1e-6));
    CHECK(met.points[0].feature == apart.points[0].feature);
    CHECK(met.choice == apart.choice);
    CHECK(lowest_separation(at(0, 0, lanes)) == Approx(-1.44e-3).margin(1e-5));
    CHECK(at(-1.5e-3, apart.choice, lanes).points[0].feature ==
          at(-1.5e-3, 0, lanes).points[0].feature);
  }
}

TEST_CASE("a point's separation does not jump where another becomes the deepest") {
  // A cube's lowest corner, 0.6 mm deep, reaches 2 cm beside another's upper face, whose side cuts
  // two of its edges 0.2 mm deep. As it rolls, each of them becomes the deepest over the face.
  for (const int lanes : machine_lanes()) {
    CAPTURE(lanes);
    constexpr double kTilt = 0.03, kStep = 1e-5, kBeside = 0.02;
    const double centre = 0.5 + kBeside - std::sqrt(0.5);
    Manifold last;
    double jump = 0, deepest_of_all = 0;
    for (int k = -10; k <= 10; ++k) {
      const Rotation q = Eigen::AngleAxisd(kStep * k, Vector::UnitX()) *
                         Eigen::AngleAxisd(kTilt, Vector::UnitY()) *
                         Eigen::AngleAxisd(std::numbers::pi / 4, Vector::UnitZ());
      const Pose X{{centre, 0, 1 - 2e-4 + kTilt * (0.5 - centre)}, q.toRotationMatrix()};
      const Manifold now = meet_floor(X, last.choice, lanes);
      REQUIRE(now.count >= 2);
      deepest_of_all = std::min(deepest_of_all, lowest_separation(now));
      for (int i = 0; i < now.count; ++i) {
        for (int j = 0; j < last.count; ++j) {
          const ContactPoint &p = now.points[static_cast<std::size_t>(i)],
                             &before = last.points[static_cast<std::size_t>(j)];
          if (p.feature == before.feature) {
            jump = std::max(jump, std::abs(p.separation - before.separation));
          }
        }
      }
      last = now;
    }
    CHECK(deepest_of_all < -5e-4);  // of what is beside
    CHECK(jump < 2e-5);
  }
}
