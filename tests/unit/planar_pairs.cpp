// What must hold for the contacts of any two shapes of the plane. The measures are the support
// function, the distance of corners from edges, and the separation along every edge's normal: all
// made here from the definitions of the shapes.
#include "server/collision/planar_pairs.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <span>

#include "server/collision/tolerances.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/trials.h"

using namespace cradle;

namespace {

constexpr int kFlatContacts = trials(3000);  // of each pair of kinds

enum class FlatKind { disc, rectangle, capsule, triangle, quadrangle, many, half_plane };
constexpr FlatKind kFlatKinds[] = {FlatKind::disc,      FlatKind::rectangle,  FlatKind::capsule,
                                   FlatKind::triangle,  FlatKind::quadrangle, FlatKind::many,
                                   FlatKind::half_plane};

struct Flat {
  Shape shape;
  GeometryPointer geometry;
};

struct FlatPair {
  Flat A, B;
  Pose X_WA, X_WB;

  Manifold collide(double margin = kMargin) const {
    return collide_in_plane({A.shape, X_WA, A.geometry.get()}, {B.shape, X_WB, B.geometry.get()},
                            margin);
  }
  FlatPair swapped() const { return {B, A, X_WB, X_WA}; }
  bool has(ShapeKind kind) const { return A.shape.kind == kind || B.shape.kind == kind; }
};

Pose flat_pose(const Vector2& p, double angle) {
  Pose X{{p.x(), p.y(), 0}, Matrix::Identity()};
  X.R.topLeftCorner<2, 2>() << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  return X;
}

/// Upwards of the half-plane is at `angle`.
Pose ground_pose(const Vector2& p, double angle) {
  Pose X{{p.x(), p.y(), 0}, Matrix::Identity()};
  const Vector up(std::cos(angle), std::sin(angle), 0);
  X.R.col(2) = up;
  X.R.col(0) = Vector::UnitZ();
  X.R.col(1) = up.cross(Vector::UnitZ());
  return X;
}

/// The core's corners in W, counter-clockwise.
std::vector<Vector2> corners(const Flat& flat, const Pose& X) {
  std::vector<Vector2> of_B;
  const Shape& s = flat.shape;
  const double a = s.parameters[0], b = s.parameters[1];
  if (s.kind == ShapeKind::sphere) of_B = {{0, 0}};
  if (s.kind == ShapeKind::capsule) of_B = {{-b, 0}, {b, 0}};
  if (s.kind == ShapeKind::box) of_B = {{-a, -b}, {a, -b}, {a, b}, {-a, b}};
  if (s.kind == ShapeKind::polygon) {
    for (std::size_t k = 0; k < s.corner_count(); ++k)
      of_B.emplace_back(s.corner_m(k).x, s.corner_m(k).y);
  }
  if (flat.geometry) of_B = std::get<ConvexPolygon>(flat.geometry->value).corners;
  for (Vector2& p : of_B) p = X.x.head<2>() + X.R.topLeftCorner<2, 2>() * p;
  return of_B;
}

double radius(const Flat& flat) {
  const bool is_round =
      flat.shape.kind == ShapeKind::sphere || flat.shape.kind == ShapeKind::capsule;
  return is_round ? flat.shape.radius_m() : 0;
}

double support(const Flat& flat, const Pose& X, const Vector2& d) {
  if (flat.shape.kind == ShapeKind::half_space) return d.dot(X.x.head<2>());  // along its normal
  double reach = -INFINITY;
  for (const Vector2& p : corners(flat, X)) reach = std::max(reach, d.dot(p));
  return reach + radius(flat);
}

/// How far A reaches into B along n; negative: apart.
double overlap(const FlatPair& pair, const Vector2& n) {
  return support(pair.A, pair.X_WA, n) + support(pair.B, pair.X_WB, -n);
}
double overlap(const FlatPair& pair, const Manifold& m) {
  return overlap(pair, m.normal_W.head<2>());
}

double distance(const Vector2& p, const Vector2& a, const Vector2& b) {
  const Vector2 edge = b - a;
  const double u = edge.squaredNorm() > 0 ? (p - a).dot(edge) / edge.squaredNorm() : 0;
  return (p - a - std::clamp(u, 0.0, 1.0) * edge).norm();
}

/// Least distance of the corners of one core from the edges of the other.
double distance(const std::vector<Vector2>& A, const std::vector<Vector2>& B) {
  double least = INFINITY;
  for (std::size_t i = 0; i < A.size(); ++i) {
    for (std::size_t j = 0; j < B.size(); ++j) {
      least = std::min({least, distance(A[i], B[j], B[(j + 1) % B.size()]),
                        distance(B[j], A[i], A[(i + 1) % A.size()])});
    }
  }
  return least;
}

/// Outward unit normals of a core's edges; of a capsule's both.
std::vector<Vector2> normals(const std::vector<Vector2>& core) {
  std::vector<Vector2> all;
  for (std::size_t k = 0; core.size() > 1 && k < core.size(); ++k) {
    const Vector2 e = core[(k + 1) % core.size()] - core[k];
    all.push_back(Vector2(e.y(), -e.x()).normalized());
  }
  return all;
}

/// The separation that no normal beats: the distance, or minus the least overlap. And how much
/// the second best edge falls behind the best.
struct Best {
  double separation, lead;
};
Best best(const FlatPair& pair) {
  if (pair.A.shape.kind == ShapeKind::half_space)
    return {-overlap(pair, Vector2(pair.X_WA.R.col(2).head<2>())), 1};
  if (pair.B.shape.kind == ShapeKind::half_space)
    return {-overlap(pair, Vector2(-pair.X_WB.R.col(2).head<2>())), 1};
  const auto A = corners(pair.A, pair.X_WA), B = corners(pair.B, pair.X_WB);
  std::vector<double> s;
  for (const Vector2& n : normals(A)) s.push_back(-overlap(pair, n));
  for (const Vector2& n : normals(B)) s.push_back(-overlap(pair, Vector2(-n)));
  std::sort(s.rbegin(), s.rend());
  const double radii = radius(pair.A) + radius(pair.B);
  const bool is_apart = s.empty() || s[0] + radii > 0;
  const double lead = s.size() > 1 ? s[0] - s[1] : 1;
  if (is_apart) return {distance(A, B) - radii, lead};
  return {s[0], lead};
}

double outside(const Flat& flat, const Pose& X, const Vector& p_W) {
  const Vector2 p = p_W.head<2>();
  if (flat.shape.kind == ShapeKind::half_space) return X.R.col(2).dot(p_W - X.x);
  const auto core = corners(flat, X);
  const auto n = normals(core);
  double most = -INFINITY;
  for (std::size_t k = 0; k < n.size(); ++k) most = std::max(most, n[k].dot(p - core[k]));
  if (core.size() > 2 && most <= 0) return most - radius(flat);
  return distance({p}, core) - radius(flat);
}

class FlatRandom {
 public:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }
  double size() { return 0.02 * std::pow(100, uniform(0, 1)); }
  Vector2 point(double size) {
    const double x = uniform(-size, size);
    return {x, uniform(-size, size)};
  }

