/// In which directions the rim of a cylinder may leave an edge, or another rim. Private to this
/// folder.
///
/// Lengths in m. Directions are tried by calling `attempt(n)` with unit vectors.
#pragma once

#include <algorithm>
#include <cmath>

#include "server/collision/geometry.h"

namespace cradle {

struct Cylinder {
  Vector axis;  ///< unit
  double radius, half_length;
};

/// The quarter of an ellipse about the origin with the half axes `r` along x and `b` <= r along y,
/// x and y not negative, beside a point with x >= 0. The unit normal where a circle about the point
/// touches the quarter from inside; false: nowhere.
bool nearest_on_quarter(double r, double b, double x, double y, Vector2& n);

/// Whether an overlap below `most` is possible at the quarter.
inline bool may_be_below(double most, double r, double b, double x, double y) {
  if (y < 0) return -y < most || r - x < most;
  const double below_chord = r * b - b * x - r * y;  // times its length
  if (below_chord <= 0) return true;
  return most > 0 && below_chord * below_chord < most * most * (r * r + b * b);
}

/// A cylinder seen along an edge: its rims are ellipses, with half axes r along u and b along w.
struct SeenAlong {
  Vector u, w;      ///< unit, across the edge
  double r, b, up;  ///< the ellipses are `up` from the middle along w
  bool is_round;    ///< the edge is along the axis: no ellipse

  /// Across an edge the ellipses would be lines, whose ends have no normals.
  static constexpr double kFlattest = 1e-12;

  SeenAlong(const Cylinder& cylinder, const Vector& edge) : r(cylinder.radius) {
    const double along = edge.dot(cylinder.axis);
    const Vector across = cylinder.axis.cross(edge);
    const double sine2 = across.squaredNorm();
    is_round = !(sine2 > 1e-30);
    if (is_round) return;
    const double sine = std::sqrt(sine2);
    u = across / sine;
    w = edge.cross(u);
    b = r * std::max(std::abs(along), kFlattest);
    up = cylinder.half_length * sine;
  }

  /// How h rises at the normal (nx, ny) of an ellipse beside the point (x, y), as the normal turns
  /// from u to w.
  double slope(double nx, double ny, double x, double y) const {
    const double reach = std::sqrt(r * r * nx * nx + b * b * ny * ny);
    return x * ny - y * nx - (r * r - b * b) * nx * ny / reach;
  }
};

/// The rims of a cylinder at an edge that is otherwise free, where `c` leads from one middle to the
/// other. Nothing where no overlap is below `most`, m.
template <typename Attempt>
void try_rim_at_line(const SeenAlong& seen, const Vector& c, double most, Attempt&& attempt) {
  if (seen.is_round) return;
  const double x = seen.u.dot(c), y = seen.w.dot(c);
  const double X = std::abs(x), Y = std::abs(y) - seen.up;
  if (!may_be_below(most, seen.r, seen.b, X, Y)) return;
  Vector2 n;
  if (!nearest_on_quarter(seen.r, seen.b, X, Y, n)) return;
  attempt(Vector(std::copysign(n.x(), x) * seen.u + std::copysign(n.y(), y) * seen.w));
}

/// The rims of a cylinder at the edges of a box about the origin that are along its axis `axis`.
template <typename Attempt>
void try_rim_at_box(const Cylinder& cylinder, const Vector& half_extents, int axis, const Vector& c,
                    double most, Attempt&& attempt) {
  const SeenAlong seen(cylinder, Vector::Unit(axis));
  if (seen.is_round) return;
  const int j = (axis + 1) % 3, k = (axis + 2) % 3;
  const double cx = seen.u.dot(c), cy = seen.w.dot(c);
  for (const double sx : {1.0, -1.0}) {
    for (const double sy : {1.0, -1.0}) {
      if (sx * cx < 0 && sy * cy < 0) continue;  // leads to the wrong side
      // In this quarter, one axis of the box looks along p, x and y not negative, the other across.
      double px = sx * seen.u[j], py = sy * seen.w[j], hp = half_extents[j], hq = half_extents[k];
      if (px * py < 0) {
        px = sx * seen.u[k], py = sy * seen.w[k];
        std::swap(hp, hq);
      }
      px = std::abs(px), py = std::abs(py);
      for (const double side : {1.0, -1.0}) {
        const double X = sx * cx - hp * px - side * hq * py;
        if (!(X >= 0)) continue;
        const double Y = sy * cy - seen.up - hp * py + side * hq * px;
        if (!may_be_below(most, seen.r, seen.b, X, Y)) continue;
        // The corner counts on its side of p only.
        const double beyond_p = seen.slope(px, py, X, Y);
        if (side > 0 ? beyond_p < 0 : beyond_p > 0 && Y >= 0) continue;
        Vector2 n;
        if (!nearest_on_quarter(seen.r, seen.b, X, Y, n)) continue;
        attempt(Vector(sx * n.x() * seen.u + sy * n.y() * seen.w));
      }
    }
  }
}

}  // namespace cradle
