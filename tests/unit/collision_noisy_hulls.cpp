// Hulls of points as programs write them: off by some roundings, or each corner given twice.
#include <catch2/catch.hpp>

#include "server/collision/stored_geometry.h"
#include "tests/bench/random_poses.h"
#include "tests/bench/solids.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

constexpr double kTop_m = 0.3;

std::vector<Vector> corners_of_box(const Vector& half) {
  std::vector<Vector> corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back(i & 1 ? half.x() : -half.x(), i & 2 ? half.y() : -half.y(),
                         i & 4 ? half.z() : -half.z());
  }
  return corners;
}

/// With every corner moved by up to `noise`, or given once more with that.
std::vector<Vector> noisy(const std::vector<Vector>& clean, double noise, bool is_doubled,
                          RandomPoses& random) {
  std::vector<Vector> points = is_doubled ? clean : std::vector<Vector>{};
  for (const Vector& p : clean) points.push_back(p + random.vector(noise));
  return points;
}

const ConvexHull& hull_of(const GeometryPointer& geometry) {
  return std::get<ConvexHull>(geometry->value);
}

/// How deep a body that fell onto the hull is below its top, after four seconds.
double sunk(const GeometryPointer& floor, const Shape& shape, RandomPoses& random) {
  World world(settings());
  BodySpec fixed;
  fixed.kind = BodyKind::fixed;
  fixed.shape = Shape::stored(ShapeKind::hull, world.add_geometry(floor));
  add(world, fixed);
  BodySpec spec;
  spec.shape = shape;
  spec.mass_kg = 1;
  spec.q_WB = to_plain(Rotation(random.rotation()));
  spec.p_WBo = {random.uniform(-1, 1), random.uniform(-1, 1), 1.2};
  const BodyId body = add(world, spec);
  for (int i = 0; i < 240; ++i) world.step();
  const BodyState now = state(world, body);
  const Pair pair{
      Solid(floor), shape, {}, {to_eigen(now.p_WBo), to_eigen(now.q_WB).toRotationMatrix()}};
  return overlap(pair, Vector::UnitZ());
}

}  // namespace

TEST_CASE("a hull of noisy corners carries") {
  const bool is_doubled = GENERATE(true, false);
  const double noise = GENERATE(1e-14, 1e-12, 1e-9, 1e-7, 1e-5);
  CAPTURE(is_doubled, noise);
  for (const Shape& shape :
       {Shape::cylinder(0.2, 0.3), Shape::cone(0.2, 0.3), Shape::box({0.2, 0.2, 0.3})}) {
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      CAPTURE(shape.kind, seed);
      RandomPoses random(seed);
      const auto clean = corners_of_box({2, 2, kTop_m});
      const GeometryPointer floor = make_hull(noisy(clean, noise, is_doubled, random)).geometry;
      REQUIRE(floor);
      // The contact tolerance, 0.5 mm; and what the top is uneven by.
      CHECK(sunk(floor, shape, random) < 0.5e-3 + 2 * noise);
    }
  }
}

TEST_CASE("a box on the seam of two level faces has four points") {
  for (const double noise : {0.0, 1e-12, 1e-8, 1e-6}) {
    CAPTURE(noise);
    RandomPoses random(3);
    const GeometryPointer floor =
        make_hull(noisy(corners_of_box({2, 2, kTop_m}), noise, false, random)).geometry;
    REQUIRE(hull_of(floor).face_count() == (noise > 0 ? 12 : 6));
    for (int trial = 0; trial < 100; ++trial) {
      Pair pair{Solid(floor), Shape::box({0.2, 0.2, 0.1}), {}, {}};
      pair.X_WB.R = Eigen::AngleAxisd(random.uniform(0, 3), Vector::UnitZ());
      pair.X_WB.x = {random.uniform(-1, 1), random.uniform(-1, 1), kTop_m + 0.1 - 1e-3};
      const Manifold m = pair.collide(0.02);
      REQUIRE(m.count == 4);
      for (int k = 0; k < 4; ++k) {
        const ContactPoint& point = m.points[static_cast<std::size_t>(k)];
        CHECK(point.separation == Approx(-1e-3).margin(4 * noise + 1e-12));
        const Vector corner = pair.X_WB.R.transpose() * (point.p_W - pair.X_WB.x);
        CHECK(corner.head<2>().cwiseAbs().minCoeff() == Approx(0.2).margin(1e-4));
      }
    }
  }
}

TEST_CASE("corners that are one but for rounding are one") {
  const auto clean = corners_of_box({0.5, 0.3, 0.2});
  for (const double noise : {1e-15, 1e-14, 1e-12, 1e-10}) {
    RandomPoses random(1);
    const GeometryPointer hull = make_hull(noisy(clean, noise, true, random)).geometry;
    REQUIRE(hull);
    CHECK(hull_of(hull).vertices.size() == 8);
    int contacts = 0;
    for (int trial = 0; trial < 9000; ++trial) {
      const Shape other = trial % 2 ? Shape::cone(0.1, 0.08) : Shape::cylinder(0.1, 0.08);
      Pair pair{Solid(hull), other, {{0, 0, 0}, random.rotation()}, {{0, 0, 0}, random.rotation()}};
      const Vector n = random.direction();
      pair.X_WB.x = random.vector(0.3);
      pair.X_WB.x += n * (overlap(pair, n) - random.uniform(0, 0.01));
      const Manifold m = pair.collide(0.02);
      if (m.count == 0) continue;
      ++contacts;
      CHECK(overlap(pair, m.normal_W) == Approx(deepest(m)).margin(1e-9));
    }
    CHECK(contacts > 400);
  }
}

}  // namespace cradle
