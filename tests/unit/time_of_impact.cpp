// The time of impact against samples of the true motion: poses by Eigen's angle and axis, distances
// certified by support functions, neither of which the search uses.
#include "server/collision/time_of_impact.h"

#include <catch2/catch.hpp>
#include <numbers>

#include "server/collision/extents.h"
#include "server/collision/pair_functions.h"
#include "server/collision/turn.h"
#include "tests/unit/collision_pairs.h"

namespace cradle {
namespace {

/// A pair of shapes and their ways.
struct Ways {
  Pair start;
  Path A, B;

  TimeOfImpact find() const {
    const Collider a{start.A.shape, start.X_WA, start.A.geometry.get()};
    const Collider b{start.B.shape, start.X_WB, start.B.geometry.get()};
    return time_of_impact({a, A}, {b, B});
  }
  ImpactLengths lengths() const {
    return impact_lengths(thickness({start.A.shape, start.X_WA, start.A.geometry.get()}),
                          thickness({start.B.shape, start.X_WB, start.B.geometry.get()}));
  }
  Pair at(double time) const {
    return {start.A, start.B, pose(A, start.X_WA, time), pose(B, start.X_WB, time)};
  }

  static Pose pose(const Path& path, const Pose& X, double time) {
    const double t = std::min(time, path.until);
    const double angle = path.turn.norm();
    Matrix R = Matrix::Identity();
    if (angle > 0) R = Eigen::AngleAxisd(t * angle, path.turn / angle).toRotationMatrix();
    return {path.x + t * path.travel + R * (X.x - path.x), R * X.R};
  }
};

/// Signed distance, up to the quality of the normal: never more than the true one.
double distance_of(const Pair& pair) {
  if (pair.A.shape.kind == ShapeKind::half_space) return -overlap(pair, pair.X_WA.R.col(2));
  if (pair.B.shape.kind == ShapeKind::half_space) return -overlap(pair, -pair.X_WB.R.col(2));
  const Manifold manifold = convex_convex({pair.A.shape, pair.X_WA, pair.A.geometry.get()},
                                          {pair.B.shape, pair.X_WB, pair.B.geometry.get()}, 1e3);
  REQUIRE(manifold.count > 0);
  return -overlap(pair, manifold.normal_W);
}

/// Apart at first, towards each other or past, with up to 2.5 turns.
Ways random_ways(Random& random, ShapeKind kind_A, ShapeKind kind_B) {
  Ways ways{random.pair(kind_A, kind_B, 0), {}, {}};
  const Vector n = kind_B == ShapeKind::half_space   ? Vector(-ways.start.X_WB.R.col(2))
                   : kind_A == ShapeKind::half_space ? Vector(ways.start.X_WA.R.col(2))
                                                     : random.direction();
  ways.start.X_WB.x = ways.start.X_WA.x + random.vector(1);
  ways.start.X_WB.x += n * (overlap(ways.start, n) + random.uniform(0.01, 3));
  const auto move = [&](Path& path, const Solid& solid, const Pose& X, const Vector& way) {
    path.travel = random.uniform(0, 4) * way + random.vector(1);
    path.turn = random.uniform(0, 1) < 0.2 ? Vector(Vector::Zero())
                                           : Vector(random.uniform(0, 16) * random.direction());
    path.x = X.x;
    if (solid.shape.kind == ShapeKind::half_space) {
      path.turn = Vector::Zero();
    } else if (random.uniform(0, 1) < 0.3) {
      path.x += random.vector(0.5);  // of a part beside the centre
    }
    if (random.uniform(0, 1) < 0.2) path.until = random.uniform(0, 1);
  };
  move(ways.A, ways.start.A, ways.start.X_WA, n);
  move(ways.B, ways.start.B, ways.start.X_WB, -n);
  return ways;
}

constexpr double kRounding_m = 1e-7;  // of the directions of closest points, over several metres

}  // namespace

TEST_CASE("before the time of impact the shapes are apart, at it they are at the gap") {
  Random random(41);
  int hits = 0, misses = 0, capped = 0, iterations = 0, count = 0;
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    for (int k = 0; k < 60; ++k) {
      const Ways ways = random_ways(random, kind_A, kind_B);
      const TimeOfImpact found = ways.find();
      const auto [gap, tolerance, deeper, deepest] = ways.lengths();
      CAPTURE(kind_A, kind_B, k, found.time, found.iterations, gap);
      ++count;
      iterations += found.iterations;
      hits += found.kind == TimeOfImpact::Kind::hit;
      misses += found.kind == TimeOfImpact::Kind::none;
      capped += found.kind == TimeOfImpact::Kind::capped;
      if (found.began_touching) continue;
      for (int sample = 0; sample < 60; ++sample) {
        const double time = found.time * (sample + random.uniform(0, 1)) / 60;
        CAPTURE(time);
        REQUIRE(distance_of(ways.at(time)) > gap - kRounding_m);
      }
      if (found.kind != TimeOfImpact::Kind::hit) continue;
      const Pair there = ways.at(found.time);
      REQUIRE(std::abs(-overlap(there, found.normal_W) - found.separation) < 1e-9);
      REQUIRE(distance_of(there) <= gap + tolerance + kRounding_m);
    }
  }
  CHECK(hits > count / 4);
  CHECK(misses > count / 4);
  CHECK(capped <= count / 1000);
  CHECK(iterations < 12 * count);
}

