// Exact flight: closed forms where they exist, and series of order 6 where they do not.
//
// Constant loads alone: `fly` (free_flight.h). Beyond that:
// Linear drag (c = c1 / m, constant acceleration a), closed form; phi_k as in exponential
// integrators (Hochbruck, Ostermann 2010, Acta Numerica 19, eq. 2.10), z = -c h:
//   v1 = v + h phi_1(z) (a - c v),  x1 = x + h v + h^2 phi_2(z) (a - c v)
//   phi_1(z) = (e^z - 1) / z,  phi_2(z) = (e^z - 1 - z) / z^2
// Quadratic drag: there is no closed form in space. Gauss collocation of three stages (Hairer,
// Wanner 1996, "Solving ODEs II", table IV.5.2; order 6, A-stable), stages by fixed-point
// iteration, sub-steps such that h (c1 + 2 c2 |v|) / m <= 0.2. |v| v has a kink where v = 0: a
// sub-step ends where a body that is thrown against its acceleration comes to its apex. After 256
// sub-steps the body has long been at its terminal velocity; the rest is one implicit Euler step in
// closed form, which ends there, too.
// Rotation with angular drag: the Taylor series and Magnus step of flight_method.h, one term more:
//   J W_(k+1) = (sum (J W_j) x W_(k-j) + T_k - h c3 W_k + [k = 0] h^2 M_B) / (k + 1)
//   in steps that c3 / J asks for, until the body has come to rest; under a torque until 4000
// steps, where the fastest axis is at its balance e^-560 near: the rest is one implicit Euler step.
// Springs: spring_step.h, order 2, instead of all of the above.
//
// Order: exact, 6, or 2.
//
// Stability: at every h.
//
// Energy: without drag and springs to 1e-12 over a minute of tumbling.
//
// Cost: a series of 9 terms, 230 ns.
#include <array>
#include <cmath>

#include "server/dynamics/rotation.h"
#include "server/dynamics/schemes/scheme.h"
#include "server/dynamics/spring_step.h"

namespace cradle {
namespace {

// Translation.

/// e^z, phi_1 and phi_2 for z <= 0, without libm: series below 1/2, then by doubling z:
/// phi_1(2z) = (e^z + 1) phi_1(z) / 2,  phi_2(2z) = (phi_1(z)^2 + 2 phi_2(z)) / 4.
struct Phi {
  double e = 1, one = 1, two = 0.5;
};
Phi phi(double z) {
  int doublings = 0;
  while (z < -0.5 && doublings < 64) {
    z *= 0.5;
    ++doublings;
  }
  Phi f;
  f.two = 1.0 / 2;
  double term = 1.0 / 2;
  for (int k = 3; k <= 17; ++k) f.two += term *= z / k;
  f.one = 1 + z * f.two;
  f.e = 1 + z * f.one;
  for (; doublings > 0; --doublings) {
    f = {f.e * f.e, (f.e + 1) * f.one / 2, (f.one * f.one + 2 * f.two) / 4};
  }
  return f;
}

void glide_linear(Flight& body, const Vector& a, double c, double h) {
  const Phi f = phi(-c * h);
  const Vector start = a - c * body.v;
  body.x += h * body.v + h * h * f.two * start;
  body.v = f.e * body.v + h * f.one * a;  // without cancellation at large c h
}

/// v' = a - (c1 + c2 |v|) v, with c1 and c2 by kilogram.
struct QuadraticDrag {
  Vector a;
  double c1, c2;
  Vector rate(const Vector& v) const { return a - (c1 + c2 * v.norm()) * v; }
};

/// Gauss collocation, order 6.
void gauss_step(Flight& body, const QuadraticDrag& drag, double h, Work& work) {
  constexpr double r = 3.872983346207417;  // sqrt(15)
  constexpr double A[3][3] = {{5.0 / 36, 2.0 / 9 - r / 15, 5.0 / 36 - r / 30},
                              {5.0 / 36 + r / 24, 2.0 / 9, 5.0 / 36 - r / 24},
                              {5.0 / 36 + r / 30, 2.0 / 9 + r / 15, 5.0 / 36}};
  constexpr double b[3] = {5.0 / 18, 4.0 / 9, 5.0 / 18};
  constexpr int kIterations = 16;      // contracts by h (c1 + 2 c2 |v|) / 2 <= 0.1 an iteration
  constexpr double kRounding = 1e-16;  // of the rates: what iterating further cannot change
  std::array<Vector, 3> k;
  k.fill(drag.rate(body.v));
  std::array<Vector, 3> V;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    double change = 0, size = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      V[i] = body.v + h * (A[i][0] * k[0] + A[i][1] * k[1] + A[i][2] * k[2]);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector next = drag.rate(V[i]);
      change += (next - k[i]).squaredNorm();
      size += next.squaredNorm();
      k[i] = next;
    }
    work.evaluations += 3;
    if (change <= kRounding * kRounding * size) break;
  }
  body.x += h * (b[0] * V[0] + b[1] * V[1] + b[2] * V[2]);
  body.v += h * (b[0] * k[0] + b[1] * k[1] + b[2] * k[2]);
}

