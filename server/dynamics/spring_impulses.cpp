// Source: soft constraints of Catto 2011, "Soft Constraints" (GDC): with stretch C = |d| - L along
// n = d / |d|, K the inverse mass along n, and an impulse p on b for each spring,
//   (K + g) p = -(n . (v_b - v_a) + b C),  g = 1 / (h (c + h k)),  b = k / (c + h k)
// which is implicit Euler for the spring as it lies. Springs one after the other, over and over;
// then x1 = x0 + h v1. Solvable always. Turning within the step is not seen, so that energy might
// rise: it is compared, and velocities are made smaller if it does; if that does not do, bodies
// stand still. Where we differ: drag by its value at the step's start, divided as implicit Euler
// would. Order 1. Cost: 20 sweeps.
#include "server/dynamics/spring_impulses.h"

#include <algorithm>
#include <cmath>

#include "server/dynamics/rotation.h"

namespace cradle {
namespace {

constexpr int kSweeps = 40;
constexpr int kHalvings = 30;

struct Pull {
  Vector n;  // from a to b
  double stretch = 0, impulse = 0;
};

Vector place(std::span<const SpringBody> bodies, const SpringEnd& end) {
  if (end.body < 0) return end.point;
  const Flight& flight = bodies[static_cast<std::size_t>(end.body)].flight;
  return flight.x + flight.q * end.point;
}

Vector velocity(std::span<const SpringBody> bodies, const SpringEnd& end, double h) {
  if (end.body < 0) return (end.end - end.point) / h;
  const Flight& flight = bodies[static_cast<std::size_t>(end.body)].flight;
  return flight.v + flight.w.cross(flight.q * end.point);
}

Vector turned_by(const SpringBody& body, const Vector& angular_impulse) {
  if (!body.inertia.turns()) return Vector::Zero();
  const Rotation& q = body.flight.q;
  return q * (q.conjugate() * angular_impulse).cwiseQuotient(body.inertia.moments);
}

/// Inverse mass of an end along n.
double inverse_mass(std::span<const SpringBody> bodies, const SpringEnd& end, const Vector& n) {
  if (end.body < 0) return 0;
  const SpringBody& body = bodies[static_cast<std::size_t>(end.body)];
  const Vector twist = (body.flight.q * end.point).cross(n);
  return 1 / body.inertia.mass + twist.dot(turned_by(body, twist));
}

void apply(std::span<SpringBody> bodies, const SpringEnd& end, const Vector& impulse) {
  if (end.body < 0) return;
  SpringBody& body = bodies[static_cast<std::size_t>(end.body)];
  body.flight.v += impulse / body.inertia.mass;
  body.flight.w += turned_by(body, (body.flight.q * end.point).cross(impulse));
}

double kinetic_energy(std::span<const SpringBody> bodies) {
  double energy_J = 0;
  for (const SpringBody& body : bodies) {
    const Vector w_B = body.flight.q.conjugate() * body.flight.w;
    energy_J += (body.inertia.mass * body.flight.v.squaredNorm() +
                 body.inertia.moments.dot(w_B.cwiseAbs2())) /
                2;
  }
  return energy_J;
}

/// Velocities by loads and drag; the gyroscopic term is left out for this part of a tick.
void push(SpringBody& body, double h) {
  Flight& flight = body.flight;
  const Drag& drag = body.drag;
  const double mass = body.inertia.mass;
  flight.v += h / mass * body.force_W;
  flight.v /= 1 + h / mass * (drag.linear + drag.quadratic * flight.v.norm());
  if (!body.inertia.turns()) return;
  flight.w += turned_by(body, h * (body.torque_W + flight.q * body.torque_B));
  const Vector& J = body.inertia.moments;
  Vector w_B = flight.q.conjugate() * flight.w;
  w_B = J.cwiseProduct(w_B).cwiseQuotient(J + Vector::Constant(h * drag.angular));
  flight.w = flight.q * w_B;
}

void solve(std::span<SpringBody> bodies, std::span<const SpringLink> links, double h) {
  std::vector<Pull> pulls;
  for (const SpringLink& link : links) {
    const Vector d = place(bodies, link.b) - place(bodies, link.a);
    const double length = d.norm();
    pulls.push_back(
        {length > 0 ? Vector(d / length) : Vector(Vector::Zero()), length - link.rest_length, 0});
  }
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (std::size_t i = 0; i < links.size(); ++i) {
      const SpringLink& link = links[i];
      Pull& pull = pulls[i];
      const double strength = link.damping + h * link.stiffness;
      if (pull.n.isZero(0) || strength == 0) continue;
      const double K = inverse_mass(bodies, link.a, pull.n) + inverse_mass(bodies, link.b, pull.n);
      const double softness = 1 / (h * strength);
      const Vector apart = velocity(bodies, link.b, h) - velocity(bodies, link.a, h);
      const double rate = pull.n.dot(apart) + link.stiffness / strength * pull.stretch;
      const double more = -(rate + softness * pull.impulse) / (K + softness);
      pull.impulse += more;
      apply(bodies, link.b, more * pull.n);
      apply(bodies, link.a, -more * pull.n);
    }
  }
}

/// From `start`, with a part of the velocities of `pulled`.
Flight moved_flight(const Flight& start, const Flight& pulled, double scale, double h) {
  Flight end = start;
  end.v = scale * pulled.v;
  end.w = scale * pulled.w;
  end.x += h * end.v;
  end.q = normalised(rotation_exp(h * end.w) * end.q);
  return end;
}

}  // namespace

void spring_impulses(std::span<SpringBody> bodies, std::span<const SpringLink> links, double h) {
  const std::vector<SpringBody> start(bodies.begin(), bodies.end());
  const double start_J = kinetic_energy(bodies) + spring_energy(bodies, links);
  for (SpringBody& body : bodies) push(body, h);
  solve(bodies, links, h);
  const std::vector<SpringBody> pulled(bodies.begin(), bodies.end());
  std::vector<SpringLink> later(links.begin(), links.end());
  for (SpringLink& link : later) {
    link.a.point = link.a.body < 0 ? link.a.end : link.a.point;
    link.b.point = link.b.body < 0 ? link.b.end : link.b.point;
  }
  double scale = 1;
  for (int halving = 0; halving < kHalvings; ++halving, scale /= 2) {
    double allowed_J = start_J;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].flight = moved_flight(start[i].flight, pulled[i].flight, scale, h);
      allowed_J += h * bodies[i].force_W.dot(bodies[i].flight.v);
    }
    if (kinetic_energy(bodies) + spring_energy(bodies, later) <= allowed_J) return;
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    bodies[i].flight = moved_flight(start[i].flight, {}, 1, h);
  }
}

}  // namespace cradle
