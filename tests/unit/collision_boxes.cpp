// Boxes on half-spaces and on each other: where the points are, what they are called, and what
// each tolerance is for.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <set>
#include <span>

#include "server/collision/box_batch.h"
#include "server/collision/machine_lanes.h"
#include "server/collision/narrow_phase.h"
#include "server/collision/tolerances.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/collision_support.h"
#include "tests/unit/made_in_order.h"

using namespace cradle;

namespace {

constexpr double kFarAway = 1000;  // m
const double kDegree = std::atan(1.0) / 45;

/// There are these points and no others, in any order, each with this separation.
void check_points(const Manifold& manifold, double separation,
                  const std::vector<Vector>& expected) {
  REQUIRE(manifold.count == static_cast<int>(expected.size()));
  for (const Vector& p_W : expected) {
    CAPTURE(p_W);
    CHECK(std::ranges::any_of(points(manifold), [&](const ContactPoint& point) {
      return (point.p_W - p_W).norm() < 1e-12 && std::abs(point.separation - separation) < 1e-12;
    }));
  }
}

class BoxRandom {
 public:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  Vector vector(double size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }
  Matrix rotation() { return turn(uniform(0, 180) * kDegree, vector(1)); }

 private:
  std::mt19937_64 engine_{5};
};

/// Corners of a convex polygon, in order; z is ignored.
using Polygon = std::vector<Vector>;

double area(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    twice += polygon[k].cross(polygon[(k + 1) % polygon.size()]).z();
  }
  return std::abs(twice) / 2;
}

/// The lower face of a posed box.
Polygon lower_face(const Vector& half, const Pose& X_WB) {
  Polygon face;
  for (const Vector& corner :
       {Vector(1, 1, -1), Vector(-1, 1, -1), Vector(-1, -1, -1), Vector(1, -1, -1)}) {
    face.push_back(X_WB.x + X_WB.R * corner.cwiseProduct(half));
  }
  return face;
}

/// The part of `subject` inside the rectangle |x| <= half_x, |y| <= half_y: Sutherland, Hodgman.
Polygon clipped(Polygon subject, double half_x, double half_y) {
  const Vector sides[4] = {
      {1 / half_x, 0, 0}, {-1 / half_x, 0, 0}, {0, 1 / half_y, 0}, {0, -1 / half_y, 0}};
  for (const Vector& side : sides) {
    Polygon inside;
    for (std::size_t k = 0; k < subject.size(); ++k) {
      const Vector &p = subject[k], &q = subject[(k + 1) % subject.size()];
      const double d_p = side.dot(p) - 1, d_q = side.dot(q) - 1;
      if (d_p <= 0) inside.push_back(p);
      if ((d_p < 0 && d_q > 0) || (d_p > 0 && d_q < 0)) {
        inside.push_back(p + (q - p) * (d_p / (d_p - d_q)));
      }
    }
    subject = inside;
  }
  return subject;
}

}  // namespace

TEST_CASE("a box at rest on a half-space stands on its four lower corners") {
  const Shape box = Shape::box({1, 2, 3});
  const Manifold manifold = collide(box, at(5, 0, 2.99), Shape::half_space(), {}, 0.02);
  CHECK(manifold.normal_W == -Vector::UnitZ());
  check_points(manifold, -0.01, {{4, -2, -0.005}, {6, -2, -0.005}, {4, 2, -0.005}, {6, 2, -0.005}});
}

TEST_CASE("a box on its edge has two points, on its corner one, on its head four again") {
  const double diagonal = std::sqrt(0.5);
  const auto points_at = [](double height, const Matrix& R) {
    return collide(kCube, at(0, 0, height, R), Shape::half_space(), {}, 0.02).count;
  };
  CHECK(points_at(diagonal, turn(45 * kDegree, Vector::UnitX())) == 2);
  CHECK(points_at(std::sqrt(0.75), turn(std::acos(std::sqrt(1 / 3.0)), {1, -1, 0})) == 1);
  CHECK(points_at(0.5, turn(180 * kDegree, Vector::UnitY())) == 4);
  CHECK(points_at(0.52 + 1e-9, Matrix::Identity()) == 0);
}

