#include "tests/bench/pair_scenes.h"

#include <cassert>
#include <numbers>

#include "tests/bench/parting.h"
#include "tests/bench/poses.h"
#include "tests/bench/random_poses.h"

namespace cradle::bench {
namespace {

GeometryPointer made(const std::vector<Vector>& points) {
  GeometryPointer geometry = make_hull(points).geometry;
  assert(geometry);
  return geometry;
}

GeometryPointer cube_hull() {
  std::vector<Vector> corners;
  for (int k = 0; k < 8; ++k)
    corners.emplace_back(k & 1 ? 0.5 : -0.5, k & 2 ? 0.4 : -0.4, k & 4 ? 0.3 : -0.3);
  return made(corners);
}

GeometryPointer icosahedron() {
  std::vector<Vector> corners;
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < 4; ++k) {
      Vector corner = Vector::Zero();
      corner[(axis + 1) % 3] = k & 1 ? 0.25 : -0.25;
      corner[(axis + 2) % 3] = (k & 2 ? 0.5 : -0.5) * std::numbers::phi / 2;
      corners.push_back(corner);
    }
  }
  return made(corners);
}

GeometryPointer pebble() {
  RandomPoses random(42);
  std::vector<Vector> points;
  for (int k = 0; k < 42; ++k)
    points.push_back(random.direction().cwiseProduct(Vector(0.5, 0.4, 0.35)));
  return made(points);
}

Solid solid_of(PairShape shape) {
  static const GeometryPointer kCube = cube_hull(), kIcosahedron = icosahedron(),
                               kPebble = pebble();
  switch (shape) {
    case PairShape::sphere:
      return Shape::sphere(0.5);
    case PairShape::box:
      return Shape::box({0.5, 0.4, 0.3});
    case PairShape::capsule:
      return Shape::capsule(0.3, 0.4);
    case PairShape::cylinder:
      return Shape::cylinder(0.4, 0.5);
    case PairShape::cone:
      return Shape::cone(0.4, 0.5);
    case PairShape::ellipsoid:
      return Shape::ellipsoid({0.5, 0.4, 0.3});
    case PairShape::hull_8:
      return Solid(kCube);
    case PairShape::hull_12:
      return Solid(kIcosahedron);
    case PairShape::hull_42:
      return Solid(kPebble);
    case PairShape::half_space:
      break;
  }
  return Shape::half_space();
}

/// The direction, in its frame, in which a shape looks down when it rests.
Vector side_to_rest_on(const Solid& solid, RandomPoses& random) {
  switch (solid.shape.kind) {
    case ShapeKind::sphere:
      return random.direction();
    case ShapeKind::box:
      return Vector::Unit(static_cast<int>(random.uniform(0, 3))) *
             (random.uniform(0, 1) < 0.5 ? -1 : 1);
    case ShapeKind::capsule:
      return Vector::UnitX();
    case ShapeKind::cylinder:  // on an end or on its side
      return random.uniform(0, 1) < 0.5 ? Vector::UnitZ() : Vector::UnitX();
    case ShapeKind::half_space:
      return Vector::UnitZ();
    case ShapeKind::hull: {
      const std::vector<Vector> normals = Polytope(solid, {}).normals;
      return normals[static_cast<std::size_t>(
          random.uniform(0, static_cast<double>(normals.size())))];
    }
    default:  // cone, ellipsoid
      return -Vector::UnitZ();
  }
}

/// Turns `side` to where it looks, and then the shape about z; what lies gets its axis along y, so
/// that two of them lie along each other.
Matrix laid(const Vector& side, const Vector& to, bool lies, RandomPoses& random) {
  const Matrix R = turn_onto(side, to).toRotationMatrix();
  const double angle = random.uniform(-std::numbers::pi, std::numbers::pi);
  if (!lies) return Eigen::AngleAxisd(angle, Vector::UnitZ()) * R;
  const Vector axis = R.col(2);
  return Eigen::AngleAxisd(0.5 * std::numbers::pi - std::atan2(axis.y(), axis.x()),
                           Vector::UnitZ()) *
         R;
}

/// The middle of that side, in the shape's frame.
Vector middle_of(const Solid& solid, const Vector& side) {
  if (solid.shape.kind != ShapeKind::hull) return side * side.dot(support_point(solid, side));
  Vector sum = Vector::Zero();
  double count = 0;
  const double reach = side.dot(support_point(solid, side));
  for (const Vector& v : solid.hull().vertices) {
    if (side.dot(v) < reach - 1e-9) continue;
    sum += v;
    ++count;
  }
  return sum / count;
}