/// (1 + h (c1 + c2 s)) v1 = v + h a with s = |v1|: a quadratic equation for s.
void settle(Flight& body, const QuadraticDrag& drag, double h) {
  const Vector sum = body.v + h * drag.a;
  const double p = 1 + h * drag.c1;
  const double s = 2 * sum.norm() / (p + std::sqrt(p * p + 4 * h * drag.c2 * sum.norm()));
  body.v = sum / (p + h * drag.c2 * s);
  body.x += h * body.v;
}

/// When the acceleration has taken all of the velocity along it, if that is within h; else h.
double time_to_apex(const Flight& body, const QuadraticDrag& drag, double h, Work& work) {
  const double along = body.v.dot(drag.a);
  if (!(along < 0)) return h;
  constexpr double kApex = 1e-9;  // of h: |v| v is off by its square, far below order 6
  double early = 0, late = h;
  for (int i = 0; i < 60; ++i) {
    Flight at = body;
    const double middle = i == 0 ? h : (early + late) / 2;
    gauss_step(at, drag, middle, work);
    if (at.v.dot(drag.a) < 0) {
      if (i == 0) return h;
      early = middle;
    } else {
      late = middle;
    }
    if (late - early <= kApex * h) break;
  }
  return late;
}

void glide_quadratic(Flight& body, const QuadraticDrag& drag, double h, Work& work) {
  constexpr double kRateStep = 0.2;
  constexpr int kStepsMax = 256;
  double left = h;
  for (int i = 0; i < kStepsMax && left > 0; ++i) {
    // At rest the speed it reaches counts.
    const double speed = std::fmax(
        body.v.norm(), std::fmin(left * drag.a.norm(), std::sqrt(drag.a.norm() / drag.c2)));
    const double rate = drag.c1 + 2 * drag.c2 * speed;
    double step = rate * left <= kRateStep ? left : kRateStep / rate;
    step = time_to_apex(body, drag, step, work);
    gauss_step(body, drag, step, work);
    left -= step;
  }
  if (left > 0) settle(body, drag, left);
}

// Rotation.

constexpr std::size_t kOrder = 8;
constexpr double kExactStepsMax = 4000;  // about 1 ms
constexpr double kStopped_rad = 1e-18;   // a turn in the tick: below all rounding

struct Spin {
  Vector torque_W, torque_B;
  double drag;
  Vector J;
};

/// One step of the series: q and W to its end.
void series_step(Rotation& q, Vector& w_B, const Spin& spin, double h) {
  std::array<Vector, kOrder + 1> W, JW, T;
  W[0] = h * w_B;
  JW[0] = spin.J.cwiseProduct(W[0]);
  T[0] = h * h * (q.conjugate() * spin.torque_W);
  Vector sum = W[0], a1 = Vector::Zero(), a2 = Vector::Zero(), a3 = Vector::Zero();
  for (std::size_t k = 0; k <= kOrder; ++k) {
    const auto n = static_cast<double>(k);
    const double A0 = 1 / (n + 1), A1 = 1 / (n + 2) - 1 / (2 * (n + 1));
    const double A2 = 1 / (n + 3) - 1 / (n + 2) + 1 / (4 * (n + 1));
    a1 += (9.0 / 4 * A0 - 15 * A2) * W[k];
    a2 += 12 * A1 * W[k];
    a3 += (180 * A2 - 15 * A0) * W[k];
    if (k == kOrder) break;
    Vector moment = T[k] - h * spin.drag * W[k];
    if (k == 0) moment += h * h * spin.torque_B;
    Vector turned = Vector::Zero();
    for (std::size_t j = 0; j <= k; ++j) {
      moment += JW[j].cross(W[k - j]);
      turned += T[j].cross(W[k - j]);
    }
    JW[k + 1] = moment / (n + 1);
    W[k + 1] = JW[k + 1].cwiseQuotient(spin.J);
    T[k + 1] = turned / (n + 1);
    sum += W[k + 1];
  }
  const Vector C1 = a2.cross(a1);
  const Vector C2 = a1.cross(2 * a3 + C1) / 60;
  const Vector turn = a1 + a3 / 12 + (a2 + C2).cross(C1 - 20 * a1 - a3) / 240;
  w_B = sum / h;
  q = normalised(q * rotation_exp(turn));
}

