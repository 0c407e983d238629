/// Random pairs of shapes, and what must hold for any manifold of theirs.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <span>

#include "server/collision/narrow_phase.h"
#include "server/collision/tolerances.h"
#include "tests/bench/parting.h"
#include "tests/bench/random_poses.h"
#include "tests/bench/solids.h"
#include "tests/unit/collision_support.h"

namespace cradle {

inline std::set<std::uint32_t> features(const Manifold& manifold) {
  std::set<std::uint32_t> set;
  for (const ContactPoint& point : points(manifold)) set.insert(point.feature);
  return set;
}

/// What even the hardest pose may not break. Points lie in both shapes grown by their separation;
/// further points of features that are all but flush may be off by `slack`, m.
inline void check_sound(const Pair& pair, const Manifold& manifold, double margin, double tolerance,
                        double slack = 0) {
  REQUIRE(manifold.count >= 0);
  REQUIRE(manifold.count <= kManifoldPoints);
  REQUIRE(std::abs(manifold.normal_W.norm() - 1) < 1e-12);
  REQUIRE(features(manifold).size() == static_cast<std::size_t>(manifold.count));
  for (const ContactPoint& point : points(manifold)) {
    REQUIRE(point.separation <= margin);
    const double reach = std::abs(point.separation) + slack + tolerance;
    REQUIRE(outside(pair.A, pair.X_WA, point.p_W) <= reach);
    REQUIRE(outside(pair.B, pair.X_WB, point.p_W) <= reach);
  }
  if (manifold.count > 0)
    REQUIRE(deepest(manifold) <= overlap(pair, manifold.normal_W) + tolerance);
}

inline bool is_polytope(const Solid& solid) {
  return solid.shape.kind == ShapeKind::box || solid.shape.kind == ShapeKind::hull;
}

class Random : public RandomPoses {
 public:
  explicit Random(std::uint64_t seed = 11) : RandomPoses(seed) {}

  /// Sizes from 0.02 to 2 m, so boxes are cubes, plates and rods.
  double size() { return 0.02 * std::pow(100, uniform(0, 1)); }

  Solid solid(ShapeKind kind) {
    switch (kind) {
      case ShapeKind::sphere:
        return Shape::sphere(size());
      case ShapeKind::box:
        return Shape::box({size(), size(), size()});
      case ShapeKind::capsule:
        return Shape::capsule(size(), size());
      case ShapeKind::cylinder:
        return Shape::cylinder(size(), size());
      case ShapeKind::cone:
        return Shape::cone(size(), size());
      case ShapeKind::ellipsoid:
        return Shape::ellipsoid({size(), size(), size()});
      case ShapeKind::hull:
        return Solid(hull());
      default:
        return Shape::half_space();
    }
  }

  /// Two shapes in a random pose that overlap, or nearly touch, along a random direction.
  Pair pair(ShapeKind kind_A, ShapeKind kind_B, double deepest_share = 0.5) {
    Pair pair{solid(kind_A), solid(kind_B), {vector(2), rotation()}, {{0, 0, 0}, rotation()}};
    const Vector n = kind_B == ShapeKind::half_space   ? Vector(-pair.X_WB.R.col(2))
                     : kind_A == ShapeKind::half_space ? Vector(pair.X_WA.R.col(2))
                                                       : direction();
    const double thickness = overlap({pair.A, pair.B, {}, {}}, Vector::UnitZ());
    pair.X_WB.x = pair.X_WA.x + vector(0.2 * thickness);
    const double wanted =
        uniform(0, 1) < 0.5 ? uniform(0, 0.02) : uniform(0, deepest_share) * thickness;
    pair.X_WB.x += n * (overlap(pair, n) - wanted);
    return pair;
  }

 private:
  /// One of forty, so that Qhull does not take the time: of points on an ellipsoid, or in a box.
  GeometryPointer hull() {
    if (hulls_.empty()) {
      for (int k = 0; k < 40; ++k) {
        const Vector half(size(), size(), size());
        const int count = 4 + k % 10 * k % 39;
        do {  // four points may be nearly in a plane
          std::vector<Vector> spanned;
          for (int i = 0; i < count; ++i) {
            const Vector p = k % 2 == 0 ? direction() : vector(1);
            spanned.push_back(half.cwiseProduct(p));
          }
          hulls_.resize(static_cast<std::size_t>(k));
          hulls_.push_back(make_hull(spanned).geometry);
        } while (!hulls_.back());
      }
    }
    return hulls_[static_cast<std::size_t>(uniform(0, 39.999))];
  }

  std::vector<GeometryPointer> hulls_;
};

/// Boxes that lean to each other by up to `tilt`, rad, and lie over each other's edges; they
/// overlap by `depth`, m (negative: they are apart).
inline Pair nearly_flush_boxes(Random& random, double tilt, double depth) {
  const auto box = [&] { return Shape::box({random.size(), random.size(), random.size()}); };
  Pair pair{box(), box(), {random.vector(1), random.rotation()}, {}};
  const Vec3 a = pair.A.shape.half_extents_m(), b = pair.B.shape.half_extents_m();
  const double yaw =
      random.uniform(0, 1) < 0.3 ? random.uniform(-0.01, 0.01) : random.uniform(0, 7);
  const Vector axis = random.direction().cwiseProduct(Vector(1, 1, 0.1)).normalized();
  pair.X_WB.R = pair.X_WA.R * Eigen::AngleAxisd(tilt * random.uniform(0, 1), axis) *
                Eigen::AngleAxisd(yaw, Vector::UnitZ());
  const double x = random.uniform(-1, 1) * (a.x + 0.7 * b.x),
               y = random.uniform(-1, 1) * (a.y + 0.7 * b.y);
  pair.X_WB.x = pair.X_WA.x + pair.X_WA.R * Vector(x, y, a.z + b.z);
  const Parting best = bench::parting(pair);
  pair.X_WB.x += best.n * (best.overlap - depth);
  return pair;
}

/// All kinds that collide, and two half-spaces do not.
inline std::vector<std::pair<ShapeKind, ShapeKind>> colliding_kinds() {
  std::vector<std::pair<ShapeKind, ShapeKind>> kinds;
  for (int a = 1; a <= static_cast<int>(ShapeKind::hull); ++a) {
    for (int b = 1; b <= static_cast<int>(ShapeKind::hull); ++b) {
      const auto A = static_cast<ShapeKind>(a), B = static_cast<ShapeKind>(b);
      if (A == ShapeKind::half_space && B == A) continue;
      kinds.emplace_back(A, B);
    }
  }
  return kinds;
}

/// Sphere, box and half-space: the pairs whose closed forms are exact to rounding.
inline bool is_elementary(const Pair& pair) {
  return pair.A.shape.kind <= ShapeKind::half_space && pair.B.shape.kind <= ShapeKind::half_space;
}

}  // namespace cradle
