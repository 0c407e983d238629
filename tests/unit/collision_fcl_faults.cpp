// What FCL 0.7 was measured to do wrong, or to die of, as tests of ours. Each is named after FCL's
// fault; its figures are from random poses of unit sized shapes unless they say otherwise.
#include <thread>

#include "server/collision/bounds.h"
#include "tests/unit/collision_verdicts.h"

using namespace cradle;

namespace {

constexpr double kHalfTurn = 3.14159265358979323846;

const Solid kBox = Shape::box({0.5, 0.5, 0.5});
const Solid kCylinder = Shape::cylinder(0.5, 0.5);
const Solid kCapsule = Shape::capsule(0.3, 0.5);

Solid hull_box() {
  std::vector<Vector> corners;
  for (int k = 0; k < 8; ++k)
    corners.emplace_back(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
  return Solid(make_hull(corners).geometry);
}
const Solid kHullBox = hull_box();

/// B upright on A, whose tops and bottoms are at `height` from their middles; turned together.
Pair standing(const Solid& A, const Solid& B, double height, double depth, Random& random) {
  const Pose all{random.vector(5), random.rotation()};
  const Vector above(0.1, 0.05, 2 * height - depth);
  const Matrix turn = Eigen::AngleAxisd(random.uniform(0, 6), Vector::UnitZ()).matrix();
  return {A, B, all, {all.x + all.R * above, all.R * turn}};
}

/// One of them into the other by `depth` along the best direction.
Pair sunk(const Solid& A, const Solid& B, double depth, Random& random) {
  Pair pair{A, B, {random.vector(3), random.rotation()}, {random.vector(3), random.rotation()}};
  pair.X_WB.x = pair.X_WA.x + 4 * random.direction();
  const Vector n = bench::parting(pair).n;
  pair.X_WB.x += n * (overlap(pair, n) - depth);
  return pair;
}

double angle_between(const Vector& a, const Vector& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

TEST_CASE("FCL turned the normals of a third of all capsule pairs by 13 degrees and more") {
  Random random(71);
  for (const double depth : {1e-4, 1e-3, 0.02}) {
    for (int trial = 0; trial < 500; ++trial) {
      CAPTURE(depth, trial);
      const Pair pair = sunk(kCapsule, kCapsule, depth, random);
      const Manifold manifold = pair.collide(0.02);
      REQUIRE(deepest(manifold) == Approx(depth).margin(1e-9));
      REQUIRE(angle_between(manifold.normal_W, bench::parting(pair).n) < 1e-4);
    }
  }
}

TEST_CASE("FCL gave a body that rests on a plane or face one point") {
  Random random(72);
  for (const Solid& upper : {kBox, kCylinder, kHullBox}) {
    for (const Solid& lower : {kBox, kCylinder, kHullBox}) {
      CHECK(standing(lower, upper, 0.5, 1e-4, random).collide(0.02).count == 4);
    }
    const Pair on_plane{Shape::half_space(), upper, {}, {{0, 0, 0.4999}, Matrix::Identity()}};
    CHECK(on_plane.collide(0.02).count == 4);
  }
  const Matrix lying = Eigen::AngleAxisd(kHalfTurn / 2, Vector::UnitY()).matrix();
  CHECK(Pair{Shape::half_space(), kCapsule, {}, {{0, 0, 0.2999}, lying}}.collide(0.02).count == 2);
}

TEST_CASE("FCL gave faces that just touch a zero normal, threw, or aborted") {
  // Zero or random normals at depth 0 in 20 of 30; signed distance: exceptions in 1 % of the poses
  // from 1e-9 to 1e-14, "assert" and the end of the program at 0.
  Random random(73);
  for (const double depth : {1e-3, 1e-6, 1e-9, 1e-12, 1e-14, 0.0, -1e-14, -1e-12, -1e-9}) {
    for (const Solid& A : {kBox, kCylinder, kHullBox}) {
      for (const Solid& B : {kBox, kCylinder, kHullBox}) {
        for (int trial = 0; trial < 50; ++trial) {
          CAPTURE(depth, trial, word_of(A.shape.kind), word_of(B.shape.kind));
          const Pair pair = standing(A, B, 0.5, depth, random);
          const Manifold manifold = pair.collide(0.02);
          REQUIRE(manifold.count >= 3);
          REQUIRE((manifold.normal_W - pair.X_WA.R.col(2)).norm() < 1e-12);
          REQUIRE(std::abs(deepest(manifold) - depth) < 1e-13);
        }
      }
    }
  }
}

TEST_CASE("FCL crashed on the distance of anything to a half-space") {
  Random random(74);
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    if (kind_B != ShapeKind::half_space) continue;
    for (int trial = 0; trial < 200; ++trial) {
      Pair pair = random.pair(kind_A, kind_B);
      const Vector n = -pair.X_WB.R.col(2);
      const double gap = random.uniform(0, 0.019);
      pair.X_WB.x += n * (overlap(pair, n) + gap);
      REQUIRE(deepest(pair.collide(0.02)) == Approx(-gap).margin(1e-12));
      REQUIRE(deepest(pair.swapped().collide(0.02)) == Approx(-gap).margin(1e-12));
    }
  }
}

TEST_CASE("FCL missed a sixth of all cones in half-spaces and was wrong about another third") {
  Random random(75);
  for (int trial = 0; trial < 2000; ++trial) {
    const Pair pair = random.pair(ShapeKind::cone, ShapeKind::half_space);
    const Manifold manifold = pair.collide(0.02);
    REQUIRE(manifold.count > 0);
    REQUIRE((manifold.normal_W + pair.X_WB.R.col(2)).norm() < 1e-12);
    REQUIRE(deepest(manifold) == Approx(overlap(pair, manifold.normal_W)).margin(1e-12));
  }
}

TEST_CASE("FCL gave bodies with one centre a zero normal, or 1.73 m of depth for 1") {
  for (const Solid& A : {Solid(Shape::sphere(0.5)), kBox, kCylinder, kHullBox, kCapsule}) {
    for (const Solid& B : {Solid(Shape::sphere(0.5)), kBox, kCylinder, kHullBox, kCapsule}) {
      CAPTURE(word_of(A.shape.kind), word_of(B.shape.kind));
      const Pair pair{A, B, {{1, 2, 3}, Matrix::Identity()}, {{1, 2, 3}, Matrix::Identity()}};
      const Manifold manifold = pair.collide(0.02);
      REQUIRE(manifold.count > 0);
      CHECK(manifold.normal_W.norm() == Approx(1).margin(1e-12));
      CHECK(overlap(pair, manifold.normal_W) < bench::parting(pair).overlap + 1e-6);
      CHECK(deepest(manifold) == Approx(overlap(pair, manifold.normal_W)).margin(1e-9));
    }
  }
}

TEST_CASE("FCL lost 70 % of the depth of a grain, since its tolerance is absolute") {
  Random random(76);
  const Solid grain = Shape::cylinder(1e-4, 1e-4);
  for (int trial = 0; trial < 200; ++trial) {
    Pair pair = standing(kBox, grain, 0.5, 0, random);
    pair.X_WB.x = pair.X_WA.x + pair.X_WA.R * Vector(0.1, 0.2, 0.5 + 1e-4 - 1e-6);
    const Manifold manifold = pair.collide(1e-5);
    REQUIRE(manifold.count >= 3);
    REQUIRE(deepest(manifold) == Approx(1e-6).epsilon(1e-6));
  }
}

TEST_CASE("FCL turned the normal of a cylinder that leans by 1e-4 by 7 degrees") {
  Random random(77);
  for (const Solid& upper : {kCylinder, kHullBox, kBox}) {
    for (int trial = 0; trial < 300; ++trial) {
      CAPTURE(trial, word_of(upper.shape.kind));
      Pair pair = standing(kBox, upper, 0.5, 1e-3, random);
      const Vector axis = pair.X_WA.R * Vector{random.uniform(-1, 1), random.uniform(-1, 1), 0.0};
      pair.X_WB.R = Eigen::AngleAxisd(1e-4, axis.normalized()) * pair.X_WB.R;
      const Manifold manifold = pair.collide(0.02);
      REQUIRE(manifold.count == 4);
      REQUIRE(angle_between(manifold.normal_W, pair.X_WA.R.col(2)) < 1.1e-4);
      REQUIRE(deepest(manifold) <= overlap(pair, manifold.normal_W) + 1e-12);
    }
  }
}

TEST_CASE("FCL was 0.2 mm off on a floor of 20 km in single precision") {
  const Solid floor = Shape::box({1e4, 1e4, 0.5});
  Random random(78);
  for (const Solid& B : {kBox, kCylinder, kHullBox}) {
    for (int trial = 0; trial < 100; ++trial) {
      Pair pair{floor, B, {}, {{random.uniform(-9e3, 9e3), random.uniform(-9e3, 9e3), 0.999}, {}}};
      pair.X_WB.R = Eigen::AngleAxisd(random.uniform(0, 6), Vector::UnitZ()).matrix();
      const Manifold manifold = pair.collide(0.02);
      REQUIRE(manifold.count >= 3);
      REQUIRE((manifold.normal_W - Vector::UnitZ()).norm() < 1e-12);
      REQUIRE(deepest(manifold) == Approx(1e-3).margin(1e-11));
    }
  }
}

TEST_CASE("FCL was off by 1e-6 on a plate of 1 mm") {
  const Solid plate = Shape::box({5, 5, 5e-4});
  Random random(79);
  for (const Solid& B : {kBox, kCylinder, kHullBox}) {
    for (int trial = 0; trial < 100; ++trial) {
      Pair pair = standing(plate, B, 0.5, 0, random);
      pair.X_WB.x = pair.X_WA.x + pair.X_WA.R * Vector(1, 2, 0.5 + 5e-4 - 1e-4);
      const Manifold manifold = pair.collide(0.02);
      REQUIRE((manifold.normal_W - pair.X_WA.R.col(2)).norm() < 1e-9);
      REQUIRE(deepest(manifold) == Approx(1e-4).margin(1e-12));
    }
  }
}

TEST_CASE("FCL turned the normals of boxes deep in each other by 33 to 87 degrees") {
  // And was off by up to 0.26 m. Ours may take another minimum than the best, a worse one by
  // little.
  Random random(80);
  int trials = 0, best = 0;
  for (const double share : {0.1, 0.25, 0.45}) {
    for (int trial = 0; trial < 200; ++trial) {
      const Pair pair = sunk(kHullBox, kHullBox, share, random);
      const Manifold manifold = pair.collide(0.02);
      const double along_normal = overlap(pair, manifold.normal_W);
      REQUIRE(deepest(manifold) == Approx(along_normal).margin(1e-9));
      const double least = least_overlap_of_polytopes(pair);
      REQUIRE(along_normal < least + 0.15);
      ++trials;
      best += along_normal < least + 1e-6;
    }
  }
  CHECK(best > trials * 3 / 4);
}

TEST_CASE(
    "FCL gave, by its other solver, normals in the frame of the first body, and negative depths") {
  Random random(81);
  for (const Solid& A : {kCapsule, kHullBox, kCylinder}) {
    for (int trial = 0; trial < 200; ++trial) {
      const Pair pair = sunk(A, kHullBox, 0.01, random);
      const Manifold manifold = pair.collide(0.02);
      REQUIRE(deepest(manifold) > 0);
      // From A to B in W: B moved that way is free, the other way deeper.
      const double here = overlap(pair, manifold.normal_W);
      Pair moved = pair;
      moved.X_WB.x += manifold.normal_W * (here + 1e-6);
      REQUIRE(bench::parting(moved).overlap < 0);
    }
  }
}

TEST_CASE("FCL put the point of a sphere on a capsule outside of both") {
  Random random(82);
  for (int trial = 0; trial < 500; ++trial) {
    const double depth = random.uniform(1e-4, 0.02);
    const Pair pair = sunk(Shape::sphere(0.4), kCapsule, depth, random);
    const Manifold manifold = pair.collide(0.02);
    REQUIRE(manifold.count == 1);
    const Vector& p = manifold.points[0].p_W;
    REQUIRE(outside(pair.A, pair.X_WA, p) == Approx(-depth / 2).margin(1e-9));
    REQUIRE(outside(pair.B, pair.X_WB, p) == Approx(-depth / 2).margin(1e-9));
  }
}

TEST_CASE("FCL gave other depths when the bodies were exchanged") {
  Random random(83);
  for (const Solid& A : {kCapsule, kCylinder, Solid(Shape::cone(0.5, 0.5))}) {
    for (int trial = 0; trial < 200; ++trial) {
      const Pair pair = sunk(A, kCylinder, 0.01, random);
      const double depth = deepest(pair.collide(0.02));
      REQUIRE(deepest(pair.swapped().collide(0.02)) == Approx(depth).margin(1e-9));
    }
  }
}

TEST_CASE("FCL put a box of 8.5 times its volume around a turned rod") {
  const Solid rod = Shape::box({2, 0.1, 0.1});
  Random random(84);
  for (int trial = 0; trial < 100; ++trial) {
    const Pose X{random.vector(3), random.rotation()};
    const Aabb box = bounds(rod.shape, X);
    for (int k = 0; k < 3; ++k) {
      CHECK(box.upper[k] == Approx(support(rod, X, Vector::Unit(k))).margin(1e-9));
      CHECK(-box.lower[k] == Approx(support(rod, X, -Vector::Unit(k))).margin(1e-9));
    }
  }
}

TEST_CASE("FCL wrote into geometry that threads share") {
  Random random(85);
  std::vector<Pair> pairs;
  for (const auto& [A, B] : colliding_kinds()) {
    for (int k = 0; k < 20; ++k) pairs.push_back(random.pair(A, B));
  }
  const auto depths = [&] {
    std::vector<double> found;
    for (const Pair& pair : pairs) found.push_back(deepest(pair.collide(0.02)));
    return found;
  };
  const std::vector<double> alone = depths();
  std::array<std::vector<double>, 4> together;
  std::vector<std::thread> threads;
  for (auto& one : together) threads.emplace_back([&] { one = depths(); });
  for (std::thread& thread : threads) thread.join();
  for (const auto& one : together) CHECK(one == alone);
}
