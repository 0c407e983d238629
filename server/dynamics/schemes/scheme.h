/// Integration schemes for one body in flight, behind one interface; one file a scheme.
///
/// Symbols of all files: h step (s); x, v position and velocity of Bcm in W; q attitude q_WB; w
/// angular velocity in W, W in B; J principal moments; m mass; F force in W; T torque in W; M
/// torque in B; index 0 and 1: at the step's start and end. Equations of motion:
///   x' = v,  m v' = F(x, q, v, w),  q' = q (0, W) / 2,  J W' + W x J W = M(x, q, v, w)
/// The cost in each file's head is that of a step of one tumbling body with a torque (and, where
/// said, linear drag) at 60 Hz, on one core of a Zen 5; `cradle_bench report` measures it case by
/// case.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/dynamics/loads.h"

namespace cradle {

/// What a step took, counted: evaluations of force and torque, those within iterations included. A
/// term of a series counts as one.
struct Work {
  std::int64_t evaluations = 0;
  /// Steps of implicit schemes whose equations are not solved to kSolved (right_hand_side.h).
  std::int64_t unsolved = 0;
};

struct Scheme {
  const char* name;
  /// Moves the body through `h` (s).
  void (*advance)(Flight& body, const Inertia& inertia, const FlightLoads& loads, double h,
                  Work& work);
  double order;        ///< of position, velocity and attitude in smooth motion
  const char* source;  ///< author and year
};

/// All of them, the default first.
std::span<const Scheme> schemes();
/// By name; null for an unknown one.
const Scheme* find_scheme(std::string_view name);

void exact(Flight&, const Inertia&, const FlightLoads&, double h, Work&);
void explicit_euler(Flight&, const Inertia&, const FlightLoads&, double h, Work&);
void implicit_euler(Flight&, const Inertia&, const FlightLoads&, double h, Work&);
void stoermer_verlet(Flight&, const Inertia&, const FlightLoads&, double h, Work&);
void semi_implicit_euler(Flight&, const Inertia&, const FlightLoads&, double h, Work&);
void rk4(Flight&, const Inertia&, const FlightLoads&, double h, Work&);

}  // namespace cradle
