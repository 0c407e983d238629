/// What tests of the schemes share: a body moved through a time, and measured orders.
#pragma once

#include <cmath>
#include <string>

#include "server/dynamics/rotation.h"
#include "server/dynamics/schemes/scheme.h"

namespace cradle {

inline Flight run(const Scheme& scheme, Flight body, const Inertia& inertia,
                  const FlightLoads& loads, double time_s, int step_count) {
  Work work;
  for (int i = 0; i < step_count; ++i) {
    scheme.advance(body, inertia, loads, time_s / step_count, work);
  }
  return body;
}

/// Angle between two attitudes, rad, without losing small ones.
inline double angle(const Rotation& a, const Rotation& b) {
  return 2 * (a.conjugate() * b).vec().norm();
}

/// log2 of the errors' ratio at `step_count` and twice as many steps.
template <class Error>
double measured_order(const Scheme& scheme, const Flight& start, const Inertia& inertia,
                      const FlightLoads& loads, double time_s, int step_count, Error&& error) {
  const double coarse = error(run(scheme, start, inertia, loads, time_s, step_count));
  const double fine = error(run(scheme, start, inertia, loads, time_s, 2 * step_count));
  return std::log2(coarse / fine);
}

/// The box of P07: half extents 0.1, 0.2, 0.3 m, 1 kg.
inline const Inertia kBox{1, {0.13 / 3, 0.1 / 3, 0.05 / 3}};

inline double rotational_energy(const Flight& body, const Inertia& inertia) {
  const Vector w_B = body.q.conjugate() * body.w;
  return w_B.dot(inertia.moments.cwiseProduct(w_B)) / 2;
}
inline Vector angular_momentum(const Flight& body, const Inertia& inertia) {
  return body.q * inertia.moments.cwiseProduct(body.q.conjugate() * body.w);
}

}  // namespace cradle
