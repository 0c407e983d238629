/// Poses as tests write them.
#pragma once

#include "server/collision/geometry.h"

namespace cradle {

inline Matrix turn(double angle, const Vector& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

/// A turn of one direction to another: the shortest, unless they are nearly opposite. (Eigen's own
/// takes a singular value decomposition for these: seconds of compilation, wherever it is used.)
inline Rotation turn_onto(const Vector& from, const Vector& to) {
  const double lengths = from.norm() * to.norm(), beside = lengths + from.dot(to);
  if (beside < 1e-3 * lengths) {
    const Vector across = from.unitOrthogonal();
    return turn_onto(-from, to) * Rotation(0, across.x(), across.y(), across.z());
  }
  const Vector axis = from.cross(to);
  return Rotation(beside, axis.x(), axis.y(), axis.z()).normalized();
}

inline Pose at(double x, double y, double z, const Matrix& R = Matrix::Identity()) {
  return {{x, y, z}, R};
}

}  // namespace cradle