TEST_CASE("a plate thinner than the margin stands on its lower side alone") {
  const Manifold manifold =
      collide(Shape::box({1, 1, 0.001}), at(0, 0, 0.001), Shape::half_space(), {}, 0.02);
  check_points(manifold, 0, {{1, 1, 0}, {-1, 1, 0}, {1, -1, 0}, {-1, -1, 0}});
}

TEST_CASE("a cube at rest on a larger box stands on its four lower corners") {
  const Manifold manifold = collide(Shape::box({5, 5, 1}), {}, kCube, at(2, 1, 1.499), 0.02);
  CHECK(manifold.normal_W == Vector::UnitZ());
  check_points(manifold, -0.001,
               {{1.5, 0.5, 0.9995},
                {2.5, 0.5, 0.9995},  //
                {1.5, 1.5, 0.9995},
                {2.5, 1.5, 0.9995}});
}

TEST_CASE("a large box at rest on a cube is carried by the cube's corners") {
  const Manifold manifold =
      collide(kCube, {}, Shape::box({5, 5, 1}), at(2, 1, 1.501, turn(1, Vector::UnitZ())), 0.02);
  CHECK(manifold.normal_W == Vector::UnitZ());
  check_points(
      manifold, 0.001,
      {{0.5, 0.5, 0.5005}, {-0.5, 0.5, 0.5005}, {0.5, -0.5, 0.5005}, {-0.5, -0.5, 0.5005}});
}

TEST_CASE("a cube that overhangs is carried up to the edge, to the last digit") {
  const Manifold manifold = collide(kCube, {}, kCube, at(0.4, -0.3, 1), 0.02);
  check_points(manifold, 0,
               {{0.5, -0.5, 0.5},
                {0.5, 0.2, 0.5},
                {-0.1, -0.5, 0.5},  //
                {-0.1, 0.2, 0.5}});
}

TEST_CASE("two cubes in one place part along an axis by their full width") {
  const Manifold manifold = collide(kCube, {}, kCube, {}, 0);
  CHECK(manifold.count == 4);
  CHECK(deepest(manifold) == 1);
}

TEST_CASE("crossed edges meet in one point between them, up to the margin and no farther") {
  const double height = 2 * std::sqrt(0.5);
  const Pose X_WA = at(0, 0, 0, turn(45 * kDegree, Vector::UnitX()));
  for (const double s : {-0.05, 0.0, 0.019}) {
    const Pose X_WB = at(0.3, 0.2, height + s, turn(45 * kDegree, Vector::UnitY()));
    const Manifold manifold = collide(kCube, X_WA, kCube, X_WB, 0.02);
    CHECK((manifold.normal_W - Vector::UnitZ()).norm() < 1e-12);
    check_points(manifold, s, {{0.3, 0, (height + s) / 2}});
  }
  const Pose too_far = at(0.3, 0.2, height + 0.021, turn(45 * kDegree, Vector::UnitY()));
  CHECK(collide(kCube, X_WA, kCube, too_far, 0.02).count == 0);
  // Their lines still cross within the margin, but the edges have ended.
  const Pose beside = at(0.53, 0, height + 0.001, turn(45 * kDegree, Vector::UnitY()));
  CHECK(collide(kCube, X_WA, kCube, beside, 0.02).count == 0);
}

