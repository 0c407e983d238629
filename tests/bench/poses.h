/// Poses as tests write them.
#pragma once

#include "server/collision/geometry.h"

namespace cradle {

inline Matrix turn(double angle, const Vector& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

inline Pose at(double x, double y, double z, const Matrix& R = Matrix::Identity()) {
  return {{x, y, z}, R};
}

}  // namespace cradle
