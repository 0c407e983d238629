/// Random pairs of shapes, and what can be said of them without the code under test. The measure is
/// the support function: how far a shape reaches in a direction. It is exact and needs no library.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <set>
#include <span>

#include "server/collision/narrow_phase.h"
#include "server/collision/tolerances.h"

namespace cradle {

/// A shape with the geometry it may need.
struct Solid {
  Shape shape;
  GeometryPointer geometry;

  Solid(const Shape& s) : shape(s) {}  // NOLINT: a shape is a solid
  explicit Solid(GeometryPointer hull)
      : shape(Shape::stored(ShapeKind::hull, 1)), geometry(std::move(hull)) {}

  const ConvexHull& hull() const { return std::get<ConvexHull>(geometry->value); }
};

struct Pair {
  Solid A, B;
  Pose X_WA, X_WB;

  Manifold collide(double margin) const {
    return cradle::collide({A.shape, X_WA, A.geometry.get()}, {B.shape, X_WB, B.geometry.get()},
                           margin);
  }
  Pair swapped() const { return {B, A, X_WB, X_WA}; }
  bool has(ShapeKind kind) const { return A.shape.kind == kind || B.shape.kind == kind; }
  bool is_boxes() const { return A.shape.kind == ShapeKind::box && B.shape.kind == ShapeKind::box; }
};

/// max of d . p over the shape, for a unit vector d; of a half-space only for d along its normal.
inline double support(const Solid& solid, const Pose& X, const Vector& d) {
  const Shape& shape = solid.shape;
  const double middle = d.dot(X.x);
  const Vector d_B = X.R.transpose() * d;
  const double across = std::hypot(d_B.x(), d_B.y());
  const double r = shape.radius_m(), h = shape.half_length_m();
  switch (shape.kind) {
    case ShapeKind::sphere:
      return middle + r;
    case ShapeKind::box:
      return middle + to_eigen(shape.half_extents_m()).dot(d_B.cwiseAbs());
    case ShapeKind::capsule:
      return middle + h * std::abs(d_B.z()) + r;
    case ShapeKind::cylinder:
      return middle + h * std::abs(d_B.z()) + r * across;
    case ShapeKind::cone:
      return middle + std::max(h * d_B.z(), r * across - h * d_B.z());
    case ShapeKind::ellipsoid:
      return middle + to_eigen(shape.half_extents_m()).cwiseProduct(d_B).norm();
    case ShapeKind::hull: {
      double reach = -std::numeric_limits<double>::infinity();
      for (const Vector& v : solid.hull().vertices) reach = std::max(reach, d_B.dot(v));
      return middle + reach;
    }
    default:
      return middle;
  }
}

/// How far A reaches into B along n; negative: apart.
inline double overlap(const Pair& pair, const Vector& n) {
  return support(pair.A, pair.X_WA, n) + support(pair.B, pair.X_WB, -n);
}

/// At most how far a point is outside the shape, m; negative inside.
inline double outside(const Solid& solid, const Pose& X, const Vector& p_W) {
  const Shape& shape = solid.shape;
  const Vector p = X.R.transpose() * (p_W - X.x);
  const double across = std::hypot(p.x(), p.y()), r = shape.radius_m(), h = shape.half_length_m();
  switch (shape.kind) {
    case ShapeKind::sphere:
      return p.norm() - r;
    case ShapeKind::box:
      return (p.cwiseAbs() - to_eigen(shape.half_extents_m())).maxCoeff();
    case ShapeKind::capsule:
      return (p - Vector(0, 0, std::clamp(p.z(), -h, h))).norm() - r;
    case ShapeKind::cylinder:
      return std::max(across - r, std::abs(p.z()) - h);
    case ShapeKind::cone:
      return std::max(-h - p.z(), (2 * h * across + r * (p.z() - h)) / std::hypot(2 * h, r));
    case ShapeKind::ellipsoid: {
      const Vector a = to_eigen(shape.half_extents_m());
      return (p.cwiseQuotient(a).norm() - 1) * a.minCoeff();
    }
    case ShapeKind::hull: {
      const ConvexHull& hull = solid.hull();
      double most = -std::numeric_limits<double>::infinity();
      for (std::size_t f = 0; f < hull.face_count(); ++f) {
        const auto loop = hull.face(f);
        const auto corner = [&](std::size_t k) {
          return hull.vertices[static_cast<std::size_t>(loop[k])];
        };
        const Vector n = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
        most = std::max(most, n.dot(p - corner(0)));
      }
      return most;
    }
    default:
      return p.z();
  }
}

inline std::span<const ContactPoint> points(const Manifold& manifold) {
  return std::span(manifold.points).first(static_cast<std::size_t>(manifold.count));
}

inline double deepest(const Manifold& manifold) {
  double depth = -std::numeric_limits<double>::infinity();
  for (const ContactPoint& point : points(manifold)) depth = std::max(depth, -point.separation);
  return depth;
}

inline std::set<std::uint32_t> features(const Manifold& manifold) {
  std::set<std::uint32_t> set;
  for (const ContactPoint& point : points(manifold)) set.insert(point.feature);
  return set;
}

/// What even the hardest pose may not break.
inline void check_sound(const Pair& pair, const Manifold& manifold, double margin,
                        double tolerance) {
  REQUIRE(manifold.count >= 0);
  REQUIRE(manifold.count <= kManifoldPoints);
  REQUIRE(std::abs(manifold.normal_W.norm() - 1) < 1e-12);
  REQUIRE(features(manifold).size() == static_cast<std::size_t>(manifold.count));
  for (const ContactPoint& point : points(manifold)) {
    REQUIRE(point.separation <= margin);
    const double reach = std::abs(point.separation) +
                         kTolerances.clip_slack_m * !pair.has(ShapeKind::sphere) + tolerance;
    REQUIRE(outside(pair.A, pair.X_WA, point.p_W) <= reach);
    REQUIRE(outside(pair.B, pair.X_WB, point.p_W) <= reach);
  }
  if (manifold.count > 0)
    REQUIRE(deepest(manifold) <= overlap(pair, manifold.normal_W) + tolerance);
}

/// The normals of a polytope's faces, and the directions of its edges, in W.
inline void directions_of(const Solid& solid, const Pose& X, std::vector<Vector>& normals,
                          std::vector<Vector>& edges) {
  if (solid.shape.kind == ShapeKind::box) {
    for (int i = 0; i < 3; ++i) {
      normals.push_back(X.R.col(i));
      edges.push_back(X.R.col(i));
    }
    return;
  }
  const ConvexHull& hull = solid.hull();
  for (std::size_t f = 0; f < hull.face_count(); ++f) {
    const auto loop = hull.face(f);
    const auto corner = [&](std::size_t k) -> const Vector& {
      return hull.vertices[static_cast<std::size_t>(loop[k % loop.size()])];
    };
    for (std::size_t k = 0; k < loop.size(); ++k)
      edges.push_back((X.R * (corner(k + 1) - corner(k))).normalized());
    normals.push_back(X.R * (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized());
  }
}

/// Least overlap of two boxes or hulls over all axes that can separate them; if they are apart,
/// minus the largest gap.
inline double least_overlap_of_polytopes(const Pair& pair) {
  double least = std::numeric_limits<double>::infinity();
  const auto try_axis = [&](const Vector& axis) {
    if (axis.norm() < 1e-9) return;  // of parallel edges
    const Vector n = axis.normalized();
    least = std::min({least, overlap(pair, n), overlap(pair, -n)});
  };
  std::vector<Vector> normals, edges_A, edges_B;
  directions_of(pair.A, pair.X_WA, normals, edges_A);
  directions_of(pair.B, pair.X_WB, normals, edges_B);
  for (const Vector& n : normals) try_axis(n);
  for (const Vector& a : edges_A) {
    for (const Vector& b : edges_B) try_axis(a.cross(b));
  }
  return least;
}

class Random {
 public:
  explicit Random(std::uint64_t seed = 11) : engine_(seed) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  Vector vector(double size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }
  Vector direction() {
    Vector d;
    do d = vector(1);
    while (d.norm() > 1 || d.norm() < 0.1);
    return d.normalized();
  }
  Matrix rotation() {
    Rotation q;
    do q = Rotation(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    while (q.norm() > 1 || q.norm() < 0.1);
    return q.normalized().toRotationMatrix();
  }
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
        std::vector<Vector> spanned;
        const int count = 4 + k % 10 * k % 39;
        for (int i = 0; i < count; ++i) {
          const Vector p = k % 2 == 0 ? direction() : vector(1);
          spanned.push_back(half.cwiseProduct(p));
        }
        hulls_.push_back(make_hull(spanned).geometry);
        REQUIRE(hulls_.back());
      }
    }
    return hulls_[static_cast<std::size_t>(uniform(0, 39.999))];
  }

  std::mt19937_64 engine_;
  std::vector<GeometryPointer> hulls_;
};

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
