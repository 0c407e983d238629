// Shapes whose axes are along or across each other, exactly or but for rounding: what people build,
// and random attitudes never are. There normals of edges are noise, and ellipses lines.
#include <numbers>

#include "server/collision/planar_pairs.h"
#include "tests/bench/parting.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/trials.h"

using namespace cradle;

namespace {

/// One of the 24 that take axes to axes.
Matrix axes_to_axes(Random& random) {
  Matrix R = Matrix::Zero();
  const int x = static_cast<int>(random.uniform(0, 2.999));
  const int y = (x + 1 + static_cast<int>(random.uniform(0, 1.999))) % 3;
  R(x, 0) = random.uniform(-1, 1) < 0 ? -1 : 1;
  R(y, 1) = random.uniform(-1, 1) < 0 ? -1 : 1;
  R.col(2) = R.col(0).cross(R.col(1));
  return R;
}

/// Near each other's surfaces: from 2 cm apart to 5 % of a width deep. Both may be turned alike, by
/// which what is aligned is so but for rounding.
Pair aligned(Random& random, ShapeKind kind_A, ShapeKind kind_B) {
  Pair pair = random.pair(kind_A, kind_B);
  pair.X_WA = {Vector::Zero(), Matrix::Identity()};
  pair.X_WB.R = axes_to_axes(random);
  const Vector n = random.direction();
  const double thickness = overlap({pair.A, pair.B, {}, {}}, Vector::UnitZ());
  pair.X_WB.x = random.vector(0.5);
  pair.X_WB.x += n * (overlap(pair, n) - random.uniform(-0.02, 0.05 * thickness));
  if (random.uniform(0, 1) < 0.5) {
    const Matrix turn = random.rotation();
    pair.X_WA.R = turn;
    pair.X_WB = {turn * pair.X_WB.x, turn * pair.X_WB.R};
  }
  return pair;
}

/// A discs' and lines' pairs by closed forms.
bool is_closed(const Pair& pair) {
  const auto has_axis = [](const Solid& solid) {
    using enum ShapeKind;
    const ShapeKind kind = solid.shape.kind;
    return kind == box || kind == capsule || kind == cylinder;
  };
  return has_axis(pair.A) && has_axis(pair.B);
}

}  // namespace

TEST_CASE("where axes are along or across each other no direction overlaps less, either") {
  Random random(31);
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    CAPTURE(word_of(kind_A), word_of(kind_B));
    const int all = trials(400);
    int contacts = 0, other = 0;
    for (int trial = 0; trial < all; ++trial) {
      CAPTURE(trial);
      const Pair pair = aligned(random, kind_A, kind_B);
      if (pair.has(ShapeKind::half_space) || pair.is_boxes()) break;  // boxes prefer faces
      const Manifold manifold = pair.collide(0.02);
      if (manifold.count == 0) continue;
      ++contacts;
      const double along_normal = overlap(pair, manifold.normal_W);
      REQUIRE(std::abs(deepest(manifold) - along_normal) < kExact);
      const double excess = along_normal - bench::parting(pair).overlap;
      const bool is_exact = is_closed(pair) && kind_A != kind_B;
      if (is_exact) REQUIRE(excess < kExact);
      other += excess >= kExact;
      REQUIRE(excess < 0.05 * std::abs(along_normal) + 1e-7);
    }
    CAPTURE(other, contacts);
    CHECK(other <= contacts / 100);
  }
}

TEST_CASE("what just touches along one axis is told to be apart where a rim's direction parts it") {
  // Sizes and places in quarters of a metre: many overlaps are zero.
  Random random(32);
  const auto quarters = [&random](int least, int most) {
    return 0.25 * std::floor(random.uniform(least, most + 0.999));
  };
  int touching = 0;
  for (int trial = 0; trial < trials(40000); ++trial) {
    Pair pair{Shape::cylinder(quarters(1, 4), quarters(1, 4)),
              Shape::cylinder(quarters(1, 4), quarters(1, 4)),
              {},
              {}};
    if (trial % 2 == 0) pair.A = Shape::box({quarters(1, 4), quarters(1, 4), quarters(1, 4)});
    pair.X_WB = {{quarters(-8, 8), quarters(-8, 8), quarters(-8, 8)}, axes_to_axes(random)};
    if (trial % 4 < 2) {
      const Matrix turn = random.rotation();
      pair.X_WA.R = turn;
      pair.X_WB = {turn * pair.X_WB.x, turn * pair.X_WB.R};
    }
    const Manifold manifold = pair.collide(0.02);
    const double along_normal = overlap(pair, manifold.normal_W);
    if (manifold.count == 0 || std::abs(along_normal) > kExact) continue;
    ++touching;
    CAPTURE(trial);
    REQUIRE(along_normal < bench::parting(pair).overlap + 1e-6);
  }
  CHECK(touching > trials(1000));
}

TEST_CASE("rims that mirror each other overlap least to either side of the mirror") {
  // The search begins on the ridge between two minima, in the mirror's plane.
  struct Mirrored {
    double half_length_A, half_length_B;
    Vector x_B;
  };
  const auto [half_length_A, half_length_B, x_B] =
      GENERATE(Mirrored{0.75, 1, {0.75, 1.75, 1.5}}, Mirrored{0.75, 0.25, {-0.75, 1, 1.5}},
               Mirrored{1, 0.75, {-1, 1, 1.25}}, Mirrored{0.25, 0.25, {0.75, -1, 1}});
  const Matrix across =
      Eigen::AngleAxisd(-std::numbers::pi / 2, Vector::UnitX()).toRotationMatrix();
  Random random(8);
  for (int k = 0; k < 20; ++k) {
    const Matrix R = k == 0 ? Matrix(Matrix::Identity()) : random.rotation();
    const Vector off = k < 2 ? Vector(Vector::Zero()) : random.vector(1e-9);
    const Pair pair{Shape::cylinder(1, half_length_A),
                    Shape::cylinder(1, half_length_B),
                    {Vector::Zero(), R},
                    {R * (x_B + off), R * across}};
    CAPTURE(k, x_B.transpose());
    REQUIRE(overlap(pair, pair.collide(0.02).normal_W) < bench::parting(pair).overlap + 1e-6);
  }
}

TEST_CASE("in the plane what lies on a capsule's axis beyond its end is as far as it is") {
  Random random(33);
  const Shape long_one = Shape::capsule(0.2, 0.5);
  const auto [other, reach] =
      GENERATE(std::pair{Shape::sphere(0.1), 0.1}, std::pair{Shape::capsule(0.1, 0.3), 0.4});
  for (int trial = 0; trial < 1000; ++trial) {
    const double angle = random.uniform(-4, 4), gap = random.uniform(-0.29, 0.02);
    const bool is_swapped = trial % 2 == 0;
    Pose X_WA{{1, 2, 0}, Matrix(Eigen::AngleAxisd(angle, Vector::UnitZ()))};
    const Vector axis = (trial % 4 < 2 ? -1 : 1) * X_WA.R.col(0);
    const Pose X_WB{X_WA.x + (0.7 + reach + gap) * axis, X_WA.R};
    const Collider A{long_one, X_WA, nullptr}, B{other, X_WB, nullptr};
    const Manifold m = is_swapped ? collide_in_plane(B, A, 0.02) : collide_in_plane(A, B, 0.02);
    CAPTURE(angle, gap, is_swapped);
    REQUIRE(m.count > 0);
    CHECK(std::abs(deepest(m) + gap) < kExact);
    CHECK((m.normal_W - (is_swapped ? -1 : 1) * axis).norm() < 1e-9);
  }
}