/// B's overlap with A along n becomes `depth`.
void sink(Pair& pair, const Vector& n, double depth) {
  pair.X_WB.x += n * (overlap(pair, n) - depth);
}

Pair at_rest(const Solid& A, const Solid& B, RandomPoses& random) {
  const Vector side_A = side_to_rest_on(A, random), side_B = side_to_rest_on(B, random);
  const auto lies = [](const Solid& solid, const Vector& side) {
    return solid.shape.kind == ShapeKind::capsule ||
           (solid.shape.kind == ShapeKind::cylinder && side.z() == 0);
  };
  Pair pair{A, B, {}, {}};
  const bool both_lie = lies(A, side_A) && lies(B, side_B);
  pair.X_WA.R = laid(side_A, Vector::UnitZ(), both_lie, random);
  pair.X_WB.R = laid(side_B, -Vector::UnitZ(), both_lie, random);
  pair.X_WB.x = pair.X_WA.R * middle_of(A, side_A) - pair.X_WB.R * middle_of(B, side_B);
  // Round tops meet there, sides that lie along each other anywhere on them, faces about there.
  const bool is_round = pair.has(ShapeKind::sphere) || pair.has(ShapeKind::ellipsoid);
  const Vector aside{random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05), 0.0};
  if (!is_round) pair.X_WB.x += both_lie ? Vector(0, 3 * aside.y(), 0) : aside;
  sink(pair, Vector::UnitZ(), random.uniform(0, 1e-3));
  const Pose all{random.vector(3), random.rotation()};
  for (Pose* X : {&pair.X_WA, &pair.X_WB}) *X = {all.x + all.R * X->x, all.R * X->R};
  return pair;
}

double half_height(const Solid& solid) {
  if (solid.shape.kind == ShapeKind::half_space) return 1;
  const Vector down = solid.shape.kind == ShapeKind::capsule ? Vector::UnitX() : Vector::UnitZ();
  return 0.5 * (support_point(solid, down) - support_point(solid, -down)).dot(down);
}

Pair turned_once(const Solid& A, const Solid& B, Situation situation, RandomPoses& random) {
  Pair pair{A, B, {random.vector(3), random.rotation()}, {random.vector(3), random.rotation()}};
  const bool is_plane = B.shape.kind == ShapeKind::half_space;
  const Vector line = is_plane ? Vector(-pair.X_WB.R.col(2)) : random.direction();
  if (!is_plane) pair.X_WB.x = pair.X_WA.x + 0.2 * random.vector(1);
  sink(pair, line, -0.5);
  const Vector n = parting(pair).n;
  switch (situation) {
    case Situation::angle:
      sink(pair, n, random.uniform(0, 0.01));
      break;
    case Situation::deep:
      sink(pair, n, random.uniform(0.1, 0.5) * std::min(half_height(A), half_height(B)));
      break;
    default:
      sink(pair, n, -random.uniform(0.1, 0.9) * kPairMargin);
      break;
  }
  return pair;
}

Pair turned(const Solid& A, const Solid& B, Situation situation, RandomPoses& random) {
  for (;;) {
    const Pair pair = turned_once(A, B, situation, random);
    // A tip that is pushed so far past a rim may come out on its other side.
    if (situation != Situation::deep || parting(pair).overlap > 0) return pair;
  }
}

}  // namespace

std::string_view word_of(PairShape shape) {
  constexpr std::array<std::string_view, kPairShapes> kNames = {
      "sphere",    "box",    "capsule", "cylinder", "cone",
      "ellipsoid", "hull_8", "hull_12", "hull_42",  "half_space"};
  return kNames[static_cast<std::size_t>(shape)];
}

std::string_view word_of(Situation situation) {
  constexpr std::array<std::string_view, kSituations.size()> kNames = {"resting", "angle", "deep",
                                                                       "apart"};
  return kNames[static_cast<std::size_t>(situation)];
}

std::vector<Pair> pairs_in(PairShape A, PairShape B, Situation situation, std::size_t count) {
  RandomPoses random(100 * static_cast<std::uint64_t>(A) + 10 * static_cast<std::uint64_t>(B) +
                     static_cast<std::uint64_t>(situation));
  std::vector<Pair> pairs;
  for (std::size_t k = 0; k < count; ++k) {
    pairs.push_back(situation == Situation::resting
                        ? at_rest(solid_of(A), solid_of(B), random)
                        : turned(solid_of(A), solid_of(B), situation, random));
  }
  return pairs;
}

}  // namespace cradle::bench
