// Free flight, "T8M6".
//
// Translation: x += dt v + dt^2/2 a, v += dt a: exact for constant a.
//
// Rotation: Euler's equations J w' + w x J w = tau in B by their Taylor series to order 8, and the
// attitude q' = q w / 2 by the sixth-order Magnus step on that series.
//   W_k = h^(k+1) w^(k)(0) / k!, so that h w(s h) = sum W_k s^k for s in [0, 1]; W_0 = h w.
//   J W_(k+1) = ( sum_j (J W_j) x W_(k-j) + T_k ) / (k+1)            (Euler's equations)
//   T_k: the same series of h^2 tau seen from the turning body, T_(k+1) = sum_j T_j x W_(k-j) /
//   (k+1) a1, a2, a3: moments of the series about the middle of the step; then Omega as in Blanes,
//   Casas, Ros (2000), "Improved high order integrators based on the Magnus expansion", BIT 40,
//   eq. 3.11, with the bracket [a, b] = -a x b of right multiplication. q+ = q exp(Omega)
// As many steps a tick as h |w| <= kStepAngle_rad asks, each body by itself.
// Order 6. Energy and angular momentum hold to 1e-13 over a minute of tumbling at h |w| = 0.08, and
// to 1e-8 up to h |w| = 2. No projection: it would hide the error in the attitude.
// Cost: about 200 ns a body and step, scalar.
#include "server/dynamics/free_flight.h"

#include <array>
#include <cmath>

#include "server/dynamics/rotation.h"

namespace cradle {
namespace {

constexpr int kOrder = 8;
constexpr double kStepAngle_rad = 0.16;  // beyond it the series' error grows faster than steps cost
// 4 ms a body. At the fastest spin allowed, reached only at rates below 31 Hz.
constexpr double kStepsMax = 20'000;

using Series = std::array<Vector, kOrder + 1>;

/// Moments of s^k about the middle of the step, A_m = integral of (s - 1/2)^m s^k, m = 0, 1, 2.
struct MagnusWeights {
  std::array<double, kOrder + 1> a1{}, a2{}, a3{};
};
constexpr MagnusWeights magnus_weights() {
  MagnusWeights weights;
  for (int k = 0; k <= kOrder; ++k) {
    const double A0 = 1.0 / (k + 1);
    const double A1 = 1.0 / (k + 2) - 1.0 / (2 * (k + 1));
    const double A2 = 1.0 / (k + 3) - 1.0 / (k + 2) + 1.0 / (4 * (k + 1));
    const auto i = static_cast<std::size_t>(k);
    weights.a1[i] = 9.0 / 4 * A0 - 15 * A2;
    weights.a2[i] = 12 * A1;
    weights.a3[i] = 180 * A2 - 15 * A0;
  }
  return weights;
}
constexpr MagnusWeights kMagnus = magnus_weights();

/// W_0 .. W_8 from W_0, and the torque's T_0 (both scaled by the step).
Series euler_series(const Vector& W0, const Vector& T0, const Vector& J, const Vector& inverse_J) {
  Series W;
  Series JW;
  Series T;
  W[0] = W0;
  JW[0] = J.cwiseProduct(W0);
  T[0] = T0;
  for (std::size_t k = 0; k < kOrder; ++k) {
    Vector moment = T[k];
    Vector turned = Vector::Zero();
    for (std::size_t j = 0; j <= k; ++j) {
      moment += JW[j].cross(W[k - j]);
      turned += T[j].cross(W[k - j]);
    }
    const double scale = 1.0 / static_cast<double>(k + 1);
    JW[k + 1] = moment * scale;
    W[k + 1] = inverse_J.cwiseProduct(JW[k + 1]);
    T[k + 1] = turned * scale;
  }
  return W;
}

/// The rotation vector of the whole step, in B at its start.
Vector magnus_step(const Series& W) {
  Vector a1 = Vector::Zero();
  Vector a2 = Vector::Zero();
  Vector a3 = Vector::Zero();
  for (std::size_t k = 0; k <= kOrder; ++k) {
    a1 += kMagnus.a1[k] * W[k];
    a2 += kMagnus.a2[k] * W[k];
    a3 += kMagnus.a3[k] * W[k];
  }
  const Vector C1 = a2.cross(a1);
  const Vector C2 = a1.cross(2 * a3 + C1) / 60;
  return a1 + a3 / 12 + (a2 + C2).cross(C1 - 20 * a1 - a3) / 240;
}

void turn(Flight& body, double dt, const Vector& tau_W, const Vector& J) {
  const Vector inverse_J = J.cwiseInverse();
  Vector w_B = body.q.conjugate() * body.w;
  const double acceleration = (body.q.conjugate() * tau_W).cwiseProduct(inverse_J).norm();
  const double angle = dt * (w_B.norm() + dt * acceleration);
  const double steps = std::fmin(std::fmax(1.0, std::ceil(angle / kStepAngle_rad)), kStepsMax);
  const double h = dt / steps;
  for (double step = 0; step < steps; ++step) {
    const Vector T0 = h * h * (body.q.conjugate() * tau_W);
    const Series W = euler_series(h * w_B, T0, J, inverse_J);
    Vector hw = Vector::Zero();
    for (const Vector& term : W) hw += term;
    w_B = hw / h;
    body.q = body.q * rotation_exp(magnus_step(W));
    // One Newton step for 1 / |q|: q stays within 1e-15 of unit length, without a root.
    body.q.coeffs() *= 1.5 - 0.5 * body.q.coeffs().squaredNorm();
  }
  body.w = body.q * w_B;
}

}  // namespace

void fly(Flight& body, double dt, const Vector& a_W, const Vector& tau_W, const Vector& inertia) {
  body.x += dt * body.v + (0.5 * dt * dt) * a_W;
  body.v += dt * a_W;
  if (inertia.isZero(0)) {
    if (!body.w.isZero(0)) body.q = normalised(rotation_exp(dt * body.w) * body.q);
    return;
  }
  if (body.w.isZero(0) && tau_W.isZero(0)) return;
  turn(body, dt, tau_W, inertia);
}

}  // namespace cradle
