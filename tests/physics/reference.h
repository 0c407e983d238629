/// References for motion that share no code with the server: RK4 in extended precision, with steps
/// so short that only rounding is left.
#pragma once

#include <array>
#include <cmath>

#include "server/dynamics/loads.h"

namespace cradle::reference {

using Long = long double;
using Long3 = std::array<Long, 3>;

/// Attitude and angular velocity in B.
struct Spin {
  std::array<Long, 4> q{1, 0, 0, 0};  // w, x, y, z
  Long3 w{};
};

struct SpinLoads {
  Long3 torque_W{}, torque_B{};
  Long drag = 0;  // kg m^2/s
};

inline Spin rate(const Spin& s, const Long3& J, const SpinLoads& loads) {
  const auto [w, x, y, z] = s.q;
  const auto [a, b, c] = s.w;
  const Long3& T = loads.torque_W;
  // Rows of R^T.
  const Long3 M{
      (1 - 2 * (y * y + z * z)) * T[0] + 2 * (x * y + w * z) * T[1] + 2 * (x * z - w * y) * T[2],
      2 * (x * y - w * z) * T[0] + (1 - 2 * (x * x + z * z)) * T[1] + 2 * (y * z + w * x) * T[2],
      2 * (x * z + w * y) * T[0] + 2 * (y * z - w * x) * T[1] + (1 - 2 * (x * x + y * y)) * T[2]};
  Spin d;
  d.q = {(-x * a - y * b - z * c) / 2, (w * a + y * c - z * b) / 2, (w * b + z * a - x * c) / 2,
         (w * c + x * b - y * a) / 2};
  const Long3 gyro{(J[1] - J[2]) * b * c, (J[2] - J[0]) * c * a, (J[0] - J[1]) * a * b};
  for (std::size_t i = 0; i < 3; ++i) {
    d.w[i] = (gyro[i] + M[i] + loads.torque_B[i] - loads.drag * s.w[i]) / J[i];
  }
  return d;
}

inline Spin plus(Spin s, Long h, const Spin& d) {
  for (std::size_t i = 0; i < 4; ++i) s.q[i] += h * d.q[i];
  for (std::size_t i = 0; i < 3; ++i) s.w[i] += h * d.w[i];
  return s;
}

inline Spin step(const Spin& s, const Long3& J, const SpinLoads& loads, Long h) {
  const Spin k1 = rate(s, J, loads), k2 = rate(plus(s, h / 2, k1), J, loads);
  const Spin k3 = rate(plus(s, h / 2, k2), J, loads), k4 = rate(plus(s, h, k3), J, loads);
  Spin end = plus(plus(plus(plus(s, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4);
  Long norm = 0;
  for (Long c : end.q) norm += c * c;
  for (Long& c : end.q) c /= std::sqrt(norm);
  return end;
}

inline Long3 longer(const Vector& v) { return {v.x(), v.y(), v.z()}; }

/// The body after `time_s`; it starts with q = 1. Position and velocity stay zero.
inline Flight spin(const Vector& w0, const Vector& J, const FlightLoads& loads, double time_s,
                   int steps) {
  Spin s;
  s.w = longer(w0);
  const SpinLoads all{longer(loads.torque_W), longer(loads.torque_B), loads.drag.angular};
  for (int i = 0; i < steps; ++i) s = step(s, longer(J), all, static_cast<Long>(time_s) / steps);
  const auto d = [](Long x) { return static_cast<double>(x); };
  Flight end;
  end.q = Rotation(d(s.q[0]), d(s.q[1]), d(s.q[2]), d(s.q[3]));
  end.w = end.q * Vector(d(s.w[0]), d(s.w[1]), d(s.w[2]));
  return end;
}

}  // namespace cradle::reference
