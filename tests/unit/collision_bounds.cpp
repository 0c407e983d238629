#include <catch2/catch.hpp>
#include <cmath>

#include "server/collision/bounds.h"
#include "tests/unit/collision_pairs.h"

using namespace cradle;

namespace {

const double kNoBound = std::numeric_limits<double>::quiet_NaN();

Pose turned_about_z(double angle, const Vector& x) {
  return {x, Eigen::AngleAxisd(angle, Vector::UnitZ()).toRotationMatrix()};
}

}  // namespace

TEST_CASE("the box of a sphere is a cube about it") {
  const Aabb box = bounds(Shape::sphere(2), turned_about_z(0.3, {1, 2, 3}));
  CHECK(box.lower == Vector(-1, 0, 1));
  CHECK(box.upper == Vector(3, 4, 5));
}

TEST_CASE("the box of a turned box is tight") {
  const Pose X_WB = turned_about_z(0.5, {5, 0, 0});
  const Aabb box = bounds(Shape::box({1, 2, 3}), X_WB);
  Aabb corners;
  for (int k = 0; k < 8; ++k) {
    const Vector r_B(k & 1 ? 1 : -1, k & 2 ? 2 : -2, k & 4 ? 3 : -3);
    const Vector p_W = X_WB.x + X_WB.R * r_B;
    corners.lower = corners.lower.cwiseMin(p_W);
    corners.upper = corners.upper.cwiseMax(p_W);
  }
  CHECK((box.lower - corners.lower).norm() < 1e-14);
  CHECK((box.upper - corners.upper).norm() < 1e-14);
}

TEST_CASE("the box of every shape is as large as its support in each direction says") {
  Random random;
  for (int kind = 1; kind <= static_cast<int>(ShapeKind::hull); ++kind) {
    if (static_cast<ShapeKind>(kind) == ShapeKind::half_space) continue;
    for (int trial = 0; trial < 200; ++trial) {
      const Solid solid = random.solid(static_cast<ShapeKind>(kind));
      const Pose X_WB{random.vector(10), random.rotation()};
      const Aabb box = bounds({solid.shape, X_WB, solid.geometry.get()});
      for (int axis = 0; axis < 3; ++axis) {
        CAPTURE(word_of(solid.shape.kind), trial, axis);
        REQUIRE(std::abs(box.upper[axis] - support(solid, X_WB, Vector::Unit(axis))) < 1e-14);
        REQUIRE(std::abs(box.lower[axis] + support(solid, X_WB, -Vector::Unit(axis))) < 1e-14);
      }
    }
  }
}

TEST_CASE("nothing and half-spaces have empty boxes, swept or not") {
  for (const Shape& shape : {Shape::none(), Shape::half_space()}) {
    const Aabb box = bounds(shape, {});
    CHECK(box.is_empty());
    CHECK(swept(box, {1, 1, 1}, 100).is_empty());
  }
}

TEST_CASE("a swept box holds the box before and after the motion, grown by the margin") {
  const Aabb box = swept({{0, 0, 0}, {1, 1, 1}}, {2, -3, 0}, 0.1);
  CHECK((box.lower - Vector(-0.1, -3.1, -0.1)).norm() < 1e-15);
  CHECK((box.upper - Vector(3.1, 1.1, 1.1)).norm() < 1e-15);
}

TEST_CASE("the bounding radius reaches the farthest point of the shape") {
  CHECK(bounding_radius(Shape::none()) == 0);
  CHECK(bounding_radius(Shape::sphere(2)) == 2);
  CHECK(bounding_radius(Shape::box({2, 3, 6})) == Approx(7));
  CHECK(std::isinf(bounding_radius(Shape::half_space())));
}

TEST_CASE("a box with a NaN is empty") {
  Aabb box{{0, 0, 0}, {1, 1, 1}};
  CHECK_FALSE(box.is_empty());
  box.upper.y() = kNoBound;
  CHECK(box.is_empty());
}
