// Stoermer-Verlet, as velocity Verlet: half a kick, drift, half a kick.
//
// Source: Rueth, "Rigid Body Physics", II.C.3; Verlet 1967. On rotations: the variational
// Lie-Verlet method (Bou-Rabee, Marsden 2009, "Hamilton-Pontryagin integrators on Lie groups",
// Found. Comput. Math. 9, section 4) with the Cayley map. In our symbols:
//   v' = v + h/2 F0 / m,  x1 = x + h v',  v1 = v' + h/2 F1 / m
//   J W' + h/2 W' x J W' + h^2/4 (W' . J W') W' = J W + h/2 M0        (for W', by Newton's method)
//   q1 = q (1, h W' / 2) / |.|
//   J W1 = J W' - h/2 W' x J W' + h^2/4 (W' . J W') W' + h/2 M1
// Where we differ: F1 and M1 are those at the state (x1, q1, v1, w1) itself, so that the kick is an
// equation for (v1, W1) wherever a load depends on the velocity; with the old velocity in it, as
// the printed formula is often read, the order drops to 1. And there is an attitude, with the
// gyroscopic term.
// Order: 2. Stability: h omega < 2 for a spring, phase cos(theta) = 1 - (h omega)^2 / 2; drag: v
// at every h, but x leaps beyond h = 2 m / c, as it moves by h (1 - h c / (2 m)) v. Energy:
// symplectic: bounded where loads depend on position and attitude alone, also in tumbling; without
// torque the angular momentum is exact. Cost: 2 evaluations, 210 ns; with velocity-dependent loads
// about 12, 920 ns.
#include <Eigen/LU>

#include "server/dynamics/gyroscopic.h"
#include "server/dynamics/rotation.h"
#include "server/dynamics/schemes/right_hand_side.h"

namespace cradle {
namespace {

/// J W + s h/2 W x J W + h^2/4 (W . J W) W
Vector momentum(const Vector& W, const Vector& J, double h, double sign) {
  const Vector JW = J.cwiseProduct(W);
  return JW + sign * h / 2 * W.cross(JW) + h * h / 4 * W.dot(JW) * W;
}

/// W' of the momentum at the step's start.
Vector drift_rate(const Vector& m, const Vector& J, double h) {
  constexpr int kSolvesMax = 50;
  constexpr double kRounding = 1e-15;  // a step this small, of W, moves no digit that counts
  Vector W = m.cwiseQuotient(J);
  for (int iteration = 0; iteration < kSolvesMax; ++iteration) {
    const Vector JW = J.cwiseProduct(W);
    Matrix jacobian =
        h / 2 * (cross_matrix(W) * J.asDiagonal().toDenseMatrix() - cross_matrix(JW)) +
        h * h / 2 * W * JW.transpose();
    jacobian.diagonal() += J + Vector::Constant(h * h / 4 * W.dot(JW));
    const Vector step = jacobian.inverse() * (momentum(W, J, h, 1) - m);
    W -= step;
    if (step.squaredNorm() <= kRounding * kRounding * W.squaredNorm()) break;
  }
  return W;
}

}  // namespace

void stoermer_verlet(Flight& body, const Inertia& inertia, const FlightLoads& loads, double h,
                     Work& work) {
  const Vector& J = inertia.moments;
  const bool turns = inertia.turns();
  const Acceleration before = evaluate(body, inertia, loads, work);
  Vector w_B = body.q.conjugate() * body.w;

  const Vector v_half = body.v + h / 2 * before.linear_W;
  body.x += h * v_half;
  Vector m_half = Vector::Zero();
  if (turns) {
    const Vector W = drift_rate(J.cwiseProduct(w_B) + h / 2 * before.moment_B, J, h);
    const Vector half = h / 2 * W;
    body.q = normalised(body.q * Rotation(1, half.x(), half.y(), half.z()));
    m_half = momentum(W, J, h, -1);
    w_B = m_half.cwiseQuotient(J);
  } else {
    body.q = normalised(body.q * rotation_exp(h * w_B));
  }

  const auto kicked = [&](const Flight& end) {
    const Acceleration after = evaluate(end, inertia, loads, work);
    Vector6 u;
    u.head<3>() = v_half + h / 2 * after.linear_W;
    u.tail<3>() = turns ? Vector((m_half + h / 2 * after.moment_B).cwiseQuotient(J)) : w_B;
    return u;
  };
  const auto with = [&](const Vector6& u) {
    return Flight{body.x, body.q, u.head<3>(), body.q * u.tail<3>()};
  };
  Vector6 u;
  u << v_half, w_B;
  if (loads.depends_on_velocity()) {
    const Vector6 drifted = u;
    const Solution solution = solve(u, [&](const Vector6& at) {
      const Vector6 kick = kicked(with(at)) - drifted;
      const Vector6 sum = at.cwiseAbs() + drifted.cwiseAbs() + kick.cwiseAbs();
      return Residual{at - drifted - kick, sum.head<3>().norm(), sum.tail<3>().norm()};
    });
    u = solution.u;
    if (!solution.is_solved) ++work.unsolved;
  } else {
    u = kicked(with(u));
  }
  body = with(u);
}

}  // namespace cradle
