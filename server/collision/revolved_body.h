/// Cylinders and cones as bodies of revolution anywhere in space. Private to this folder.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "server/collision/convex_shape.h"
#include "server/collision/edge_arc.h"

namespace cradle {

inline constexpr double kLevel_m = 1e-9;  ///< ends of a line whose heights differ by less are one

/// A cylinder or cone, with the normals of its side.
struct RevolvedBody : Revolved {
  double length;   ///< m, of the side, from rim to rim
  double out, up;  ///< of the unit normal: out from the axis, along it
  double reach;    ///< m, of the side from the middle along its normal

  RevolvedBody(const ConvexShape& shape, const Vector& its_axis, const Vector& its_middle)
      : Revolved{its_axis, its_middle, shape.size.x(),
                 shape.kind == ShapeKind::cone ? 0 : shape.size.x(), shape.size.y()} {
    const double height = 2 * half_length, narrows = lower - upper;
    length = std::sqrt(height * height + narrows * narrows);
    out = height / length;
    up = narrows / length;
    reach = out * lower - up * half_length;
  }

  /// How far it reaches from its middle along a unit vector.
  double reach_along(double along, double across) const {
    return std::max(lower * across - half_length * along, upper * across + half_length * along);
  }
  double reach_along(const Vector& n) const {
    return reach_along(n.dot(axis), n.cross(axis).norm());
  }
  /// The point of a rim that is farthest along it; some point in the rim where all are.
  Vector on_rim(const Vector& n, bool of_upper) const {
    const Vector across = (n - n.dot(axis) * axis).normalized();
    // Twice: of an n along the axis the first leaves rounding.
    const Vector out_of_axis = across - across.dot(axis) * axis;
    return middle_of(of_upper) + radius(of_upper) * out_of_axis;
  }
  Vector farthest(const Vector& n) const {
    return on_rim(n, is_upper(-n.dot(axis), n.cross(axis).norm()));
  }
  /// The point nearest to p.
  Vector nearest(const Vector& p) const {
    const Vector d = p - middle;
    const double z = d.dot(axis);
    const Vector across = d - z * axis;
    const double from_axis = across.norm();
    const auto at = [&](double r, double height) {
      return Vector(middle + (from_axis > 0 ? r / from_axis : 0) * across + height * axis);
    };
    if (z <= -half_length && from_axis <= lower) return at(from_axis, -half_length);
    if (z >= half_length && from_axis <= upper) return at(from_axis, half_length);
    const double x = from_axis - lower, y = z + half_length;
    if (y >= 0 && !(out * x + up * y > 0)) return p;
    const double on = std::clamp(out * y - up * x, 0.0, length);
    return at(lower - up * on, out * on - half_length);
  }
};

/// Lower bounds of the overlap along the normals of each part of a body, m: what a ball inside the
/// other reaches behind it.
struct PartBounds {
  double side;
  std::array<double, 2> rims;  ///< lower, and upper or tip

  /// Of a ball about `c`.
  PartBounds(const RevolvedBody& body, const Vector& c, double radius) {
    const Vector d = c - body.middle;
    const double z = d.dot(body.axis), from_axis = (d - z * body.axis).norm();
    side = radius + body.reach - body.out * from_axis - body.up * z;
    rims[0] = std::min(side, radius + body.half_length + z);
    rims[1] = std::min(side, radius + body.half_length - z);
    for (const bool of_upper : {false, true}) {
      const double sign = of_upper ? 1 : -1;
      const double x = from_axis - body.radius(of_upper), y = z - sign * body.half_length;
      if (x > 0 && sign * (body.out * y - body.up * x) > 0) {
        rims[of_upper] = radius - std::sqrt(x * x + y * y);
      }
    }
  }
};

}  // namespace cradle
