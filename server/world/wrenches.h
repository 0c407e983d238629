/// The wrenches that act on the bodies, until their tick ends or they are cleared.
#pragma once

#include <span>
#include <vector>

#include "server/dynamics/loads.h"
#include "server/world/body_table.h"

namespace cradle {

inline constexpr Tick kUntilCleared = -1;

struct ActiveWrench {
  Wrench wrench;
  Tick ticks_left = 1;  ///< kUntilCleared: no end
};

/// What moves the bodies in one tick, and what acts on them, by slot. The vectors are kept up for
/// those that are driven, pushed or touch; what merely falls has no entry of its own.
struct Loads {
  std::vector<Course> course;
  std::vector<Vector> acceleration;  ///< m/s^2, in W, of Bcm: gravity and forces
  std::vector<Vector> torque_W;      ///< N m, about Bcm: the part that is constant in W
  std::vector<Vector> torque_P;      ///< N m, in P: the part that turns with the body
  std::vector<std::int32_t> pushed;  ///< slots that a wrench acts on, ascending
  double impulses_J = 0;             ///< what impulses that were applied did to kinetic energy
  bool keeps_resultants = false;
  struct OfBody {
    std::int32_t slot;
    Resultant resultant;
  };
  std::vector<OfBody> resultants;  ///< of this tick, if kept, in the order of the wrenches

  /// Gravity and nothing else.
  void set_to_gravity(std::size_t i, const Vector& gravity_W) {
    acceleration[i] = gravity_W;
    torque_W[i] = torque_P[i] = Vector::Zero();
  }
};

/// The effect of one wrench on the body in slot `i` now.
Resultant resultant(const Wrench& wrench, const BodyTable& bodies, std::size_t i);

/// Gathers forces, gravity included, into `loads`, for a tick, or for a part of it; if it is the
/// first, applies the tick's impulses to the velocities. `wrenches` are in order of arrival.
void gather_loads(std::span<const ActiveWrench> wrenches, bool is_first, const Vector& gravity_W,
                  BodyTable& bodies, Loads& loads);
/// At the tick's end: counts the ticks down and drops what has ended.
void count_down(std::vector<ActiveWrench>& wrenches);

}  // namespace cradle
