/// Rotations of moments of inertia; rotation vectors come along.
#pragma once

#include "server/collision/turn.h"

namespace cradle {

/// J in W from the principal moments in B (or their inverses).
inline Matrix rotated_diagonal(const Matrix& R_WB, const Vector& diagonal) {
  if (diagonal.x() == diagonal.y() && diagonal.y() == diagonal.z())
    return diagonal.x() * Matrix::Identity();
  return R_WB * diagonal.asDiagonal() * R_WB.transpose();
}

}  // namespace cradle
