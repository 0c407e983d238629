/// The gyroscopic term of bodies that are sub-stepped: torque-free turning of w in the body frame.
#pragma once

#include "server/collision/geometry.h"

namespace cradle {

/// cross_matrix(a) b = a x b.
inline Matrix cross_matrix(const Vector& a) {
  Matrix m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// Such a body pays for no gyroscopic term: w stays as it is.
inline bool has_equal_moments(const Vector& J) { return J.x() == J.y() && J.y() == J.z(); }

/// w (rad/s, in B) after `h` (s) without torque; J are the principal moments, all of them positive.
/// Keeps energy and the size of the angular momentum, at any h |w|; w that is not finite stays.
Vector gyroscopic_step(const Vector& w_B, const Vector& J, double h);

}  // namespace cradle
