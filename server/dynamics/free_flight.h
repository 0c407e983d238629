/// Motion without contact: exact where it can be, and far below the wire's precision elsewhere.
#pragma once

#include "server/collision/geometry.h"

namespace cradle {

/// A body in flight: frame W, about Bcm, except the moments, which are along the axes of B.
struct Flight {
  Vector x = Vector::Zero();          ///< m
  Rotation q = Rotation::Identity();  ///< q_WB
  Vector v = Vector::Zero();          ///< m/s
  Vector w = Vector::Zero();          ///< rad/s, in W
};

/// Moves a body through `dt` (s) with constant acceleration `a_W` (m/s^2) and constant torque
/// `tau_W` (N m). `inertia` holds the principal moments J (kg m^2); zero moments: it turns with
/// constant velocity.
void fly(Flight& body, double dt, const Vector& a_W, const Vector& tau_W, const Vector& inertia);

}  // namespace cradle