  Flat flat(FlatKind kind) {
    switch (kind) {
      case FlatKind::disc:
        return {Shape::sphere(size()), nullptr};
      case FlatKind::rectangle:
        return {Shape::box({size(), size(), 1}), nullptr};
      case FlatKind::capsule:
        return {Shape::capsule(size(), size()), nullptr};
      case FlatKind::triangle:
      case FlatKind::quadrangle:
      case FlatKind::many:
        return polygon(kind);
      case FlatKind::half_plane:
        break;
    }
    return {Shape::half_space(), nullptr};
  }

  Pose anywhere(const Flat& flat, const Vector2& p, double angle) {
    return flat.shape.kind == ShapeKind::half_space ? ground_pose(p, angle) : flat_pose(p, angle);
  }

  /// Two shapes that overlap, or nearly touch, along a random direction.
  FlatPair pair(FlatKind kind_A, FlatKind kind_B, double deepest_share = 0.5) {
    FlatPair pair{flat(kind_A), flat(kind_B), {}, {}};
    const double turn = uniform(-4, 4);
    pair.X_WA = anywhere(pair.A, point(2), turn);
    pair.X_WB = anywhere(pair.B, {0, 0}, uniform(-4, 4));
    touch(pair, uniform(-4, 4), deepest_share);
    return pair;
  }

  /// Brings them to a wanted overlap along a direction.
  void touch(FlatPair& pair, double angle, double deepest_share) {
    Vector2 n(std::cos(angle), std::sin(angle));
    if (pair.A.shape.kind == ShapeKind::half_space) n = pair.X_WA.R.col(2).head<2>();
    if (pair.B.shape.kind == ShapeKind::half_space) n = -pair.X_WB.R.col(2).head<2>();
    pair.X_WB.x.head<2>() = pair.X_WA.x.head<2>() + point(0.5);
    const double wanted = below(2) == 0 ? uniform(-0.02, 0.02) : deepest_share * uniform(0, 1);
    pair.X_WB.x.head<2>() += n * (overlap(pair, n) - wanted);
  }

