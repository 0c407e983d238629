/// In which directions the rims of two cylinders may leave each other. Private to this folder.
#pragma once

#include "server/collision/rim.h"

namespace cradle {

/// A rim of each of two cylinders. m; the axes are not parallel.
struct RimPair {
  Vector a, b;  ///< unit, along the axes: out of each cylinder at its rim
  double r_A, r_B;
  Vector d;  ///< from the middle of A's rim to that of B's

  /// `c` leads from A's middle to B's. `of_A` and `of_B` choose the rims: 1 or -1.
  RimPair(const Cylinder& A, const Cylinder& B, const Vector& c, double of_A, double of_B)
      : a(of_A * A.axis),
        b(of_B * B.axis),
        r_A(A.radius),
        r_B(B.radius),
        d(c - A.half_length * a + B.half_length * b) {}

  /// The points where the rims meet if they only touch, on the side of `u`, a unit vector across
  /// both axes: as unit vectors from their middles. False if the rims are not the nearest parts
  /// there, as it seems.
  bool begin(const Vector& u, Vector& p_A, Vector& p_B) const;

  /// The unit normal of both tangents, not yet from A to B; zero if they are parallel.
  Vector normal(const Vector& p_A, const Vector& p_B) const;

  /// From points to those where the rims overlap least, about. False if there are none near.
  bool polish(Vector& p_A, Vector& p_B) const;
};

}  // namespace cradle