TEST_CASE("flat contacts are corners of the two faces' intersection and span most of it") {
  BoxRandom random;
  for (int trial = 0; trial < 2000; ++trial) {
    CAPTURE(trial);
    const Vector a = Vector{random.uniform(0.2, 2), random.uniform(0.2, 2), 0.5};
    const Vector b = Vector{random.uniform(0.2, 2), random.uniform(0.2, 2), 0.5};
    const Pose X_WB{Vector{random.uniform(-1, 1), random.uniform(-1, 1), 0.999},
                    turn(random.uniform(0, 360) * kDegree, Vector::UnitZ())};
    const Polygon expected = clipped(lower_face(b, X_WB), a.x(), a.y());
    const Manifold manifold =
        collide(Shape::box(to_plain(a)), {}, Shape::box(to_plain(b)), X_WB, 0);
    REQUIRE((manifold.count > 0) == (expected.size() > 0));
    if (expected.empty() || manifold.normal_W.z() < 0.99) continue;

    Polygon found;
    for (const ContactPoint& point : points(manifold)) {
      REQUIRE(std::abs(point.separation + 0.001) < 1e-12);
      REQUIRE(std::ranges::any_of(expected, [&](const Vector& corner) {
        return (corner - point.p_W).head<2>().norm() < 2 * kTolerances.clip_slack_m;
      }));
      found.push_back(point.p_W);
    }
    if (expected.size() <= 4) {
      REQUIRE(std::abs(manifold.count - static_cast<int>(expected.size())) <= 1);
    } else {
      REQUIRE(manifold.count == 4);
    }
    Vector middle = Vector::Zero();
    for (const Vector& p : found) middle += p / static_cast<double>(found.size());
    std::ranges::sort(found, {}, [&](const Vector& p) {
      return std::atan2(p.y() - middle.y(), p.x() - middle.x());
    });
    REQUIRE(area(found) > 0.6 * area(expected) - 4 * kTolerances.clip_slack_m);
  }
}

TEST_CASE("a flush stack keeps its features while it sways") {
  const double sway = 0.3 * kTolerances.clip_slack_m;
  BoxRandom random;
  for (const double half : {0.5, 0.5 + sway, 0.5 - sway}) {
    const Shape upper = Shape::box({half, half, 0.5});
    const Manifold still = collide(kCube, {}, upper, at(0, 0, 1), 0.02);
    REQUIRE(still.count == 4);
    for (int trial = 0; trial < 1000; ++trial) {
      const double angle = random.uniform(-sway, sway);
      const Matrix R = turn(angle, random.vector(1));
      const Vector x = Vector(0, 0, 1) + random.vector(sway);
      REQUIRE(features(collide(kCube, {}, upper, {x, R}, 0.02)) == features(still));
    }
  }
}

TEST_CASE("each face has features of its own, and so has each body as the reference") {
  std::set<std::uint32_t> seen;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1, 1}) {
      const Vector x = Vector::Unit(axis) * side;
      seen.merge(features(collide(kCube, {}, kCube, {x, Matrix::Identity()}, 0.02)));
    }
  }
  CHECK(seen.size() == 24);
  const Pose leaning = at(0.5, 0, 0.995, turn(3 * kTolerances.reference_bias_m, Vector::UnitY()));
  const Manifold on_B = collide(kCube, {}, kCube, leaning, 0.02);
  REQUIRE(on_B.normal_W == leaning.R.col(2));
  for (const std::uint32_t feature : features(on_B)) CHECK_FALSE(seen.contains(feature));
}

TEST_CASE("the reference face stays with A in a tie") {
  const double lead = kTolerances.reference_bias_m;
  // The upper cube leans, so that its own face sees less, or more, overlap than the lower one's.
  const auto touch = [](double angle, double x) {
    return collide(kCube, {}, kCube, at(x, 0, 0.995, turn(angle, Vector::UnitY())), 0.02);
  };
  const auto is_on_A = [](const Manifold& manifold) {
    return std::ranges::all_of(features(manifold), [](auto f) { return f >> 12 < 6; });
  };
  // A's face sees overlap 0.005 + angle / 2; B's 0.005 + angle |x| more or less.
  for (const auto& [angle, x] : {std::pair{1.8, 0.0}, {-1.8, 0.0}, {1.8, 0.5}, {3.0, -0.5}}) {
    CHECK(is_on_A(touch(angle * lead, x)));
  }
  CHECK_FALSE(is_on_A(touch(3 * lead, 0.5)));
  // The normal is that of what is deepest: a corner of B over A's face, or its face over an edge.
  CHECK(touch(1.8 * lead, 0).normal_W == Vector::UnitZ());
  CHECK(touch(-1.8 * lead, 0).normal_W == Vector::UnitZ());
  CHECK(touch(3 * lead, -0.5).normal_W == Vector::UnitZ());
  CHECK(touch(1.8 * lead, 0.5).normal_W.x() == Approx(std::sin(1.8 * lead)));
  CHECK(touch(3 * lead, 0.5).normal_W.x() == Approx(std::sin(3 * lead)));
}