 private:
  /// Corners on an ellipse, in order; again until they make a polygon.
  Flat polygon(FlatKind kind) {
    for (;;) {
      const int n = kind == FlatKind::triangle     ? 3
                    : kind == FlatKind::quadrangle ? 4
                                                   : 5 + below(60);
      std::vector<double> angles;
      for (int k = 0; k < n; ++k) angles.push_back(uniform(0, 2 * std::numbers::pi));
      std::sort(angles.begin(), angles.end());
      const double a = size(), b = size();
      const Vector2 o = point(0.5);
      std::vector<Vec2> p;
      for (const double t : angles) p.push_back({o.x() + a * std::cos(t), o.y() + b * std::sin(t)});
      const MadeGeometry made = make_polygon(p);
      if (!made.geometry) continue;
      if (n == 3) return {Shape::polygon(p[0], p[1], p[2]), nullptr};
      if (n == 4) return {Shape::polygon(p[0], p[1], p[2], p[3]), nullptr};
      return {Shape::stored(ShapeKind::hull, 1), made.geometry};
    }
  }

  std::mt19937_64 engine_{17};
};

template <class Make, class Check>
void for_pairs(Make make, Check check) {
  for (const FlatKind A : kFlatKinds) {
    for (const FlatKind B : kFlatKinds) {
      if (A == FlatKind::half_plane && B == A) continue;
      CAPTURE(A, B);
      int contacts = 0;
      for (int trial = 0; trial < 100'000 && contacts < kFlatContacts; ++trial) {
        CAPTURE(trial);
        const FlatPair pair = make(A, B);
        contacts += check(pair, pair.collide()) ? 1 : 0;
      }
      CHECK(contacts == kFlatContacts);
    }
  }
}

template <class Check>
void for_random_flat_contacts(Check check) {
  FlatRandom random;
  for_pairs([&](FlatKind A, FlatKind B) { return random.pair(A, B); },
            [&](const FlatPair& pair, const Manifold& m) {
              if (m.count > 0) check(pair, m);
              return m.count > 0;
            });
}

/// What even the hardest pose may not break. `tolerance` in m.
void check_right(const FlatPair& pair, const Manifold& m, double tolerance) {
  const Best wanted = best(pair);
  CAPTURE(wanted.separation, wanted.lead, m.count, deepest(m), overlap(pair, m));
  if (std::abs(wanted.separation - kMargin) > tolerance)
    REQUIRE((m.count > 0) == (wanted.separation < kMargin));
  REQUIRE(m.count <= 2);
  if (m.count == 0) return;
  REQUIRE(std::abs(m.normal_W.norm() - 1) < 1e-14);
  REQUIRE(m.normal_W.z() == 0);
  REQUIRE(std::abs(deepest(m) - overlap(pair, m)) < tolerance);
  REQUIRE(std::abs(deepest(m) + wanted.separation) < tolerance);
  REQUIRE(features(m).size() == static_cast<std::size_t>(m.count));
  for (const ContactPoint& p : points(m)) {
    REQUIRE(p.p_W.z() == 0);
    REQUIRE(p.separation <= kMargin);
    const double reach = std::abs(p.separation) / 2 + tolerance;
    REQUIRE(outside(pair.A, pair.X_WA, p.p_W) <= reach);
    REQUIRE(outside(pair.B, pair.X_WB, p.p_W) <= reach);
  }
}

bool is_same_in_plane(const Manifold& a, const Manifold& b, double tolerance, bool by_name) {
  if (a.count != b.count || (a.normal_W - b.normal_W).norm() > tolerance) return false;
  return std::ranges::all_of(points(a), [&](const ContactPoint& p) {
    return std::ranges::any_of(points(b), [&](const ContactPoint& q) {
      return (p.feature == q.feature || !by_name) && (p.p_W - q.p_W).norm() < tolerance &&
             std::abs(p.separation - q.separation) < tolerance;
    });
  });
}

FlatPair pair_moved(const FlatPair& pair, const Vector2& by, double angle) {
  FlatPair other = pair;
  const Matrix R = flat_pose({0, 0}, angle).R;
  for (Pose* X : {&other.X_WA, &other.X_WB}) {
    X->x = R * X->x + Vector(by.x(), by.y(), 0);
    X->R = R * X->R;
  }
  return other;
}

}  // namespace

TEST_CASE("in the plane the depth is the overlap along the normal, and no normal has less") {
  FlatRandom random;
  for_pairs([&](FlatKind A, FlatKind B) { return random.pair(A, B); },
            [&](const FlatPair& pair, const Manifold& m) {
              check_right(pair, m, kExact);
              return m.count > 0;
            });
}

