/// Force and torque as functions of the state, and Newton's method on them: what the schemes share.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "server/dynamics/schemes/scheme.h"

namespace cradle {

struct Acceleration {
  Vector linear_W;  ///< F / m, m/s^2
  Vector moment_B;  ///< M, N m, without the gyroscopic term
};

inline Acceleration evaluate(const Flight& s, const Inertia& inertia, const FlightLoads& loads,
                             Work& work) {
  ++work.evaluations;
  const Resistance drag = resistance(loads.drag, s.v, s.w);
  Vector force_W = loads.force_W + drag.force_W;
  Vector torque_W = loads.torque_W + drag.torque_W;
  for (const Anchor& anchor : loads.anchors) {
    const Vector arm = s.q * anchor.point_B;  // from the centre to the point of load
    const Vector d = s.x + arm - anchor.point_W;
    const double length = d.norm();
    if (length == 0) continue;
    const Vector n = d / length;
    const double rate = n.dot(s.v + s.w.cross(arm));
    const Vector pull =
        -(anchor.stiffness * (length - anchor.rest_length) + anchor.damping * rate) * n;
    force_W += pull;
    torque_W += arm.cross(pull);
  }
  return {force_W / inertia.mass, s.q.conjugate() * torque_W + loads.torque_B};
}

/// W' of Euler's equations; zero for what turns with constant velocity.
inline Vector angular_acceleration(const Vector& w_B, const Vector& moment_B,
                                   const Inertia& inertia) {
  if (!inertia.turns()) return Vector::Zero();
  const Vector& J = inertia.moments;
  return (moment_B - w_B.cross(J.cwiseProduct(w_B))).cwiseQuotient(J);
}

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Of an equation for u: what is left, and the size of the terms whose sum it is, by which it is
/// measured; of velocity and of angular velocity.
struct Residual {
  Vector6 value;
  double linear_size;
  double angular_size;
};

/// A residual this small, of its terms, is none. Rounding leaves about 1e-13 of stiff springs far
/// from the origin, and errors of the schemes are larger than 1e-10 at any step worth taking.
inline constexpr double kSolved = 1e-10;

inline bool is_solved(const Residual& r) {
  return r.value.head<3>().norm() <= kSolved * r.linear_size &&
         r.value.tail<3>().norm() <= kSolved * r.angular_size;
}

struct Solution {
  Vector6 u;
  bool is_solved;
};

/// Newton's method for residual(u) = 0, u = (a velocity, an angular velocity), residual in the same
/// units. Jacobian by difference quotients: they set the pace, not the limit, which is where no
/// step makes the residual smaller. A step that makes it larger is halved.
template <class Equations>
Solution solve(Vector6 u, Equations&& equations) {
  constexpr int kIterationsMax = 50;
  constexpr int kHalvingsMax = 30;
  constexpr double kDifference = 1e-7;  // of the speed: the root of rounding, times 10
  constexpr double kSpeedMin = 1e-3;    // m/s, rad/s: what a difference is measured by at rest
  constexpr double kRounding = 1e-15;   // a step this small, of u, moves no digit that counts
  Residual r = equations(u);
  for (int iteration = 0; iteration < kIterationsMax && r.value.squaredNorm() > 0; ++iteration) {
    Eigen::Matrix<double, 6, 6> jacobian;
    for (int k = 0; k < 6; ++k) {
      Vector6 moved = u;
      const double part = k < 3 ? u.head<3>().norm() : u.tail<3>().norm();
      const double before = moved[k];
      moved[k] += kDifference * std::max(part, kSpeedMin);
      jacobian.col(k) = (equations(moved).value - r.value) / (moved[k] - before);
    }
    Vector6 step = jacobian.partialPivLu().solve(r.value);
    bool is_better = false;
    for (int halving = 0; halving < kHalvingsMax && !is_better; ++halving) {
      const Vector6 next = u - step;
      const Residual r_next = equations(next);
      is_better = r_next.value.squaredNorm() < r.value.squaredNorm();
      if (!is_better && step.norm() <= kRounding * u.norm()) return {u, is_solved(r)};
      if (is_better) {
        u = next;
        r = r_next;
      }
      step *= 0.5;
    }
    if (!is_better) break;
  }
  return {u, is_solved(r)};
}

}  // namespace cradle
