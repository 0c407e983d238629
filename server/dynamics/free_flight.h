/// Motion without contact: exact where it can be, and far below the wire's precision elsewhere.
/// The method is described in flight_method.h.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/geometry.h"

namespace cradle {

/// A body in flight: frame W, about Bcm.
struct Flight {
  Vector x = Vector::Zero();          ///< m
  Rotation q = Rotation::Identity();  ///< q_WP
  Vector v = Vector::Zero();          ///< m/s
  Vector w = Vector::Zero();          ///< rad/s
};

/// What moves a body in a tick.
enum class Course : std::uint8_t {
  still,    ///< nothing: static, asleep or quarantined
  driven,   ///< its own constant velocities: kinematic
  falls,    ///< gravity alone
  pushed,   ///< gravity, and forces or torques of its own
  touches,  ///< contacts: it does not fly
  moved     ///< it has been moved through this tick by other means
};

/// The bodies' arrays, one a quantity, indexed by slot. Owned by the world.
struct FlightArrays {
  std::span<const Course> course;
  std::span<Vector> x;                      ///< m, in W, of Bcm
  std::span<Rotation> q;                    ///< q_WP, P the principal axes
  std::span<Vector> v;                      ///< m/s, in W
  std::span<Vector> w;                      ///< rad/s, in W
  std::span<const Vector> inertia;          ///< principal moments J in P, kg m^2; zero: no torque
                                            ///< turns it, and it turns at constant velocity
  std::span<const Vector> inverse_inertia;  ///< of J
  std::span<const Vector> acceleration;     ///< m/s^2, in W; read where Course::pushed, as are
  std::span<const Vector> torque_W;         ///< N m, in W, constant there
  std::span<const Vector> torque_P;         ///< N m, in P, constant there
  std::span<std::uint8_t> lost;             ///< set to 1, see fly_all
};

struct FlightTick {
  double dt = 0;  ///< s
  Vector gravity_W = Vector::Zero();
  int lanes = 0;           ///< bodies side by side: one of machine_lanes(), or 0 for the most
  double full_steps = 0;   ///< above 0, the full model: see flight_need
  bool is_planar = false;  ///< bodies lie in z = 0, move in it and turn about z; loads likewise
};

/// How much of the rotation's equations a body needs.
enum class Turn : std::uint8_t {
  none,           ///< it does not turn
  steady,         ///< it turns at constant angular velocity: no gyroscopic term
  tumbling,       ///< freely, in one step
  tumbling_fast,  ///< freely, in several steps
  twisted,        ///< under torques
  twisted_round,  ///< under torques, with equal moments: no gyroscopic term
  planar          ///< in a planar world, under torques or not, in one step
};

struct FlightNeed {
  Turn turn = Turn::none;
  double steps = 0;  ///< of the series in the tick, whole; 0 without series
};

/// A step of the series turns a body by no more, rad. At 0.16 energy drifts by 1.5e-8 in a minute
/// ("240 random bodies"); T4 asks for 0.09 at most.
inline constexpr double kStepAngle_rad = 0.14;

/// Steps of the full model for one that the fastest body takes.
inline constexpr double kFullModel = 4;

/// What fly_all gives to body `i`, by the body's own state alone. In the full model every body with
/// moments goes through the whole series with torque, in `full_steps` steps or more.
FlightNeed flight_need(const FlightTick& tick, const FlightArrays& bodies, std::size_t i);

/// Moves the bodies [begin, end) that fly through a tick with constant acceleration and torque.
/// Each gets what flight_need says: a body without angular velocity no rotation, one with equal
/// moments no gyroscopic term, one without torque no series of it, a fast one more steps, one
/// in the plane x, y and an angle. Results do not depend on lanes, on range or on other bodies. In
/// the full model no body may be Course::falls.
///
/// A body that would leave the limits of limits.h, or whose numbers are no longer finite, stays
/// where it was, its velocities show what went wrong, and it is marked in `lost`.
///
/// Ranges may be flown side by side by several threads.
void fly_all(const FlightTick& tick, const FlightArrays& bodies, int begin, int end);

/// One body alone, bit for bit as fly_all moves it. Zero `inertia`: it turns at constant velocity.
/// Returns the number of steps that the rotation takes, 0 if it takes none.
int fly(Flight& body, double dt, const Vector& acceleration, const Vector& torque_W,
        const Vector& torque_P, const Vector& inertia);

}  // namespace cradle