TEST_CASE("an edge contact needs a clear lead over the faces") {
  BoxRandom random;
  int edges = 0, faces = 0, leads = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const Pose X_WA = {{0, 0, 0}, random.rotation()};
    const Pose X_WB = {random.vector(1).normalized() * random.uniform(0.9, 1.4), random.rotation()};
    const auto gap = [&](const Vector& n) {
      return std::abs(n.dot(X_WB.x)) - 0.5 * (X_WA.R.transpose() * n).lpNorm<1>() -
             0.5 * (X_WB.R.transpose() * n).lpNorm<1>();
    };
    double face = -10, edge = -10;
    for (int i = 0; i < 3; ++i) {
      face = std::max({face, gap(X_WA.R.col(i)), gap(X_WB.R.col(i))});
      for (int j = 0; j < 3; ++j) {
        const Vector n = X_WA.R.col(i).cross(X_WB.R.col(j));
        if (n.norm() > 0.02) edge = std::max(edge, gap(n.normalized()));
      }
    }
    if (std::max(edge, face) > 0) continue;
    const Manifold manifold = collide(kCube, X_WA, kCube, X_WB, 0.02);
    REQUIRE(manifold.count > 0);
    const double lead =
        kTolerances.edge_bias_m - kTolerances.edge_bias_per_depth * std::min(0.0, face);
    const Vector n = manifold.normal_W;
    const bool is_face = (X_WA.R.transpose() * n).cwiseAbs().maxCoeff() > 1 - 1e-12 ||
                         (X_WB.R.transpose() * n).cwiseAbs().maxCoeff() > 1 - 1e-12;
    const bool is_clear = edge > face + lead;
    if (is_clear) REQUIRE_FALSE(is_face);
    if (!is_face) REQUIRE(edge > face);  // else the deepest corner is over a face
    leads += is_face && edge > face;
    ++(is_face ? faces : edges);
  }
  CHECK(edges > 100);
  CHECK(faces > 1000);
  CHECK(leads > 1000);
}

TEST_CASE("nearly parallel edges give no axis") {
  BoxRandom random;
  int contacts = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const double angle = random.uniform(0, 0.5) * kDegree;
    const Matrix R = turn(angle, random.vector(1));
    const Vector x = random.vector(1.1);
    const Manifold manifold = collide(kCube, {}, kCube, {x, R}, 0);
    contacts += manifold.count > 0;
    REQUIRE(manifold.normal_W.cwiseAbs().maxCoeff() > std::cos(1 * kDegree));
  }
  CHECK(contacts > 10000);
}

TEST_CASE("a matchbox behaves like a crate") {
  constexpr double kScale = 1.0 / 64;  // a power of two scales without rounding
  BoxRandom random;
  int contacts = 0;
  for (int trial = 0; trial < 10000; ++trial) {
    const Vector a = random.vector(0.2).cwiseAbs() + Vector::Constant(0.3);
    const Vector b = random.vector(0.2).cwiseAbs() + Vector::Constant(0.3);
    const Pose X_WA{random.vector(1), random.rotation()};
    const Pose X_WB{X_WA.x + random.vector(0.7), trial % 2 ? X_WA.R : random.rotation()};
    const auto manifold_at = [&](double scale) {
      return collide(Shape::box(to_plain(a * scale)), {X_WA.x * scale, X_WA.R},
                     Shape::box(to_plain(b * scale)), {X_WB.x * scale, X_WB.R}, 0.02 * scale);
    };
    const Manifold crate = manifold_at(1), matchbox = manifold_at(kScale);
    REQUIRE(features(crate) == features(matchbox));
    REQUIRE(crate.normal_W == matchbox.normal_W);
    if (crate.count == 0) continue;
    REQUIRE(std::abs(deepest(crate) * kScale - deepest(matchbox)) < kTolerances.tie_m);
    ++contacts;
  }
  CHECK(contacts > 3000);
}