TEST_CASE("in the plane hard poses are as right as any") {
  // Edges flush or crossing at right angles, centres that coincide, corners on corners and edges,
  // and places far from the origin of W, where rounding is that of 1e4 m.
  FlatRandom random;
  constexpr double kStep = std::numbers::pi / 4;
  const auto make = [&](FlatKind A, FlatKind B) {
    FlatPair pair{random.flat(A), random.flat(B), {}, {}};
    const Vector2 at = random.below(2) == 0 ? Vector2(0, 0) : Vector2(1e4, -3e3);
    const double tilt = random.below(2) == 0 ? 0 : random.uniform(-1e-9, 1e-9);
    pair.X_WA = random.anywhere(pair.A, at, kStep * random.below(8));
    pair.X_WB = random.anywhere(pair.B, at, kStep * random.below(8) + tilt);
    if (random.below(4) != 0) random.touch(pair, kStep * random.below(8), 0.1);
    if (random.below(4) == 0) {  // a corner on a corner
      const auto a = corners(pair.A, pair.X_WA), b = corners(pair.B, pair.X_WB);
      if (!a.empty() && !b.empty()) pair.X_WB.x.head<2>() += a.front() - b.back();
    }
    return pair;
  };
  for_pairs(make, [&](const FlatPair& pair, const Manifold& m) {
    check_right(pair, m, 1e-10 + 1e-12 * pair.X_WA.x.norm());
    return m.count > 0;
  });
}

TEST_CASE("in the plane parting two shapes by their depth leaves them touching") {
  for_random_flat_contacts([](FlatPair pair, const Manifold& m) {
    pair.X_WB.x += m.normal_W * overlap(pair, m);
    const Manifold parted = pair.collide();
    REQUIRE(parted.count > 0);
    REQUIRE(std::abs(deepest(parted)) < kExact);
    REQUIRE(std::abs(best(pair).separation) < kExact);
  });
}

TEST_CASE("in the plane the arguments are alike, and so is every place") {
  FlatRandom random;
  int ties = 0, contacts = 0;
  for_random_flat_contacts([&](const FlatPair& pair, const Manifold& m) {
    ++contacts;
    if (best(pair).lead < kExact) return void(++ties);
    Manifold other = pair.swapped().collide();
    other.normal_W = -other.normal_W;
    REQUIRE(is_same_in_plane(m, other, 1e-9, false));
    const double angle = random.uniform(-4, 4);
    const Vector2 by = random.point(100);
    Manifold there = pair_moved(pair, by, angle).collide();
    const Matrix R = flat_pose({0, 0}, -angle).R;
    there.normal_W = R * there.normal_W;
    for (ContactPoint& p : there.points) p.p_W = R * (p.p_W - Vector(by.x(), by.y(), 0));
    REQUIRE(is_same_in_plane(m, there, 1e-9, true));
  });
  CHECK(ties < contacts / 20);
}

TEST_CASE("in the plane a small motion changes little and keeps names, but for rare ties") {
  constexpr double kSmall = 1e-7;  // m and rad
  FlatRandom random;
  int contacts = 0, jumps = 0, renamed = 0;
  for_random_flat_contacts([&](const FlatPair& pair, const Manifold& m) {
    FlatPair next = pair;
    next.X_WB.R = flat_pose({0, 0}, random.uniform(-kSmall, kSmall)).R * pair.X_WB.R;
    next.X_WB.x.head<2>() += random.point(kSmall);
    const Manifold other = next.collide();
    ++contacts;
    const bool jumps_here =
        (other.normal_W - m.normal_W).norm() > 1e-4 || std::abs(deepest(other) - deepest(m)) > 1e-5;
    jumps += jumps_here;
    renamed += !jumps_here && other.count == m.count && features(other) != features(m);
  });
  CAPTURE(contacts);
  CHECK(jumps < contacts / 2000);
  CHECK(renamed < contacts / 2000);
}

TEST_CASE("in the plane a flush stack keeps its names while it sways") {
  // Both are as good a reference in turn.
  FlatRandom random;
  const Flat box{Shape::box({0.5, 0.5, 0.5}), nullptr};
  for (const double aside : {0.0, 0.1, -0.3}) {
    std::set<std::set<std::uint32_t>> seen;
    for (int i = 0; i < 1000; ++i) {
      const FlatPair pair{
          box, box, flat_pose({0, 0}, random.uniform(-5e-4, 5e-4)),
          flat_pose({aside + random.uniform(-1e-4, 1e-4), 0.9999}, random.uniform(-5e-4, 5e-4))};
      const Manifold m = pair.collide();
      REQUIRE(m.count == 2);
      seen.insert(features(m));
    }
    CHECK(seen.size() == 1);
  }
}

