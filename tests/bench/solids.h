/// Pairs of shapes, and what geometry says of them without the code under test. The measure is the
/// support function: how far a shape reaches in a direction. It is exact and needs no library.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "server/collision/narrow_phase.h"

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

/// The point of the shape, in its frame, that is farthest along the unit vector `d`; of a
/// half-space the origin, which is right for d along its normal alone.
inline Vector support_point(const Solid& solid, const Vector& d) {
  const Shape& shape = solid.shape;
  const double r = shape.radius_m(), h = shape.half_length_m();
  const auto rim = [&](double z) {
    const double across = std::hypot(d.x(), d.y());
    if (across == 0) return Vector(0, 0, z);
    return Vector(r * d.x() / across, r * d.y() / across, z);
  };
  switch (shape.kind) {
    case ShapeKind::sphere:
      return r * d;
    case ShapeKind::box:
      return to_eigen(shape.half_extents_m())
          .cwiseProduct((d.array() < 0).select(Vector::Constant(-1), Vector::Ones()));
    case ShapeKind::capsule:
      return r * d + Vector(0, 0, std::copysign(h, d.z()));
    case ShapeKind::cylinder:
      return rim(std::copysign(h, d.z()));
    case ShapeKind::cone:
      return h * d.z() > r * std::hypot(d.x(), d.y()) - h * d.z() ? Vector(0, 0, h) : rim(-h);
    case ShapeKind::ellipsoid: {
      const Vector a = to_eigen(shape.half_extents_m());
      const Vector stretched = a.cwiseProduct(d);
      return a.cwiseProduct(stretched) / stretched.norm();
    }
    case ShapeKind::hull:
      return *std::ranges::max_element(solid.hull().vertices, {},
                                       [&](const Vector& v) { return d.dot(v); });
    default:
      return Vector::Zero();
  }
}

/// max of d . p over the shape, for a unit vector d; of a half-space only for d along its normal.
inline double support(const Solid& solid, const Pose& X, const Vector& d) {
  const Vector d_B = X.R.transpose() * d;
  return d.dot(X.x) + d_B.dot(support_point(solid, d_B));
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
        Vector area = Vector::Zero();  // the first three corners may lie on one line
        for (std::size_t k = 2; k < loop.size(); ++k) {
          area += (corner(k - 1) - corner(0)).cross(corner(k) - corner(0));
        }
        most = std::max(most, area.normalized().dot(p - corner(0)));
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

/// An edge of a polytope, in W: its direction, and the normals of the two faces that meet there.
struct PolytopeEdge {
  Vector along, n, m;
};

/// The faces' normals and the edges of a box or hull, in W.
struct Polytope {
  std::vector<Vector> normals;
  std::vector<PolytopeEdge> edges;

  Polytope(const Solid& solid, const Pose& X) {
    solid.shape.kind == ShapeKind::box ? add_box(X) : add_hull(solid.hull(), X);
  }

 private:
  void add_box(const Pose& X) {
    for (int i = 0; i < 3; ++i) {
      normals.push_back(X.R.col(i));
      normals.push_back(-X.R.col(i));
      for (const double k : {1.0, -1.0}) {
        for (const double l : {1.0, -1.0}) {
          edges.push_back({X.R.col(i), k * X.R.col((i + 1) % 3), l * X.R.col((i + 2) % 3)});
        }
      }
    }
  }
  void add_hull(const ConvexHull& hull, const Pose& X) {
    std::map<std::pair<std::int32_t, std::int32_t>, Vector> first_side;
    for (std::size_t f = 0; f < hull.face_count(); ++f) {
      const auto loop = hull.face(f);
      const auto corner = [&](std::size_t k) -> const Vector& {
        return hull.vertices[static_cast<std::size_t>(loop[k % loop.size()])];
      };
      const Vector n = X.R * (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
      normals.push_back(n);
      for (std::size_t k = 0; k < loop.size(); ++k) {
        const auto ends = std::minmax(loop[k], loop[(k + 1) % loop.size()]);
        const auto [other, is_first] = first_side.emplace(ends, n);
        if (is_first) continue;
        edges.push_back({X.R * (corner(k + 1) - corner(k)).normalized(), n, other->second});
      }
    }
  }
};

/// Whether a face of the set of all a - b comes of these two edges: their arcs cross on the sphere
/// of normals (Gregorius, GDC 2013). In doubt true.
inline bool can_part(const PolytopeEdge& a, const PolytopeEdge& b) {
  constexpr double kDoubt = 1e-12;
  const Vector across_a = a.n.cross(a.m), across_b = b.n.cross(b.m);
  const double b_n = -b.n.dot(across_a), b_m = -b.m.dot(across_a);
  const double a_n = a.n.dot(across_b), a_m = a.m.dot(across_b);
  return b_n * b_m < kDoubt && a_n * a_m < kDoubt && b_n * a_m > -kDoubt;
}

/// A way to part two shapes.
struct Parting {
  Vector n = Vector::UnitZ();                                ///< unit, from A to B
  double overlap = std::numeric_limits<double>::infinity();  ///< m, along n; negative: apart
};

/// Of all axes that can separate two boxes or hulls, that of the least overlap; if they are apart,
/// of the largest gap.
inline Parting best_axis_of_polytopes(const Pair& pair) {
  Parting best;
  const auto try_axis = [&](const Vector& n) {
    const double m = overlap(pair, n);
    if (m < best.overlap) best = {n, m};
  };
  const Polytope A(pair.A, pair.X_WA), B(pair.B, pair.X_WB);
  const auto try_edges = [&](bool all) {
    for (const PolytopeEdge& a : A.edges) {
      for (const PolytopeEdge& b : B.edges) {
        if (!all && !can_part(a, b)) continue;
        const Vector axis = a.along.cross(b.along);
        if (axis.norm() < 1e-9) continue;  // of parallel edges
        try_axis(axis.normalized());
        try_axis(-axis.normalized());
      }
    }
  };
  for (const Vector& n : A.normals) try_axis(n);
  for (const Vector& n : B.normals) try_axis(-n);
  try_edges(false);
  if (best.overlap < 0) try_edges(true);
  return best;
}

inline double least_overlap_of_polytopes(const Pair& pair) {
  return best_axis_of_polytopes(pair).overlap;
}

}  // namespace cradle
