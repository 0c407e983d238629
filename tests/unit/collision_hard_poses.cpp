// Poses that defeat careless code: faces that kiss, shapes within each other, far from the origin,
// plates, needles, a grain on a floor of 20 km; and poses that are no numbers.
#include "tests/unit/collision_pairs.h"
#include "tests/unit/overlap_by_search.h"
#include "tests/unit/trials.h"

using namespace cradle;

namespace {

/// Points are as deep as the shapes are along the normal, those of boxes but for what reaches
/// beyond the sides of a face; and where there are none, the shapes are farther apart than the
/// margin.
void check_found(const Pair& pair, const Manifold& manifold, double margin) {
  if (manifold.count > 0) {
    const double beside = pair.is_boxes() ? kTolerances.clip_slack_m : 0;
    REQUIRE(deepest(manifold) >= overlap(pair, manifold.normal_W) - beside - 1e-8);
  } else if (pair.A.shape.kind != pair.B.shape.kind || !pair.has(ShapeKind::half_space)) {
    REQUIRE(are_apart(pair, margin - 1e-6));
  }
}

}  // namespace

TEST_CASE("hard poses give sound manifolds") {
  const double quarter = std::atan(1.0);
  const std::vector<Matrix> turns = {
      Matrix::Identity(),
      Eigen::AngleAxisd(1e-9, Vector::UnitX()).toRotationMatrix(),
      Eigen::AngleAxisd(1e-4, Vector(1, 1, 0).normalized()).toRotationMatrix(),
      Eigen::AngleAxisd(quarter, Vector::UnitZ()).toRotationMatrix(),
      Eigen::AngleAxisd(quarter, Vector::UnitX()).toRotationMatrix(),
      Eigen::AngleAxisd(2 * quarter, Vector::UnitY()).toRotationMatrix(),
      Eigen::AngleAxisd(std::acos(1 / std::sqrt(3.0)), Vector(1, -1, 0).normalized())
          .toRotationMatrix(),
  };
  const std::vector<Solid> shapes = {
      Shape::sphere(0.5),
      Shape::sphere(1e-4),
      Shape::box({0.5, 0.5, 0.5}),
      Shape::box({5, 5, 5e-4}),
      Shape::box({1e-3, 1e-3, 5}),
      Shape::box({1e-4, 1e-4, 1e-4}),
      Shape::box({1e4, 1e4, 1}),
      Shape::half_space(),
      Shape::capsule(0.5, 0.5),
      Shape::capsule(1e-4, 1),
      Shape::cylinder(0.5, 0.5),
      Shape::cylinder(1e-4, 1e-4),
      Shape::cylinder(5, 5e-4),
      Shape::cone(0.5, 0.5),
      Shape::cone(1e-3, 1),
      Shape::ellipsoid({0.5, 0.5, 0.5}),
      Shape::ellipsoid({1e-3, 0.5, 1}),
      hull_of_box({0.5, 0.5, 0.5}),
      hull_of_box({5, 5, 5e-4}),
  };
  const std::vector<Vector> offsets = {{0, 0, 0},         {0, 0, 1e-300},  {0, 0, 1},
                                       {0, 0, 1 - 1e-12}, {1, 1, 0},       {1, 1, 1},
                                       {0.5, 0, 0.999},   {0, 0, 0.5005},  {0.25, 0.25, 1.0001},
                                       {0, 1, 1 + 1e-15}, {1, 0, 1 - 1e-9}};
  const std::vector<Vector> places = {{0, 0, 0}, {1e5, -1e5, 1e5}};
  // Of so many poses one: a number prime to those of turns, offsets and places.
  const std::size_t stride = trials(10) == 10 ? 1 : 9;
  std::size_t contacts = 0, pose = 0;
  for (const Solid& A : shapes) {
    for (const Solid& B : shapes) {
      for (const Matrix& turn : turns) {
        for (const Vector& offset : offsets) {
          for (const Vector& place : places) {
            const Matrix& both = turns[pose % turns.size()];
            if (pose++ % stride != 0) continue;
            const Pair pair{A, B, {place, both}, {place + both * offset, both * turn}};
            CAPTURE(word_of(A.shape.kind), word_of(B.shape.kind), A.shape.parameters,
                    B.shape.parameters, turn, offset, place, both);
            const Manifold manifold = pair.collide(0.02);
            check_sound(pair, manifold, 0.02, 1e-8, kTolerances.clip_slack_m);
            contacts += manifold.count > 0;
            check_found(pair, manifold, 0.02);
          }
        }
      }
    }
  }
  CHECK(contacts > 10000 / stride);
}

TEST_CASE("poses that are not finite give no contact") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  Random random;
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    const Pair good{random.solid(kind_A), random.solid(kind_B), {}, {}};
    REQUIRE(good.collide(0.02).count > 0);
    for (const Vector& x : {Vector(nan, nan, nan), Vector(infinity, infinity, infinity)}) {
      Pair bad = good;
      bad.X_WA.x = x;
      CHECK(bad.collide(0.02).count == 0);
      CHECK(bad.swapped().collide(0.02).count == 0);
    }
    Pair bad = good;
    bad.X_WA.R.setConstant(nan);
    if (kind_A != ShapeKind::sphere) CHECK(bad.collide(0.02).count == 0);
  }
}
