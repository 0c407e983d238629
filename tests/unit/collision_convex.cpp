// What manifolds of capsules, cylinders, cones, ellipsoids and hulls look like.
#include "server/collision/expanding_polytope.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/made_in_order.h"

using namespace cradle;

namespace {

constexpr double kHalfTurn = 3.14159265358979323846;

/// From x to z: what stood upright lies along x.
const Matrix kLying = turn(kHalfTurn / 2, Vector::UnitY());
const Solid kGround = Shape::half_space();
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
  for (const Pair& pair : {Pair{solid, kGround, X, {}}, Pair{solid, kTable, X, at(0, 0, -0.5)}}) {
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

TEST_CASE("capsules and cylinders in poses whose contact is known") {
  Random random(3);
  const double s = std::sqrt(0.5);
  const Matrix along_y = turn(-kHalfTurn / 2, Vector::UnitX());
  const Matrix across = turn(-kHalfTurn / 4, Vector::UnitY());  // axis across (s, 0, s)
  const Solid box = Shape::box({0.5, 0.4, 0.3}), capsule = Shape::capsule(0.2, 0.4),
              rod = Shape::capsule(0.05, 0.4), drum = Shape::cylinder(0.3, 0.4);
  struct Known {
    const char* what;
    Solid A, B;
    Pose X_AB;
    Vector n;
    double separation;
    int count;
  };
  const std::vector<Known> known = {
      {"capsule on a face", box, capsule, at(0.05, 0, 0.49, kLying), {0, 0, 1}, -0.01, 2},
      {"capsule with its axis in a face", box, rod, at(0.05, 0, 0.2, kLying), {0, 0, 1}, -0.15, 2},
      {"capsule across an edge",
       box,
       capsule,
       at(0.5 + 0.19 * s, 0.1, 0.3 + 0.19 * s, across),
       {s, 0, s},
       -0.01,
       1},
      {"capsule in an edge",
       box,
       rod,
       at(0.5 - 0.1 * s, 0.1, 0.3 - 0.1 * s, across),
       {s, 0, s},
       -0.15,
       1},
      {"capsule at a corner",
       box,
       capsule,
       at(0.5 + 0.1, 0.4 + 0.1, 0.3 + 0.05 + 0.4),
       {2.0 / 3, 2.0 / 3, 1.0 / 3},
       0.15 - 0.2,
       1},
      {"capsule on a cap", drum, capsule, at(0.02, 0, 0.59, kLying), {0, 0, 1}, -0.01, 2},
      {"capsule along a side", drum, capsule, at(0.49, 0, 0.1), {1, 0, 0}, -0.01, 2},
      {"capsule across a side", drum, capsule, at(0.49, 0, 0.1, along_y), {1, 0, 0}, -0.01, 1},
      {"capsule across a rim",
       drum,
       capsule,
       at(0.3 + 0.19 * s, 0, 0.4 + 0.19 * s, across),
       {s, 0, s},
       -0.01,
       1},
      {"capsule in a rim",
       drum,
       rod,
       at(0.3 - 0.01 * s, 0, 0.4 - 0.01 * s, across),
       {s, 0, s},
       -0.06,
       1},
      {"end of a capsule in a side",
       drum,
       rod,
       at(0.6, 0.1, 0, kLying),
       {2, 1, 0},
       std::hypot(0.2, 0.1) - 0.35,
       1},
      {"other end of a capsule in a side",
       drum,
       rod,
       at(0.6, 0.1, 0, kLying.transpose()),
       {2, 1, 0},
       std::hypot(0.2, 0.1) - 0.35,
       1},
      {"cylinder upright on a face", box, drum, at(0.05, 0, 0.69), {0, 0, 1}, -0.01, 4},
      {"cylinder upright over a corner", box, drum, at(0.45, 0.35, 0.69), {0, 0, 1}, -0.01, 4},
      {"cylinder lying on a face", box, drum, at(0.05, 0, 0.59, kLying), {0, 0, 1}, -0.01, 2},
      {"box on a cap", Shape::cylinder(1, 0.4), box, at(0.1, 0, 0.69), {0, 0, 1}, -0.01, 4},
      {"side of a cylinder across an edge",
       box,
       drum,
       at(0.5 + 0.29 * s, 0.05, 0.3 + 0.29 * s, across),
       {s, 0, s},
       -0.01,
       1},
      {"side of a cylinder at a vertical edge",
       box,
       drum,
       at(0.5 + 0.174, 0.4 + 0.232, 0.1),
       {0.6, 0.8, 0},
       -0.01,
       2},
      {"cylinder on a cap", drum, drum, at(0.1, 0, 0.79), {0, 0, 1}, -0.01, 4},
      {"cylinders side by side", drum, drum, at(0.59, 0, 0.1), {1, 0, 0}, -0.01, 2},
      {"cylinders crosswise", drum, drum, at(0.59, 0.1, 0.1, along_y), {1, 0, 0}, -0.01, 1},
      {"rim at a side",
       drum,
       drum,
       at(0.3 + 0.4 * s + 0.3 * s - 0.01, 0, 0.4 * s - 0.3 * s,
          turn(kHalfTurn / 4, Vector::UnitY())),
       {1, 0, 0},
       -0.01,
       1},
      {"cylinders with one middle and axis",
       Shape::cylinder(0.2, 0.5),
       drum,
       at(0, 0, 0),
       {0, 0, 0},
       -0.5,
       0},
  };
  for (const Known& k : known) {
    CAPTURE(k.what);
    for (int trial = 0; trial < 20; ++trial) {
      const Pose both{random.vector(3), random.rotation()};
      const Pair pair{k.A, k.B, both, {both.x + both.R * k.X_AB.x, both.R * k.X_AB.R}};
      for (const bool is_swapped : {false, true}) {
        const Manifold manifold = (is_swapped ? pair.swapped() : pair).collide(0.02);
        CHECK(std::abs(-deepest(manifold) - k.separation) < 1e-12);
        if (k.n.norm() == 0) continue;
        const Vector n = both.R * k.n.normalized();
        CHECK((manifold.normal_W - (is_swapped ? Vector(-n) : n)).norm() < 1e-9);
        CHECK(manifold.count == k.count);
      }
    }
  }
}

TEST_CASE("rims that cross part in the direction across both tangents") {
  Random random(4);
  for (int trial = 0; trial < 300; ++trial) {
    CAPTURE(trial);
    // Each rim has its point at the origin; there n leads out of both.
    const auto rim_at_origin = [&](const Solid& solid, const Vector& n, Pose& X) {
      const double lean = random.uniform(0.3, 1.2);  // of the axis to n
      const Vector tangent = n.cross(random.direction()).normalized(), out = tangent.cross(n);
      const Vector axis = std::cos(lean) * n - std::sin(lean) * out;
      const Vector side = tangent.cross(axis);
      X.R.col(2) = axis;
      X.R.col(0) = n.dot(side) > 0 ? side : Vector(-side);
      X.R.col(1) = axis.cross(X.R.col(0));
      X.x = -(X.R * Vector(solid.shape.radius_m(), 0, solid.shape.half_length_m()));
      return tangent;
    };
    Pair pair{Shape::cylinder(random.uniform(0.2, 1), random.uniform(0.2, 1)),
              Shape::cylinder(random.uniform(0.2, 1), random.uniform(0.2, 1)),
              {},
              {}};
    const Vector n = random.direction();
    const Vector t_A = rim_at_origin(pair.A, n, pair.X_WA);
    const Vector t_B = rim_at_origin(pair.B, -n, pair.X_WB);
    if (t_A.cross(t_B).norm() < 0.2) continue;
    const double depth = random.uniform(-0.01, 1e-3);  // apart where negative
    pair.X_WB.x -= depth * n;
    REQUIRE(overlap(pair, n) == Approx(depth).margin(1e-12));
    const Manifold manifold = pair.collide(0.02);
    REQUIRE(manifold.count == 1);
    REQUIRE((manifold.normal_W - n).norm() < 1e-8);
    REQUIRE(std::abs(deepest(manifold) - depth) < 1e-12);
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
        Pair{drum, kGround, at(0, 0, 0.2, turn(w.norm(), w)), {}}.collide(0.02);
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

TEST_CASE(
    "capsules that lie along each other but for 1e-4 rad have two points, none of them double") {
  const Shape capsule = Shape::capsule(0.1, 0.5);
  for (const double tilt : {0.0, 1e-10, 1e-8, 1e-6, 1e-4}) {
    CAPTURE(tilt);
    const Pose X_WA, X_WB{Vector(0.2 - 1e-4, 0, 0.1),
                          Eigen::AngleAxisd(tilt, Vector::UnitY()).toRotationMatrix()};
    const Manifold manifold = collide(capsule, X_WA, capsule, X_WB, 0.02);
    REQUIRE(manifold.count == 2);
    CHECK((manifold.points[0].p_W - manifold.points[1].p_W).norm() > 0.5);
  }
}

TEST_CASE("capsules on one axis, but for its last digits, part across it") {
  const Shape capsule = Shape::capsule(0.1, 2);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    Rotation q(uniform(random), uniform(random), uniform(random), uniform(random));
    q.normalize();
    Rotation other = q;
    other.x() = std::nextafter(q.x(), 2.0);
    const Pose X_WA{Vector::Zero(), q.toRotationMatrix()},
        X_WB{Vector::Zero(), other.toRotationMatrix()};
    const Manifold manifold = collide(capsule, X_WA, capsule, X_WB, 0.02);
    REQUIRE(manifold.count > 0);
    CHECK(std::abs(manifold.normal_W.dot(X_WA.R.col(2))) < 1e-12);
    CHECK(std::abs(manifold.normal_W.dot(X_WB.R.col(2))) < 1e-12);
  }
}

TEST_CASE("hulls have the same manifolds alone and in company") {
  Random random;
  std::vector<Pair> pairs;
  int touching = 0;
  for (int k = 0; k < 3000; ++k) {
    constexpr ShapeKind kPartners[] = {ShapeKind::hull, ShapeKind::box, ShapeKind::capsule,
                                       ShapeKind::sphere, ShapeKind::hull};
    const ShapeKind partner = kPartners[k % 5];
    pairs.push_back(k % 2 == 0 ? random.pair(ShapeKind::hull, partner)
                               : random.pair(partner, ShapeKind::hull));
    if (k % 97 == 1) pairs.back().X_WB.x.y() = std::numeric_limits<double>::quiet_NaN();
    if (k % 97 == 2) pairs.back().X_WA.R(1, 2) = std::numeric_limits<double>::infinity();
  }
  const auto add = [&](Collisions& batch, std::size_t k, bool wants_lead) {
    const Pair& pair = pairs[k];
    PairHints hints;
    hints.wants_lead = wants_lead;
    batch.add(k, {pair.A.shape, pair.X_WA, pair.A.geometry.get()},
              {pair.B.shape, pair.X_WB, pair.B.geometry.get()}, 0.02, hints);
  };
  std::vector<Manifold> alone;
  for (const Pair& pair : pairs) {
    alone.push_back(pair.collide(0.02));
    touching += alone.back().count > 0;
  }
  CHECK(touching > 500);
  InOrder in_order(pairs.size());
  Collisions batch(in_order);
  for (std::size_t k = 0; k < pairs.size(); ++k) add(batch, k, true);
  batch.finish();
  CHECK(std::ranges::equal(in_order.made, alone, are_the_same));
  // Without the lead, all else is the same; and so is one by one.
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    add(batch, k, false);
    if (k % 3 == 0) batch.finish();
  }
  batch.finish();
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (in_order.made[k].count > 0) in_order.made[k].lead = alone[k].lead;
  }
  CHECK(std::ranges::equal(in_order.made, alone, are_the_same));
}

TEST_CASE("a corner that a polytope grows by keeps its name") {
  const auto named = [](const Vector& w, std::uint16_t name) {
    return Difference{w, Vector::Zero(), name};
  };
  ExpandingPolytope polytope;
  REQUIRE(polytope.begin(
      {named({-1, -1, -1}, 1), named({1, -1, -1}, 2), named({0, 1, -1}, 3), named({0, 0, 1}, 4)}));
  const int nearest = polytope.nearest(kInfinity);
  const Vector top = 3 * polytope.face(nearest).n;
  REQUIRE(polytope.expand(nearest, named(top, 5)));
  int found = 0;
  for (int face = 4; face < 7; ++face) {  // the new ones
    for (const Difference& corner : polytope.corners_of(face)) {
      CHECK((corner.w == top) == (corner.name == 5));
      found += corner.w == top ? 1 : 0;
    }
  }
  CHECK(found == 3);
}
