/// The gyroscopic term for bodies that are sub-stepped: stable under impulses, first order.
///
/// Implicit Euler for J (w1 - w0) + h w1 x J w1 = 0 in the body frame, one Newton step from w0
/// (Catto 2015, "Physics for Game Programmers: Numerical Methods", GDC): the Jacobian is
/// J + h ([w] J - [J w]). It damps; free flight does not use it.
#pragma once

#include "server/collision/geometry.h"

namespace cradle {

inline Matrix cross_matrix(const Vector& a) {
  Matrix m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// w (rad/s, in B) after `h` (s) without torque; J are the principal moments.
inline Vector gyroscopic_step(const Vector& w_B, const Vector& J, double h) {
  const Vector Jw = J.cwiseProduct(w_B);
  const Vector residual = h * w_B.cross(Jw);
  Matrix jacobian = h * (cross_matrix(w_B) * J.asDiagonal().toDenseMatrix() - cross_matrix(Jw));
  jacobian.diagonal() += J;
  return w_B - jacobian.inverse() * residual;
}

}  // namespace cradle
