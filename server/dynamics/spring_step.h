/// Bodies joined by springs, moved together: implicit, stable at every stiffness, and without any
/// gain of energy. spring_step.cpp states the method.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/dynamics/loads.h"

namespace cradle {

struct SpringBody {
  Flight flight;
  Inertia inertia;
  Vector force_W = Vector::Zero();   ///< N, constant over the step
  Vector torque_W = Vector::Zero();  ///< N m
  Vector torque_B = Vector::Zero();  ///< N m
  Drag drag;
};

/// One end: a point of the body number `body`, or, with -1, a point that goes straight from
/// `point` to `end` in W, whatever pulls it.
struct SpringEnd {
  std::int32_t body = -1;
  Vector point = Vector::Zero();  ///< m, from Bcm along the principal axes; or in W
  Vector end = Vector::Zero();    ///< m, in W, at the step's end
};

struct SpringLink {
  SpringEnd a, b;
  double stiffness = 0;    ///< N/m
  double damping = 0;      ///< N s/m
  double rest_length = 0;  ///< m; 0: it damps in every direction, else along the spring
};

struct SpringReport {
  std::int64_t evaluations = 0;  ///< of all forces and torques
  int unconverged = 0;           ///< parts of the step whose equations were not solved to rounding
};

/// Moves `bodies` through `h` (s). The order of bodies and links changes results by rounding only.
SpringReport spring_step(std::span<SpringBody> bodies, std::span<const SpringLink> links, double h);

/// Energy that the links store, J.
double spring_energy(std::span<const SpringBody> bodies, std::span<const SpringLink> links);

}  // namespace cradle