TEST_CASE("times of impact in closed form") {
  // A ball of 5 cm against the face of a wall: one look, and one at the goal.
  const Shape ball = Shape::sphere(0.05), wall = Shape::box({0.01, 2, 2});
  const Pose at_wall, at_ball{{-5, 0.3, 0.1}, Matrix::Identity()};
  Path flight{at_ball.x, {10, 0, 0}, {0, 0, 500}}, rest;
  const ImpactLengths lengths = impact_lengths(0.05, 0.01);
  const TimeOfImpact hit = time_of_impact({{ball, at_ball}, flight}, {{wall, at_wall}, rest});
  REQUIRE(hit.kind == TimeOfImpact::Kind::hit);
  CHECK(hit.time == Approx((5 - 0.06 - lengths.gap) / 10).margin(1e-12));
  CHECK(hit.iterations == 2);
  // It stops before.
  flight.until = 0.4;
  CHECK(time_of_impact({{ball, at_ball}, flight}, {{wall, at_wall}, rest}).kind ==
        TimeOfImpact::Kind::none);

  // A capsule of half length 1 turns three and a quarter times about z, from along y to along x,
  // and would miss a plane at x = 1.01 by 5 mm, or meet one at 0.905 for the first time when its
  // end's sphere does: cos(a) = 0.9.
  const Shape rod = Shape::capsule(0.005, 1), plane = Shape::half_space();
  Pose along_y;
  along_y.R.col(2) = Vector::UnitY();
  along_y.R.col(0) = Vector::UnitX();
  along_y.R.col(1) = along_y.R.col(2).cross(along_y.R.col(0));
  const Path spin{{0, 0, 0}, {0, 0, 0}, {0, 0, 6.5 * std::numbers::pi}};
  Pose facing;
  facing.R.col(2) = -Vector::UnitX();
  facing.R.col(0) = Vector::UnitY();
  facing.R.col(1) = facing.R.col(2).cross(facing.R.col(0));
  facing.x = {1.01, 0, 0};
  const TimeOfImpact miss = time_of_impact({{rod, along_y}, spin}, {{plane, facing}, rest});
  CHECK(miss.kind == TimeOfImpact::Kind::none);
  CHECK(miss.iterations < 80);  // of seven near misses; by the first bound alone more than 1000
  facing.x = {0.905, 0, 0};
  const TimeOfImpact met = time_of_impact({{rod, along_y}, spin}, {{plane, facing}, rest});
  REQUIRE(met.kind == TimeOfImpact::Kind::hit);
  const double quarter = std::numbers::pi / 2 - std::acos(0.9);  // of the turn before it touches
  CHECK(met.time == Approx(quarter / (6.5 * std::numbers::pi)).margin(2e-5));
}

TEST_CASE("what touches is let slide, and stopped when it goes deeper") {
  const Shape ball = Shape::sphere(0.05), wall = Shape::box({0.01, 2, 2});
  const Pose at_wall, at_ball{{-0.0599, 0, 0}, Matrix::Identity()};  // 0.1 mm deep
  const Path rest;
  const auto find = [&](const Vector& travel) {
    const Path path{at_ball.x, travel, {0, 0, 3}};
    return time_of_impact({{ball, at_ball}, path}, {{wall, at_wall}, rest});
  };
  CHECK(find({0, 1.5, 0.2}).kind == TimeOfImpact::Kind::none);
  CHECK(find({-3, 0, 0}).kind == TimeOfImpact::Kind::none);
  const TimeOfImpact through = find({1, 0, 0});
  REQUIRE(through.kind == TimeOfImpact::Kind::hit);
  CHECK(through.began_touching);
  const ImpactLengths lengths = impact_lengths(0.05, 0.01);
  CHECK(through.separation <= -1e-4 - lengths.deeper + lengths.tolerance);
  CHECK(through.time <= lengths.deeper + 1e-12);
}

TEST_CASE("what is deep already is let in no deeper than half the thickness, or by a gap") {
  const Shape ball = Shape::sphere(0.05), wall = Shape::box({0.01, 2, 2});
  const Pose at_wall;
  const Path rest;
  const ImpactLengths lengths = impact_lengths(0.05, 0.01);
  CHECK(lengths.deepest == 0.5 * 0.01);
  for (const double overlap : {0.001, 0.002, 0.003, 0.004, 0.0049, 0.006, 0.008}) {
    const Pose at_ball{{-0.06 + overlap, 0, 0}, Matrix::Identity()};
    const Path path{at_ball.x, {1, 0, 0}, {0, 0, 0}};
    const TimeOfImpact found = time_of_impact({{ball, at_ball}, path}, {{wall, at_wall}, rest});
    const double most =
        std::max(std::min(overlap + lengths.deeper, lengths.deepest), overlap + lengths.gap);
    CAPTURE(overlap, most);
    REQUIRE(found.kind == TimeOfImpact::Kind::hit);
    CHECK(-found.separation <= most + 1e-12);
    CHECK(-found.separation >= most - lengths.tolerance - 1e-12);
  }
}

TEST_CASE("a search that ends early is told, and has seen no hit before") {
  // A needle that spins a thousand times, 0.6 mm from a floor with its ends.
  const Shape rod = Shape::cylinder(0.005, 1), plane = Shape::half_space();
  Pose at;
  at.x = {0, 0, std::hypot(1, 0.005) + 6e-4};
  const Path spin{at.x, {0, 0, 0}, {6283, 0, 0}}, rest;
  const Pose floor;
  const TimeOfImpact found = time_of_impact({{rod, at}, spin}, {{plane, floor}, rest});
  CHECK(found.kind == TimeOfImpact::Kind::capped);
  CHECK(found.time < 1);
  CHECK(found.time > 0);
}

}  // namespace cradle
