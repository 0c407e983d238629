// A core with corners and one triangle, by the quick way, against the search for any two shapes;
// and how far a body is from a surface at least.
#include "server/collision/convex_pair.h"
#include "server/collision/manifolds.h"
#include "server/collision/surface.h"
#include "server/collision/triangle_overlap.h"
#include "tests/physics/terrains.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/collision_support.h"

using namespace cradle;

namespace {

std::array<Vector, 3> random_triangle(Random& random, double size) {
  return {random.vector(size), random.vector(size), random.vector(size)};
}

SurfaceTriangle in_surface(const std::array<Vector, 3>& corners) {
  SurfaceTriangle t;
  t.corners = corners;
  t.normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  return t;
}

/// m, of the core of A and a triangle along n.
double overlap_along(const ConvexShape& A, const std::array<Vector, 3>& p, const Vector& n) {
  std::int32_t hint = 0;
  return n.dot(A.support(n, hint)) - std::min({n.dot(p[0]), n.dot(p[1]), n.dot(p[2])});
}

}  // namespace

TEST_CASE("a triangle is as far from a core with corners as the search for any two shapes says") {
  constexpr double kLimit = 0.3;
  Random random(71);
  int apart = 0, overlapping = 0, beyond = 0, left = 0;
  for (const ShapeKind kind : {ShapeKind::capsule, ShapeKind::box, ShapeKind::hull}) {
    for (int trial = 0; trial < 6000; ++trial) {
      CAPTURE(word_of(kind), trial);
      const Solid solid = random.solid(kind);
      const Pose in_A;
      const ConvexShape A(Collider{solid.shape, in_A, solid.geometry.get()});
      std::array<Vector, 3> p = random_triangle(random, random.uniform(0.1, 1.5));
      const Vector away = random.vector(0.7);
      for (Vector& corner : p) corner += away;
      if (trial % 10 == 0) p[2] = p[0] + 1e-3 * (p[1] - p[0]) + random.vector(1e-4);  // a sliver
      const auto quick = triangle_overlap(A, p, kLimit);
      const SurfaceTriangle t = in_surface(p);
      const ConvexShape flat(t);
      SupportHints hints;
      const ConvexPair pair(A, in_A, flat, in_A);
      const LeastOverlap exact = least_overlap(pair, kInfinity, hints);
      left += !quick;
      if (!quick) continue;
      if (!quick->is_within_limit) {
        ++beyond;
        REQUIRE(-exact.overlap > kLimit - 1e-9);
        REQUIRE(-quick->overlap < -exact.overlap + 1e-9);
        continue;
      }
      REQUIRE(quick->n.norm() == Approx(1).margin(1e-12));
      REQUIRE(overlap_along(A, p, quick->n) == Approx(quick->overlap).margin(1e-12));
      REQUIRE(quick->overlap < exact.overlap + 1e-9);
      for (int k = 0; k < 20; ++k) {
        REQUIRE(quick->overlap < overlap_along(A, p, random.direction()) + 1e-9);
      }
      // The point is A's farthest.
      const Vector& a = quick->p_A;
      REQUIRE(overlap_along(A, {a, a, a}, quick->n) == Approx(0).margin(1e-9));
      ++(quick->overlap < 0 ? apart : overlapping);
    }
  }
  CAPTURE(apart, overlapping, beyond, left);
  CHECK(apart > 2000);
  CHECK(overlapping > 2000);
  CHECK(beyond > 2000);
  CHECK(left * 50 < apart + overlapping + beyond);  // segments through triangles, mostly
}

TEST_CASE("a body that touches no surface is as far from it as it is said to be") {
  Random random(72);
  int far = 0;
  const auto hills = [](double x, double y) { return 0.3 * std::sin(1.7 * x) * std::cos(2.1 * y); };
  std::vector<double> heights;
  for (int i = 0; i < 17 * 17; ++i) heights.push_back(hills(0.25 * (i % 17), 0.25 * (i / 17)));
  for (const GeometryPointer& ground : {mesh_of(terrain(16, 0.25, 0.3, hills)).geometry,
                                        make_height_field(17, 17, 0.25, 0.25, heights).geometry}) {
    Solid surface(ground);
    surface.shape = Shape::stored(ground->kind(), 1);
    for (const ShapeKind kind : {ShapeKind::sphere, ShapeKind::box, ShapeKind::cone}) {
      for (int trial = 0; trial < 3000; ++trial) {
        CAPTURE(word_of(kind), trial);
        const Solid body = random.solid(kind);
        const Pose X_WS{random.vector(3), random.rotation()};
        const Pose X_SC{random.vector(4), random.rotation()};
        const auto found_at = [&](const Pose& X) {
          const Pose X_WC{X_WS.x + X_WS.R * X.x, X_WS.R * X.R};
          const Collider S{surface.shape, X_WS, surface.geometry.get()};
          const Collider C{body.shape, X_WC, body.geometry.get()};
          std::vector<Manifold> manifolds;
          add_manifolds(S, C, kMargin, manifolds);
          return std::pair(manifolds.size(), manifolds.empty() ? least_distance(C, S, kMargin) : 0);
        };
        const auto [count, distance] = found_at(X_SC);
        if (count > 0 || distance <= kMargin) continue;
        ++far;
        for (int k = 0; k < 4; ++k) {
          const double way = 0.999 * (distance - kMargin);
          const Pose moved{X_SC.x + way * random.direction(), X_SC.R};
          REQUIRE(found_at(moved).first == 0);
        }
      }
    }
  }
  CHECK(far > 3000);
}