TEST_CASE("in the plane what lies on a face rests on two points, what stands on a corner on one") {
  const Flat ground{Shape::half_space(), nullptr};
  const Flat plate{Shape::box({2, 1, 1}), nullptr};
  const Flat capsule{Shape::capsule(0.2, 0.5), nullptr};
  const Flat wedge{Shape::polygon({-0.5, 0}, {0.5, 0}, {0, 1}), nullptr};
  const double up = std::numbers::pi / 2;
  for (const bool on_plate : {false, true}) {
    const Flat& below = on_plate ? plate : ground;
    const Pose X = on_plate ? flat_pose({0, -1}, 0) : ground_pose({0, 0}, up);
    const auto contact = [&](const Flat& upper, double height, double angle) {
      return FlatPair{below, upper, X, flat_pose({0, height}, angle)}.collide();
    };
    CHECK(contact(capsule, 0.2, 0).count == 2);
    CHECK(contact(capsule, 0.7, up).count == 1);
    CHECK(contact(wedge, 0, 0).count == 2);
    CHECK(contact(wedge, 1, 2 * up).count == 1);
    const Manifold m = contact(wedge, 0.001, 0);
    CHECK((m.normal_W - Vector(0, 1, 0)).norm() < 1e-15);
    CHECK(m.points[0].separation == Approx(0.001).epsilon(1e-9));
    CHECK(std::abs(m.points[0].p_W.x() - m.points[1].p_W.x()) == Approx(1).epsilon(1e-12));
  }
}

TEST_CASE("in the plane poses that are not finite touch nothing") {
  FlatRandom random;
  for (const double bad : {std::nan(""), double(INFINITY)}) {
    for (const FlatKind A : kFlatKinds) {
      for (const FlatKind B : kFlatKinds) {
        if (A == FlatKind::half_plane && B == A) continue;
        FlatPair pair = random.pair(A, B);
        pair.X_WB.x.x() = bad;
        CHECK(pair.collide().count == 0);
        if (B == FlatKind::disc) continue;  // alike in every attitude
        pair.X_WB.x.x() = 0;
        pair.X_WB.R(0, 0) = bad;
        pair.X_WB.R(0, 2) = bad;
        CHECK(pair.collide().count == 0);
      }
    }
  }
}

TEST_CASE("what is no convex polygon is refused with a reason") {
  const auto fault = [](std::vector<Vec2> corners) { return make_polygon(corners).fault; };
  CHECK(fault({{0, 0}, {1, 0}, {1, 1}}).empty());
  CHECK(fault({{0, 0}, {1, 0}}) == "needs three corners or more");
  CHECK(fault({{0, 0}, {1, 1}, {1, 0}}) == "is not convex with its corners counter-clockwise");
  CHECK(fault({{0, 0}, {1, 0}, {0.2, 0.2}, {0, 1}}) ==
        "is not convex with its corners counter-clockwise");
  CHECK(fault({{0, 0}, {1, 0}, {2, 0}, {0, 1}}) ==
        "has three corners on one line; leave out the one between the others");
  CHECK(fault({{0, 0}, {1, 0}, {1, 1e-5}, {0, 1}}) == "has an edge that is too short");
  CHECK(fault({{0, 0}, {1, 0}, {0.5, 1e-5}}) == "is too thin");
  CHECK(fault({{0, 0}, {1, 0}, {std::nan(""), 1}}) == "has a corner that is not finite");
  CHECK(fault({{0, 0}, {1e7, 0}, {1, 1}}) == "has a corner too far away");
  std::vector<Vec2> star, round;
  for (int k = 0; k < 5; ++k) {
    const double t = 4 * std::numbers::pi / 5 * k;
    star.push_back({std::cos(t), std::sin(t)});
  }
  CHECK(fault(star) == "is not convex with its corners counter-clockwise");
  for (int k = 0; k < 65; ++k) {
    const double t = 2 * std::numbers::pi / 65 * k;
    round.push_back({std::cos(t), std::sin(t)});
  }
  CHECK(fault(round) == "has too many corners");
  round.clear();
  for (int k = 0; k < 64; ++k) {
    const double t = 2 * std::numbers::pi / 64 * k;
    round.push_back({std::cos(t), std::sin(t)});
  }
  CHECK(fault(round).empty());
}