TEST_CASE("rounding does not choose among eight points") {
  BoxRandom random;
  const auto manifold_at = [&](double noise) {
    const Matrix R = turn(noise, random.vector(1)) *  //
                     turn(45 * kDegree, Vector::UnitZ());
    return collide(kCube, {}, kCube, {Vector(0, 0, 0.999) + random.vector(noise), R}, 0.02);
  };
  const Manifold still = manifold_at(0);
  REQUIRE(still.count == 4);
  for (int trial = 0; trial < 1000; ++trial) {
    REQUIRE(features(manifold_at(0.1 * kTolerances.tie_m)) == features(still));
  }
}

TEST_CASE("the deepest point is kept when there are more than four") {
  BoxRandom random;
  int reduced = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const Matrix lean = turn(0.002, Vector{random.uniform(-1, 1), random.uniform(-1, 1), 0.0});
    const Pose X_WB{{random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0.995},
                    lean * turn(random.uniform(0, 360) * kDegree, Vector::UnitZ())};
    const Vector half{random.uniform(0.3, 0.8), random.uniform(0.3, 0.8), 0.5};
    const Manifold manifold = collide(kCube, {}, Shape::box(to_plain(half)), X_WB, 0.02);
    const Polygon overlap = clipped(lower_face(half, X_WB), 0.5, 0.5);
    const bool is_on_A = manifold.points[0].feature >> 12 < 6;
    if (!is_on_A || manifold.normal_W.z() < 0.999 || overlap.size() <= 4) continue;
    ++reduced;
    double lowest = kFarAway;
    for (const Vector& corner : overlap) lowest = std::min(lowest, corner.z() - 0.5);
    REQUIRE(std::abs(deepest(manifold) + lowest) < 0.002 * 2 * kTolerances.clip_slack_m);
  }
  CHECK(reduced > 1000);
}

namespace {

struct PosedBoxes {
  Shape A, B;
  Pose X_WA, X_WB;
};

/// Boxes near each other: apart, at corners and edges, flush, deep; from 1 mm to 1 km; and poses
/// that are no numbers among them.
std::vector<PosedBoxes> boxes_near_each_other(std::size_t count) {
  constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
  BoxRandom random;
  std::vector<PosedBoxes> pairs;
  const auto half = [&random](bool is_any_size) {
    const auto size = [&] {
      return is_any_size ? std::pow(10, random.uniform(-3, 3)) : random.uniform(0.1, 1);
    };
    return Vec3{size(), size(), size()};
  };
  for (std::size_t k = 0; k < count; ++k) {
    const bool is_any_size = k % 5 == 0, is_flush = k % 3 == 0;
    const Vec3 a = half(is_any_size), b = half(is_any_size);
    PosedBoxes pair{Shape::box(a), Shape::box(b), {random.vector(5), random.rotation()}, {}};
    pair.X_WB.R = is_flush ? Matrix(pair.X_WA.R * turn(random.uniform(0, 3), Vector::UnitZ()))
                           : random.rotation();
    const Vector beside{random.uniform(-0.5, 0.5) * (a.x + b.x), 0.1 * (a.y + b.y),
                        a.z + b.z - 1e-4};
    pair.X_WB.x = pair.X_WA.x + (is_flush      ? Vector(pair.X_WA.R * beside)
                                 : is_any_size ? Vector(random.vector(1).cwiseProduct(to_eigen(a)))
                                               : random.vector(1.2));
    const auto entry = static_cast<Eigen::Index>(k % 9);
    if (k % 37 == 1) pair.X_WB.x[entry % 3] = kNoNumber;
    if (k % 37 == 2) pair.X_WA.R(entry / 3, entry % 3) = kNoNumber;
    if (k % 37 == 3) pair.X_WB.R(entry / 3, entry % 3) = kNoNumber;
    pairs.push_back(pair);
  }
  return pairs;
}

bool is_finite(const PosedBoxes& pair) {
  return pair.X_WA.R.allFinite() && pair.X_WB.R.allFinite() && pair.X_WB.x.allFinite();
}

}  // namespace

