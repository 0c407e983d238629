// What manifolds of capsules, cylinders, cones, ellipsoids and hulls look like.
#include "tests/unit/collision_pairs.h"

using namespace cradle;

namespace {

constexpr double kHalfTurn = 3.14159265358979323846;

Matrix turn(double angle, const Vector& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}
Pose at(double x, double y, double z, const Matrix& R = Matrix::Identity()) {
  return {{x, y, z}, R};
}

/// From x to z: what stood upright lies along x.
const Matrix kLying = turn(kHalfTurn / 2, Vector::UnitY());
const Solid kFloor = Shape::half_space();
const Solid kTable = Shape::box({2, 2, 0.5});

Solid hull_cube() {
  std::vector<Vector> corners;
  for (int k = 0; k < 8; ++k)
    corners.emplace_back(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
  return Solid(make_hull(corners).geometry);
}

/// The shape in that pose on the floor, and on a table whose top is at the same height: both must
/// give `count` points of depth 1 mm whose normal is down, and that span `extent` in x and in y.
void check_rest(const Solid& solid, double height, const Matrix& R, int count, double extent_x,
                double extent_y) {
  const Pose X = at(0.1, -0.2, height - 1e-3, R);
  for (const Pair& pair : {Pair{solid, kFloor, X, {}}, Pair{solid, kTable, X, at(0, 0, -0.5)}}) {
    CAPTURE(word_of(solid.shape.kind), word_of(pair.B.shape.kind));
    const Manifold manifold = pair.collide(0.02);
    REQUIRE(manifold.count == count);
    CHECK((manifold.normal_W - Vector(0, 0, -1)).norm() < 1e-12);
    Vector lower = manifold.points[0].p_W, upper = lower;
    for (const ContactPoint& point : points(manifold)) {
      CHECK(point.separation == Approx(-1e-3).epsilon(1e-9));
      CHECK(point.p_W.z() == Approx(-0.5e-3).epsilon(1e-6));
      lower = lower.cwiseMin(point.p_W);
      upper = upper.cwiseMax(point.p_W);
    }
    CHECK(upper.x() - lower.x() == Approx(extent_x).margin(1e-9));
    CHECK(upper.y() - lower.y() == Approx(extent_y).margin(1e-9));
    CHECK(0.5 * (upper.x() + lower.x()) == Approx(0.1).margin(extent_x / 2 + 1e-9));
  }
}

}  // namespace

TEST_CASE("shapes at rest have all the points they stand on") {
  check_rest(Shape::capsule(0.2, 0.4), 0.2, kLying, 2, 0.8, 0);
  check_rest(Shape::capsule(0.2, 0.4), 0.6, Matrix::Identity(), 1, 0, 0);
  check_rest(Shape::cylinder(0.3, 0.4), 0.4, Matrix::Identity(), 4, 0.6, 0.6);
  check_rest(Shape::cylinder(0.3, 0.4), 0.3, kLying, 2, 0.8, 0);
  check_rest(Shape::cone(0.3, 0.4), 0.4, Matrix::Identity(), 4, 0.6, 0.6);
  const double slope = std::atan2(0.3, 0.8);
  check_rest(Shape::cone(0.3, 0.4), 0.15 * std::cos(slope),
             turn(kHalfTurn / 2 + slope, Vector::UnitY()), 2, std::hypot(0.3, 0.8), 0);
  check_rest(Shape::ellipsoid({0.3, 0.2, 0.1}), 0.1, Matrix::Identity(), 1, 0, 0);
  check_rest(Shape::ellipsoid({0.3, 0.2, 0.1}), 0.3, kLying, 1, 0, 0);
  check_rest(hull_cube(), 0.5, Matrix::Identity(), 4, 1, 1);
  check_rest(hull_cube(), std::sqrt(0.5), turn(kHalfTurn / 4, Vector::UnitY()), 2, 0, 1);
}

TEST_CASE("faces that meet give their exact normal, at any depth and turn") {
  Random random;
  for (const double depth : {1e-3, 1e-6, 1e-9, 1e-12, 0.0, -1e-9, -1e-3}) {
    for (const Solid& upper :
         {Solid(Shape::cylinder(0.3, 0.4)), Solid(Shape::cone(0.3, 0.4)), hull_cube()}) {
      for (const Solid& lower : {kTable, Solid(Shape::cylinder(1, 0.5)), hull_cube()}) {
        CAPTURE(depth, word_of(upper.shape.kind), word_of(lower.shape.kind));
        const Pose both{random.vector(10), random.rotation()};
        const double height = upper.shape.kind == ShapeKind::hull ? 0.5 : 0.4;
        const Pose X_B{both.x + both.R * Vector(0.1, 0.15, 0.5 + height - depth),
                       both.R * turn(random.uniform(0, 6), Vector::UnitZ())};
        const Manifold manifold = Pair{lower, upper, both, X_B}.collide(0.02);
        REQUIRE(manifold.count == 4);
        CHECK((manifold.normal_W - both.R.col(2)).norm() < 1e-12);
        CHECK(std::abs(deepest(manifold) - depth) < 1e-13);
      }
    }
  }
}

TEST_CASE("capsules: side by side two points, crossed one, ends on the true distance") {
  const Solid capsule = Shape::capsule(0.2, 0.5);
  const Manifold beside = Pair{capsule, capsule, {}, at(0.39, 0, 0.25)}.collide(0.02);
  REQUIRE(beside.count == 2);
  CHECK(beside.normal_W == Vector(1, 0, 0));
  CHECK(std::abs(beside.points[0].p_W.z() - beside.points[1].p_W.z()) == Approx(0.75));
  CHECK(beside.points[0].separation == Approx(-0.01));
  CHECK(beside.points[1].separation == Approx(-0.01));

  const Manifold crossed =
      Pair{capsule, capsule, {}, at(0.39, 0.1, 0.2, turn(1, Vector::UnitX()))}.collide(0.02);
  REQUIRE(crossed.count == 1);
  CHECK((crossed.normal_W - Vector(1, 0, 0)).norm() < 1e-12);

  // Half a degree across: the middle is deepest, the ends are as far as their balls.
  const double angle = 0.5 * kHalfTurn / 180;
  const Manifold nearly =
      Pair{capsule, capsule, {}, at(0.39, 0, 0, turn(angle, Vector::UnitX()))}.collide(0.02);
  REQUIRE(nearly.count == 3);
  CHECK(deepest(nearly) == Approx(0.01));
  const double beside_m = 0.5 * std::sin(angle);
  CHECK(nearly.points[0].separation == Approx(std::hypot(0.39, beside_m) - 0.4).margin(1e-12));
}

TEST_CASE("a flush stack of hulls and a rocking cylinder keep the names of their points") {
  Random random;
  const Solid cube = hull_cube();
  const auto stack = [&](const Vector& x, const Vector& w) {
    return Pair{cube, cube, {}, {x, turn(w.norm(), w)}}.collide(0.02);
  };
  const auto still = features(stack({0, 0, 1}, {0, 0, 1e-12}));
  CHECK(still.size() == 4);
  for (int k = 0; k < 300; ++k) {
    const Vector x = Vector(0, 0, 1) + random.vector(4e-4), w = random.vector(2e-4);
    REQUIRE(features(stack(x, w)) == still);
  }
  const Solid drum = Shape::cylinder(0.3, 0.2);
  std::set<std::set<std::uint32_t>> seen;
  for (int k = 0; k < 300; ++k) {
    const Vector w = random.vector(1e-3);
    const Manifold manifold =
        Pair{drum, kFloor, at(0, 0, 0.2, turn(w.norm(), w)), {}}.collide(0.02);
    REQUIRE(manifold.count == 4);
    seen.insert(features(manifold));
  }
  CHECK(seen.size() == 1);
}

TEST_CASE("shapes without their geometry touch nothing") {
  const Solid ball = Shape::sphere(1);
  for (const ShapeKind kind :
       {ShapeKind::hull, ShapeKind::mesh, ShapeKind::compound, ShapeKind::height_field}) {
    CHECK(Pair{Shape::stored(kind, 1), ball, {}, {}}.collide(1).count == 0);
    CHECK(Pair{ball, Shape::stored(kind, 1), {}, {}}.collide(1).count == 0);
    CHECK(can_collide(kind));
  }
}
