// What must hold for the manifold of any pair, whatever method made it. The only measure used is
// the support function: how far a shape reaches in a direction. It is exact and needs no library.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <set>
#include <span>

#include "server/collision/narrow_phase.h"
#include "server/collision/tolerances.h"

using namespace cradle;

namespace {

constexpr double kExact = 1e-9;  // m

struct Pair {
  Shape shape_A, shape_B;
  Pose X_WA, X_WB;

  Manifold collide(double margin) const {
    return cradle::collide(shape_A, X_WA, shape_B, X_WB, margin);
  }
  Pair swapped() const { return {shape_B, shape_A, X_WB, X_WA}; }
  bool is_boxes() const { return shape_A.kind == ShapeKind::box && shape_B.kind == ShapeKind::box; }
};

/// max of d . p over the shape; of a half-space only for d along its normal.
double support(const Shape& shape, const Pose& X, const Vector& d) {
  const double middle = d.dot(X.x);
  if (shape.kind == ShapeKind::sphere) return middle + shape.radius_m();
  if (shape.kind == ShapeKind::half_space) return middle;
  return middle + to_eigen(shape.half_extents_m()).dot((X.R.transpose() * d).cwiseAbs());
}

/// How far A reaches into B along n; negative: apart.
double overlap(const Pair& pair, const Vector& n) {
  return support(pair.shape_A, pair.X_WA, n) + support(pair.shape_B, pair.X_WB, -n);
}

/// How far a point is outside the shape, in the largest of box coordinates.
double outside(const Shape& shape, const Pose& X, const Vector& p_W) {
  const Vector p_B = X.R.transpose() * (p_W - X.x);
  if (shape.kind == ShapeKind::sphere) return p_B.norm() - shape.radius_m();
  if (shape.kind == ShapeKind::half_space) return p_B.z();
  return (p_B.cwiseAbs() - to_eigen(shape.half_extents_m())).maxCoeff();
}

/// Least overlap of two boxes over all 15 axes; if they are apart, minus the largest gap.
double least_overlap(const Pair& pair) {
  double least = std::numeric_limits<double>::infinity();
  const auto try_axis = [&](const Vector& axis) {
    if (axis.norm() < 1e-9) return;
    const Vector n = axis.normalized();
    least = std::min({least, overlap(pair, n), overlap(pair, -n)});
  };
  for (int i = 0; i < 3; ++i) {
    try_axis(pair.X_WA.R.col(i));
    try_axis(pair.X_WB.R.col(i));
    for (int j = 0; j < 3; ++j) try_axis(pair.X_WA.R.col(i).cross(pair.X_WB.R.col(j)));
  }
  return least;
}

std::span<const ContactPoint> points(const Manifold& manifold) {
  return std::span(manifold.points).first(static_cast<std::size_t>(manifold.count));
}

double deepest(const Manifold& manifold) {
  double depth = -std::numeric_limits<double>::infinity();
  for (const ContactPoint& point : points(manifold)) depth = std::max(depth, -point.separation);
  return depth;
}

std::set<std::uint32_t> features(const Manifold& manifold) {
  std::set<std::uint32_t> set;
  for (const ContactPoint& point : points(manifold)) set.insert(point.feature);
  return set;
}

class Random {
 public:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  Vector vector(double size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }
  Matrix rotation() {
    Rotation q;
    do q = Rotation(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    while (q.norm() > 1 || q.norm() < 0.1);
    return q.normalized().toRotationMatrix();
  }
  /// Sizes from 0.02 to 2 m, so boxes are cubes, plates and rods.
  double size() { return 0.02 * std::pow(100, uniform(0, 1)); }

  Shape shape(ShapeKind kind) {
    if (kind == ShapeKind::sphere) return Shape::sphere(size());
    if (kind == ShapeKind::box) return Shape::box({size(), size(), size()});
    return Shape::half_space();
  }

  /// Two shapes in a random pose that overlap, or nearly touch, along a random direction.
  Pair pair(ShapeKind kind_A, ShapeKind kind_B) {
    Pair pair{shape(kind_A), shape(kind_B), {vector(2), rotation()}, {{0, 0, 0}, rotation()}};
    const Vector n = kind_B == ShapeKind::half_space   ? Vector(-pair.X_WB.R.col(2))
                     : kind_A == ShapeKind::half_space ? Vector(pair.X_WA.R.col(2))
                                                       : Vector(vector(1).normalized());
    const double thickness = overlap({pair.shape_A, pair.shape_B, {}, {}}, Vector::UnitZ());
    pair.X_WB.x = pair.X_WA.x + vector(0.2 * thickness);
    const double wanted = uniform(0, 1) < 0.5 ? uniform(0, 0.02) : uniform(0, 0.5) * thickness;
    pair.X_WB.x += n * (overlap(pair, n) - wanted);
    return pair;
  }

 private:
  std::mt19937_64 engine_{11};
};

/// All ordered pairs of kinds that have a closed form.
const std::vector<std::pair<ShapeKind, ShapeKind>> kKinds = {
    {ShapeKind::sphere, ShapeKind::sphere},     {ShapeKind::sphere, ShapeKind::box},
    {ShapeKind::sphere, ShapeKind::half_space}, {ShapeKind::box, ShapeKind::sphere},
    {ShapeKind::box, ShapeKind::box},           {ShapeKind::box, ShapeKind::half_space},
    {ShapeKind::half_space, ShapeKind::sphere}, {ShapeKind::half_space, ShapeKind::box},
};

/// Calls `check(pair, manifold)` for many random pairs that meet, of every kind.
template <typename Check>
void for_random_contacts(double margin, Check check) {
  Random random;
  for (const auto& [kind_A, kind_B] : kKinds) {
    CAPTURE(static_cast<int>(kind_A), static_cast<int>(kind_B));
    int contacts = 0;
    for (int trial = 0; trial < 10000; ++trial) {
      CAPTURE(trial);
      const Pair pair = random.pair(kind_A, kind_B);
      const Manifold manifold = pair.collide(margin);
      if (manifold.count == 0) continue;
      ++contacts;
      check(pair, manifold);
    }
    CHECK(contacts > 1000);
  }
}

/// What even the hardest pose may not break.
void check_sound(const Pair& pair, const Manifold& manifold, double margin, double tolerance) {
  REQUIRE(manifold.count >= 0);
  REQUIRE(manifold.count <= kManifoldPoints);
  REQUIRE(std::abs(manifold.normal_W.norm() - 1) < 1e-12);
  REQUIRE(features(manifold).size() == static_cast<std::size_t>(manifold.count));
  for (const ContactPoint& point : points(manifold)) {
    REQUIRE(point.separation <= margin);
    const double reach =
        std::abs(point.separation) + kTolerances.clip_slack_m * pair.is_boxes() + tolerance;
    REQUIRE(outside(pair.shape_A, pair.X_WA, point.p_W) <= reach);
    REQUIRE(outside(pair.shape_B, pair.X_WB, point.p_W) <= reach);
  }
  if (manifold.count > 0)
    REQUIRE(deepest(manifold) <= overlap(pair, manifold.normal_W) + tolerance);
}

}  // namespace

TEST_CASE("normals are unit, points lie in both shapes inflated by the depth, features differ") {
  for_random_contacts(0.02, [](const Pair& pair, const Manifold& manifold) {
    check_sound(pair, manifold, 0.02, kExact);
  });
}

TEST_CASE("the deepest separation is the overlap along the normal") {
  int boxes = 0, exact_boxes = 0;
  for_random_contacts(0.02, [&](const Pair& pair, const Manifold& manifold) {
    const double along_normal = overlap(pair, manifold.normal_W);
    // Where the normal is that of a face preferred to the best axis, or the boxes are apart, the
    // deepest corner may lie beside the face. Then it is no contact.
    const bool is_best_axis = along_normal < least_overlap(pair) + kExact;
    if (!pair.is_boxes() || (is_best_axis && along_normal >= 0)) {
      REQUIRE(std::abs(deepest(manifold) - along_normal) < kExact);
      exact_boxes += pair.is_boxes();
    }
    boxes += pair.is_boxes();
  });
  CHECK(exact_boxes > boxes / 2);
}

TEST_CASE("parting two bodies by their depth leaves them touching") {
  for_random_contacts(0, [](Pair pair, const Manifold& manifold) {
    pair.X_WB.x += manifold.normal_W * overlap(pair, manifold.normal_W);
    const Manifold parted = pair.collide(1);
    REQUIRE(deepest(parted) < kExact);
    if (!pair.is_boxes()) REQUIRE(deepest(parted) > -kExact);
  });
}

TEST_CASE("the overlap of two boxes exceeds the least of the 15 axes by the leads alone") {
  for_random_contacts(0.02, [](const Pair& pair, const Manifold& manifold) {
    if (!pair.is_boxes()) return;
    const double excess = overlap(pair, manifold.normal_W) - least_overlap(pair);
    const double depth = std::max(0.0, overlap(pair, manifold.normal_W));
    REQUIRE(excess >= -kExact);
    REQUIRE(excess <= kTolerances.edge_bias_m + kTolerances.reference_bias_m +
                          kTolerances.edge_bias_per_depth * depth);
  });
}

TEST_CASE("boxes that overlap have a contact, boxes apart by more than the margin have none") {
  Random random;
  for (int trial = 0; trial < 20000; ++trial) {
    CAPTURE(trial);
    Pair pair = random.pair(ShapeKind::box, ShapeKind::box);
    pair.X_WB.x += random.vector(0.05);
    const double least = least_overlap(pair);
    const int count = pair.collide(0.01).count;
    if (least > 1e-9) REQUIRE(count > 0);
    if (least < -0.01) REQUIRE(count == 0);
  }
}

TEST_CASE("exchanging the bodies turns the normal and changes nothing else") {
  for_random_contacts(0.02, [](const Pair& pair, const Manifold& manifold) {
    const Manifold other = pair.swapped().collide(0.02);
    if ((other.normal_W + manifold.normal_W).norm() > kExact) {
      // Two boxes whose best faces are as good but for the lead of A.
      REQUIRE(pair.is_boxes());
      const double difference = overlap(pair, manifold.normal_W) - overlap(pair, -other.normal_W);
      REQUIRE(std::abs(difference) <= kTolerances.reference_bias_m + kExact);
      return;
    }
    REQUIRE(other.count == manifold.count);
    for (const ContactPoint& point : points(manifold)) {
      REQUIRE(std::ranges::any_of(points(other), [&](const ContactPoint& p) {
        return std::abs(p.separation - point.separation) < kExact &&
               (p.p_W - point.p_W).norm() < kExact;
      }));
    }
  });
}

TEST_CASE("moving both bodies together moves the manifold with them") {
  Random random;
  for_random_contacts(0.02, [&](const Pair& pair, const Manifold& manifold) {
    const Pose move{random.vector(10), random.rotation()};
    const auto moved = [&](const Pose& X) { return Pose{move.x + move.R * X.x, move.R * X.R}; };
    const Manifold other = Pair{pair.shape_A, pair.shape_B, moved(pair.X_WA), moved(pair.X_WB)}  //
                               .collide(0.02);
    REQUIRE(other.count == manifold.count);
    REQUIRE((other.normal_W - move.R * manifold.normal_W).norm() < kExact);
    for (const ContactPoint& point : points(manifold)) {
      REQUIRE(std::ranges::any_of(points(other), [&](const ContactPoint& p) {
        return p.feature == point.feature && std::abs(p.separation - point.separation) < kExact &&
               (p.p_W - (move.x + move.R * point.p_W)).norm() < kExact;
      }));
    }
  });
}

TEST_CASE("a small motion changes the manifold little and keeps its features, but for rare ties") {
  constexpr double kSmall = 1e-7;  // m and rad
  Random random;
  int contacts = 0, jumps = 0, renamed = 0;
  for_random_contacts(0.02, [&](const Pair& pair, const Manifold& manifold) {
    const Vector turn = random.vector(kSmall);
    Pair next = pair;
    next.X_WB.x += random.vector(kSmall);
    next.X_WB.R = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * pair.X_WB.R;
    const Manifold other = next.collide(0.02);
    ++contacts;
    const bool jumps_here = (other.normal_W - manifold.normal_W).norm() > 1e-4 ||
                            std::abs(deepest(other) - deepest(manifold)) > 1e-5;
    jumps += jumps_here;
    renamed += !jumps_here && features(other) != features(manifold);
  });
  CHECK(jumps < contacts / 2000);
  CHECK(renamed < contacts / 2000);
}

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
  const std::vector<Shape> shapes = {
      Shape::sphere(0.5),        Shape::sphere(1e-4),         Shape::box({0.5, 0.5, 0.5}),
      Shape::box({5, 5, 5e-4}),  Shape::box({1e-3, 1e-3, 5}), Shape::box({1e-4, 1e-4, 1e-4}),
      Shape::box({1e4, 1e4, 1}), Shape::half_space(),
  };
  const std::vector<Vector> offsets = {{0, 0, 0},         {0, 0, 1e-300},  {0, 0, 1},
                                       {0, 0, 1 - 1e-12}, {1, 1, 0},       {1, 1, 1},
                                       {0.5, 0, 0.999},   {0, 0, 0.5005},  {0.25, 0.25, 1.0001},
                                       {0, 1, 1 + 1e-15}, {1, 0, 1 - 1e-9}};
  const std::vector<Vector> places = {{0, 0, 0}, {1e5, -1e5, 1e5}};
  int contacts = 0;
  for (const Shape& shape_A : shapes) {
    for (const Shape& shape_B : shapes) {
      for (const Matrix& turn : turns) {
        for (const Vector& offset : offsets) {
          for (const Vector& place : places) {
            for (const Matrix& both : turns) {
              const Pair pair{
                  shape_A, shape_B, {place, both}, {place + both * offset, both * turn}};
              CAPTURE(shape_A.parameters, shape_B.parameters, turn, offset, place, both);
              const Manifold manifold = pair.collide(0.02);
              check_sound(pair, manifold, 0.02, 1e-8);
              contacts += manifold.count > 0;
            }
          }
        }
      }
    }
  }
  CHECK(contacts > 10000);
}

TEST_CASE("poses that are not finite give no contact") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  Random random;
  for (const auto& [kind_A, kind_B] : kKinds) {
    const Pair good{random.shape(kind_A), random.shape(kind_B), {}, {}};
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
