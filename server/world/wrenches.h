/// The wrenches that act on the bodies, until their tick ends or they are cleared.
#pragma once

#include <span>
#include <vector>

#include "server/world/body_table.h"

namespace cradle {

inline constexpr Tick kUntilCleared = -1;

struct ActiveWrench {
  Wrench wrench;
  Tick ticks_left = 1;  ///< kUntilCleared: no end
};

/// What acts on the bodies in one tick, by slot.
struct Loads {
  std::vector<Vector> acceleration;  ///< m/s^2, in W, of Bcm
  std::vector<Vector> torque;        ///< N m, in W, about Bcm
};

/// The effect of one wrench on the body in slot `i` now: a force-like one as (force, torque), an
/// impulse-like one as (impulse, angular impulse), in W about Bcm.
struct Resultant {
  Vector linear = Vector::Zero();
  Vector angular = Vector::Zero();
  bool is_impulse = false;
};
Resultant resultant(const Wrench& wrench, const BodyTable& bodies, std::size_t i);

/// Applies this tick's impulses to the velocities and gathers its forces, gravity included, into
/// `loads`; counts the ticks down and drops what has ended. `wrenches` are in order of arrival.
void begin_tick(std::vector<ActiveWrench>& wrenches, const Vector& gravity_W, BodyTable& bodies,
                Loads& loads);

}  // namespace cradle