/// One implicit Euler step of what is left when drag has long balanced the torque.
void settle(Rotation& q, Vector& w_B, const Spin& spin, double h) {
  const Vector torque_B = q.conjugate() * spin.torque_W + spin.torque_B;
  const Vector J1 = spin.J + Vector::Constant(h * spin.drag);
  w_B = (spin.J.cwiseProduct(w_B) + h * torque_B).cwiseQuotient(J1);
  q = normalised(q * rotation_exp(h * w_B));
}

void spin_through(Flight& body, const Spin& spin, double dt, Work& work) {
  Vector w_B = body.q.conjugate() * body.w;
  const Vector torque_B = body.q.conjugate() * spin.torque_W + spin.torque_B;
  const bool is_pushed = !torque_B.isZero(0);
  const double decay = dt * spin.drag / spin.J.minCoeff();
  const double angle = dt * (w_B.norm() + dt * torque_B.cwiseQuotient(spin.J).norm());
  const double steps = std::fmax(1.0, std::ceil(std::fmax(angle, decay) / kStepAngle_rad));
  double done = 0;
  for (; done < std::fmin(steps, kExactStepsMax); ++done) {
    if (!is_pushed && dt * w_B.norm() < kStopped_rad) break;
    series_step(body.q, w_B, spin, dt / steps);
    work.evaluations += kOrder + 1;
  }
  if (done < steps) {
    settle(body.q, w_B, spin, (steps - done) / steps * dt);
    ++work.evaluations;
  }
  body.w = body.q * w_B;
}

void move_by_springs(Flight& body, const Inertia& inertia, const FlightLoads& loads, double h,
                     Work& work) {
  SpringBody one{body, inertia, loads.force_W, loads.torque_W, loads.torque_B, loads.drag};
  std::vector<SpringLink> links;
  for (const Anchor& anchor : loads.anchors) {
    SpringLink& link = links.emplace_back();
    link.a = {0, anchor.point_B, Vector::Zero()};
    link.b = {-1, anchor.point_W, anchor.point_W};
    link.stiffness = anchor.stiffness;
    link.damping = anchor.damping;
    link.rest_length = anchor.rest_length;
  }
  work.evaluations += spring_step(std::span(&one, 1), links, h).evaluations;
  body = one.flight;
}

}  // namespace

void exact(Flight& body, const Inertia& inertia, const FlightLoads& loads, double h, Work& work) {
  if (!loads.anchors.empty()) return move_by_springs(body, inertia, loads, h, work);
  const Vector a_W = loads.force_W / inertia.mass;
  const Drag& drag = loads.drag;
  if (drag.angular == 0) {
    Flight end = body;
    const int steps = fly(end, h, a_W, loads.torque_W, loads.torque_B, inertia.moments);
    work.evaluations += static_cast<std::int64_t>(kOrder + 1) * steps;
    if (drag.linear == 0 && drag.quadratic == 0) {
      ++work.evaluations;
      body = end;
      return;
    }
    body.q = end.q;
    body.w = end.w;
  } else if (inertia.turns()) {
    spin_through(body, {loads.torque_W, loads.torque_B, drag.angular, inertia.moments}, h, work);
  } else {
    body.q = normalised(rotation_exp(h * body.w) * body.q);
  }
  if (drag.quadratic != 0) {
    glide_quadratic(body, {a_W, drag.linear / inertia.mass, drag.quadratic / inertia.mass}, h,
                    work);
  } else {
    ++work.evaluations;
    glide_linear(body, a_W, drag.linear / inertia.mass, h);
  }
}

}  // namespace cradle
