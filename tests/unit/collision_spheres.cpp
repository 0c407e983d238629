// Spheres against everything: each expectation is worked out by hand.
#include <catch2/catch.hpp>
#include <cmath>

#include "server/collision/narrow_phase.h"
#include "tests/bench/poses.h"

using namespace cradle;

namespace {

constexpr double kFar = 1000;  // m, a margin that lets all contacts through

void check_point(const Manifold& manifold, const Vector& n_W, double separation,
                 const Vector& p_W) {
  REQUIRE(manifold.count == 1);
  CHECK((manifold.normal_W - n_W).norm() < 1e-14);
  CHECK(manifold.points[0].separation == Approx(separation).margin(1e-14));
  CHECK((manifold.points[0].p_W - p_W).norm() < 1e-13);
}

}  // namespace

TEST_CASE("two spheres that overlap meet midway between their surfaces") {
  const Manifold manifold =
      collide(Shape::sphere(2), at(1, 0, 0), Shape::sphere(3), at(1, 4, 0), 0);
  check_point(manifold, Vector::UnitY(), -1, {1, 1.5, 0});
}

TEST_CASE("two spheres apart are exact up to any margin") {
  const Shape small = Shape::sphere(0.5), large = Shape::sphere(10);
  const Manifold manifold = collide(small, at(0, 0, 0), large, at(300, 0, 400), 489.5);
  check_point(manifold, {0.6, 0, 0.8}, 489.5, Vector(0.6, 0, 0.8) * (0.5 + 489.5 / 2));
  CHECK(collide(small, at(0, 0, 0), large, at(300, 0, 400), 489.4999).count == 0);
}

TEST_CASE("two spheres with one centre get a fixed normal") {
  const Shape one = Shape::sphere(1), two = Shape::sphere(2);
  for (const double off : {0.0, 1e-300, 1e-160, 1e-13}) {
    const Manifold manifold = collide(one, at(5, 5, 5), two, at(5, 5 + off, 5), 0);
    check_point(manifold, Vector::UnitZ(), -3, {5, 5, 4.5});
  }
  const Manifold manifold = collide(one, at(0, 0, 0), two, at(0, 1e-11, 0), 0);
  CHECK((manifold.normal_W - Vector::UnitY()).norm() < 1e-14);
}

TEST_CASE("a sphere over a face, an edge and a corner of a box is as far as its closest point") {
  const Shape box = Shape::box({1, 2, 3}), ball = Shape::sphere(1);
  const Pose X_WB = at(0, 0, 0);
  check_point(collide(ball, at(0.5, 0.5, 5), box, X_WB, kFar), -Vector::UnitZ(), 1,
              {0.5, 0.5, 3.5});
  check_point(collide(ball, at(0, 2 + 3, 3 + 4), box, X_WB, kFar), {0, -0.6, -0.8}, 4,
              Vector(0, 2 + 0.6 * 2, 3 + 0.8 * 2));
  check_point(collide(ball, at(-3, -4, -4), box, X_WB, kFar), Vector(2, 2, 1) / 3, 2,
              Vector(-1, -2, -3) - Vector(2, 2, 1) / 3);
}

TEST_CASE("a sphere in a box leaves through the nearest face") {
  const Shape box = Shape::box({1, 2, 3}), ball = Shape::sphere(0.25);
  const Manifold manifold = collide(ball, at(0.25, 1.75, -2), box, at(0, 0, 0), 0);
  check_point(manifold, -Vector::UnitY(), -0.5, {0.25, 1.75, -2});
  CHECK(collide(ball, at(0, 0, 0), box, at(0, 0, 0), 0).points[0].separation == -1.25);
}

TEST_CASE("a sphere's depth in a box does not jump where its centre crosses the surface") {
  const Shape box = Shape::box({1, 1, 1}), ball = Shape::sphere(0.5);
  for (const double height : {1e-9, 1e-11, 1e-13, 0.0, -1e-13, -1e-11, -1e-9}) {
    const Manifold manifold = collide(ball, at(0.3, 0.2, 1 + height), box, at(0, 0, 0), 0);
    REQUIRE(manifold.count == 1);
    CHECK((manifold.normal_W + Vector::UnitZ()).norm() < 1e-14);
    CHECK(std::abs(manifold.points[0].separation - (height - 0.5)) < 1e-15);
  }
}

TEST_CASE("a box against a sphere is the sphere against the box with the normal turned") {
  const Shape box = Shape::box({1, 1, 1}), ball = Shape::sphere(1);
  check_point(collide(box, at(0, 0, 0), ball, at(0, 0, 1.5), 0), Vector::UnitZ(), -0.5,
              {0, 0, 0.75});
}

TEST_CASE("a sphere sinks into a tilted half-space along its normal, at any depth") {
  const Pose slope{{0, 0, 2},
                   Rotation(Eigen::AngleAxisd(std::acos(0.8), Vector::UnitX())).matrix()};
  const Vector up = slope.R.col(2);
  const Shape ball = Shape::sphere(0.5);
  for (const double s : {-100.0, -0.25, 0.0, 0.25, 100.0}) {
    const Pose X_WA{slope.x + slope.R * Vector(3, 4, s + 0.5), Matrix::Identity()};
    const Vector midway = slope.x + slope.R * Vector(3, 4, s / 2);
    check_point(collide(ball, X_WA, Shape::half_space(), slope, kFar), -up, s, midway);
    check_point(collide(Shape::half_space(), slope, ball, X_WA, kFar), up, s, midway);
    CHECK(collide(ball, X_WA, Shape::half_space(), slope, s - 1e-9).count == 0);
  }
}

TEST_CASE("pairs without a closed form, and kinds outside the table, give no contact") {
  Shape unknown = Shape::sphere(1);
  unknown.kind = static_cast<ShapeKind>(77);
  Shape negative = unknown;
  negative.kind = static_cast<ShapeKind>(-1);
  const Shape ball = Shape::sphere(1);
  for (const Shape& odd : {Shape::none(), unknown, negative}) {
    CHECK(collide(odd, {}, ball, {}, kFar).count == 0);
    CHECK(collide(ball, {}, odd, {}, kFar).count == 0);
  }
  CHECK(collide(Shape::half_space(), {}, Shape::half_space(), {}, kFar).count == 0);
}