TEST_CASE("boxes have the same manifolds at every width, alone and in company") {
  const std::vector<PosedBoxes> pairs = boxes_near_each_other(3001);
  std::vector<Manifold> alone;
  int touching = 0, reduced = 0;
  for (const PosedBoxes& pair : pairs) {
    alone.push_back(collide(pair.A, pair.X_WA, pair.B, pair.X_WB, 0.02));
    touching += alone.back().count > 0 ? 1 : 0;
    reduced += alone.back().count == 4 ? 1 : 0;
    if (!is_finite(pair)) CHECK(alone.back().count == 0);
  }
  CHECK(touching > 1500);
  CHECK(reduced > 500);
  for (const int lanes : machine_lanes()) {
    CAPTURE(lanes);
    InOrder in_order(pairs.size());
    BoxBatch batch(in_order, lanes);
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      batch.add(k, {pairs[k].A, pairs[k].X_WA}, {pairs[k].B, pairs[k].X_WB}, 0.02);
    }
    batch.finish();
    CHECK(std::ranges::equal(in_order.made, alone, are_the_same));
    // Blocks that are full in part only, with what the last ones left in their other lanes.
    for (std::size_t begin = 0, some = 1; begin + some <= pairs.size(); begin += some, ++some) {
      CAPTURE(begin, some);
      for (std::size_t k = begin; k < begin + some; ++k) {
        in_order.made[k] = {};
        batch.add(k, {pairs[k].A, pairs[k].X_WA}, {pairs[k].B, pairs[k].X_WB}, 0.02);
      }
      batch.finish();
      CHECK(std::equal(in_order.made.begin() + static_cast<std::ptrdiff_t>(begin),
                       in_order.made.begin() + static_cast<std::ptrdiff_t>(begin + some),
                       alone.begin() + static_cast<std::ptrdiff_t>(begin), are_the_same));
    }
  }
}

TEST_CASE("a small box on a large one, over its edge, keeps its points") {
  // A floor whose side is at x = 0, and a cube of 1 mm turned by 0.7 rad, half over the edge: five
  // corners of the overlap, of which four are kept, as far apart as the cube is wide.
  for (const double half : {1.0, 1000.0, 1e5}) {
    for (const double small : {5e-4, 5e-3}) {
      CAPTURE(half, small);
      const Shape floor = Shape::box({half, half, half}), cube = Shape::box({small, small, small});
      const Pose X_floor = at(-half, 0, -half);
      const Pose X_cube = at(-0.3 * small, 0, small - 1e-6, turn(0.7, Vector::UnitZ()));
      for (const bool is_floor_first : {true, false}) {
        const Manifold manifold = is_floor_first ? collide(floor, X_floor, cube, X_cube, 1e-3)
                                                 : collide(cube, X_cube, floor, X_floor, 1e-3);
        REQUIRE(manifold.count == 4);
        double apart = small;
        for (const ContactPoint& p : points(manifold)) {
          for (const ContactPoint& q : points(manifold)) {
            if (&p != &q) apart = std::min(apart, (p.p_W - q.p_W).norm());
          }
        }
        CHECK(apart > 0.2 * small);
      }
    }
  }
}
