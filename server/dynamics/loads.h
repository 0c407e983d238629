/// What acts on a body over a step, beside contacts: constant loads, drag, and springs to points of
/// the world. Forces are functions of position, attitude and velocity; they do not depend on time
/// within a step.
#pragma once

#include <span>

#include "server/dynamics/free_flight.h"

namespace cradle {

/// Resistance of the medium, which is at rest in W. Zero: none. Not negative.
struct Drag {
  double linear = 0;     ///< kg/s: force -c1 v at Bcm
  double quadratic = 0;  ///< kg/m: force -c2 |v| v at Bcm
  double angular = 0;    ///< kg m^2/s: torque -c3 w
  bool any() const { return linear != 0 || quadratic != 0 || angular != 0; }
  friend bool operator==(const Drag&, const Drag&) = default;
};

/// A spring with damping from a point of the body to a point of the world.
struct Anchor {
  Vector point_B = Vector::Zero();  ///< m, from Bcm
  Vector point_W = Vector::Zero();  ///< m
  double stiffness = 0;             ///< N/m
  double damping = 0;               ///< N s/m, along the spring
  double rest_length = 0;           ///< m
};

/// What one wrench does to a body: a force-like one as (force, torque), an impulse-like one as
/// (impulse, angular impulse), about Bcm. The linear part is in W; the angular one is, too, unless
/// all of it was given in the body's frame.
struct Resultant {
  Vector linear = Vector::Zero();
  Vector angular = Vector::Zero();
  bool is_impulse = false;
  bool angular_in_P = false;  ///< it turns with the body
  // Whence: angular is arm x linear, if there is an arm.
  Vector arm_W = Vector::Zero();  ///< m, from Bcm
  bool arm_turns = false;         ///< with the body
  bool linear_turns = false;      ///< with the body, from tick to tick
};

struct FlightLoads {
  Vector force_W = Vector::Zero();   ///< N, constant over the step; gravity is part of it
  Vector torque_W = Vector::Zero();  ///< N m about Bcm, constant in W
  Vector torque_B = Vector::Zero();  ///< N m about Bcm, turning with the body
  Drag drag;
  std::span<const Anchor> anchors;

  bool depends_on_velocity() const {
    for (const Anchor& anchor : anchors) {
      if (anchor.damping != 0) return true;
    }
    return drag.any();
  }
};

/// Mass, and principal moments about Bcm along the axes of B; zero moments: it turns with constant
/// velocity.
struct Inertia {
  double mass = 1;                  ///< kg
  Vector moments = Vector::Zero();  ///< J, kg m^2
  bool turns() const { return !moments.isZero(0); }
};

struct Resistance {
  Vector force_W;
  Vector torque_W;
};

/// The drag on a body of these velocities (in W).
inline Resistance resistance(const Drag& drag, const Vector& v, const Vector& w) {
  const double speed = drag.quadratic == 0 ? 0 : v.norm();
  return {-(drag.linear + drag.quadratic * speed) * v, -drag.angular * w};
}

}  // namespace cradle
