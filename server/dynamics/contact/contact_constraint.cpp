#include "server/dynamics/contact/contact_constraint.h"

#include <algorithm>
#include <cmath>

#include "server/collision/index.h"

namespace cradle {

Vector tangent(const Vector& n) {
  // x cross n, or else y cross n, along the other of x and y and along z. Which one is chance, so
  // that is an index, not a branch.
  const int other = std::abs(n.x()) < 0.57 ? 1 : 0;
  const double sign = 1 - 2 * other, z = n.z(), beside = n[other];
  const double share = sign / std::sqrt(beside * beside + z * z);
  double across[] = {0, 0};
  across[other] = share * z;
  return {across[0], across[1], -share * beside};
}

namespace {

constexpr double kNoLoad =
    1e-9;  ///< m/s^2: what gives less is what rounding left ("half overlapped")

/// From midway between the surfaces to where they would touch if nothing sank in: each body goes
/// back by its share of the overlap, as its mass yields. So a ball on a plane rolls on its own
/// radius, however soft the contact is. The mean of the points, which stay in their plane.
Vector to_undeformed(const ContactConstraint& c, const Manifold& manifold) {
  if (c.inverse_mass_A == c.inverse_mass_B) return Vector::Zero();  // both alike
  double sum = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(manifold.count); ++i) {
    sum += manifold.points[i].separation;
  }
  const double yields = c.inverse_mass_A + c.inverse_mass_B;
  const double share = 0.5 * (c.inverse_mass_B - c.inverse_mass_A) / yields;
  return share * sum / manifold.count * c.n;
}

/// All but what its points carry; the shift of its points from those of the manifold, m.
Vector place(ContactConstraint& c, const Manifold& manifold, std::int32_t a, std::int32_t b,
             const BodyArrays& bodies, const BodyPlace& place_A, const BodyPlace& place_B) {
  c.a = a;
  c.b = b;
  c.part = manifold.part;
  c.n = manifold.normal_W;
  c.inverse_mass_A = bodies.inverse_mass[static_cast<std::size_t>(a)];
  c.inverse_mass_B = bodies.inverse_mass[static_cast<std::size_t>(b)];
  c.inverse_inertia_A = &place_A.inverse_inertia_W;
  c.inverse_inertia_B = &place_B.inverse_inertia_W;
  c.from_B = place_A.x - place_B.x;
  c.friction = c.restitution = c.rolling_m = c.torsional_m = c.press = c.deepest_m = 0;
  c.preload = 0;
  c.carrying = 0;
  c.is_met = c.is_known = c.bounces = false;
  c.t1 = tangent(c.n);
  c.count = static_cast<std::int8_t>(manifold.count);
  return to_undeformed(c, manifold);
}

}  // namespace

void set_constraint(ContactConstraint& c, const Manifold& manifold, std::int32_t a, std::int32_t b,
                    const BodyArrays& bodies, const BodyPlace& place_A, const BodyPlace& place_B) {
  if (c.is_ahead) c.turn_A = c.turn_B = Rotation::Identity();
  c.is_ahead = false;
  if (c.turns_heavily()) c.torque = Vector::Zero();
  if (c.has_rested) c.rests = {};
  c.has_rested = false;
  const Vector aside = place(c, manifold, a, b, bodies, place_A, place_B);
  for (std::size_t i = 0; i < static_cast<std::size_t>(c.count); ++i) {
    ConstraintPoint& p = c.points[i];
    p.rA = manifold.points[i].p_W - place_A.x + aside;
    p.s0 = manifold.points[i].separation;
    p.force_t = Eigen::Vector2d::Zero();
    p.force = p.press = 0;
    c.K_normals[i] = 0;
    c.features[i] = manifold.points[i].feature;
  }
}

bool has_same_points(const ContactConstraint& c, const Manifold& manifold) {
  if (c.count != manifold.count || c.is_ahead || c.has_rested || c.turns_heavily()) return false;
  for (std::size_t i = 0; i < c.used().size(); ++i) {
    if (c.features[i] != manifold.points[i].feature) return false;
  }
  return true;
}

void renew_constraint(ContactConstraint& c, const Manifold& manifold, std::int32_t a,
                      std::int32_t b, const BodyArrays& bodies,
                      std::span<const Matrix> inverse_inertia_W) {
  const auto A = static_cast<std::size_t>(a), B = static_cast<std::size_t>(b);
  const Vector t1 = c.t1, t2 = c.t2();
  const Vector aside = place(c, manifold, a, b, bodies, {bodies.x[A], inverse_inertia_W[A]},
                             {bodies.x[B], inverse_inertia_W[B]});
  c.is_known = true;
  const Vector t2_now = c.t2();
  bool bears = false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(c.count); ++i) {
    ConstraintPoint& p = c.points[i];
    p.rA = manifold.points[i].p_W - bodies.x[A] + aside;
    p.s0 = manifold.points[i].separation;
    const Vector friction = p.force_t.x() * t1 + p.force_t.y() * t2;
    p.force_t = {c.t1.dot(friction), t2_now.dot(friction)};
    bears |= (p.force != 0) | (p.press != 0);
  }
  if (bears) return;
  c.K_normals.fill(c.K_normals[0]);  // one entry tells of all (contact_cache.h)
  for (ConstraintPoint& p : c.used()) p.force_t.setZero();
}

void set_constraint(ContactConstraint& c, const Manifold& manifold, std::int32_t a, std::int32_t b,
                    const BodyArrays& bodies, std::span<const Matrix> inverse_inertia_W) {
  const auto A = static_cast<std::size_t>(a);
  const auto B = static_cast<std::size_t>(b);
  set_constraint(c, manifold, a, b, bodies, BodyPlace{bodies.x[A], inverse_inertia_W[A]},
                 BodyPlace{bodies.x[B], inverse_inertia_W[B]});
}

ContactConstraint make_constraint(const Manifold& manifold, std::int32_t a, std::int32_t b,
                                  const BodyArrays& bodies,
                                  std::span<const Matrix> inverse_inertia_W) {
  ContactConstraint c;
  set_constraint(c, manifold, a, b, bodies, inverse_inertia_W);
  return c;
}

PointsMet look_at(ContactConstraint& c) {
  const double yields = c.inverse_mass_A + c.inverse_mass_B;
  PointsMet met;
  double press = 0, deepest_m = 0;
  int carrying = 0;
  for (const ConstraintPoint& p : c.used()) {  // without branches: it is chance
    const double overlap_m = std::max(0.0, -p.s0);
    met.count += p.s0 <= 0 ? 1 : 0;
    met.overlaps_m += overlap_m;
    deepest_m = std::max(deepest_m, overlap_m);
    press = std::max(press, p.press);
    carrying += p.force * yields > kNoLoad ? 1 : 0;
  }
  c.press = press;
  c.carrying = static_cast<std::int8_t>(carrying);
  c.is_met = met.count > 0;
  c.deepest_m = deepest_m;
  c.bounces = c.restitution > 0;
  return met;
}

double closing_speed(const ContactConstraint& c, const BodyArrays& bodies) {
  const std::size_t a = index(c.a), b = index(c.b);
  double most = 0;
  for (const ConstraintPoint& p : c.used()) {
    const Vector v =
        bodies.v[b] + bodies.w[b].cross(c.rB(p)) - bodies.v[a] - bodies.w[a].cross(p.rA);
    most = std::max(most, -c.n.dot(v));
  }
  return most;
}

void find_effective_masses(ContactConstraint& c) {
  const Matrix &IA = *c.inverse_inertia_A, &IB = *c.inverse_inertia_B;
  const Vector t2 = c.t2();
  for (std::size_t i = 0; i < c.used().size(); ++i) {
    const ConstraintPoint& p = c.points[i];
    const Vector rB = c.rB(p);
    // K(e, f) = e . f (1/mA + 1/mB) + (rA x e) . IA^-1 (rA x f) + (rB x e) . IB^-1 (rB x f)
    const auto K = [&](const Vector& e, const Vector& f) {
      return (c.inverse_mass_A + c.inverse_mass_B) * e.dot(f) +
             p.rA.cross(e).dot(IA * p.rA.cross(f)) + rB.cross(e).dot(IB * rB.cross(f));
    };
    c.K_normals[i] = K(c.n, c.n);
    // The larger eigenvalue of K in the tangent plane, so that a sliding point is always slowed
    // along its own velocity: with the full inverse of K, clamped to the cone, it would be pushed
    // sideways wherever K is not isotropic (a box then stops 10 % too late).
    const double K11 = K(c.t1, c.t1);
    const double K22 = K(t2, t2);
    const double K12 = K(c.t1, t2);
    const double half_difference = (K11 - K22) / 2;
    c.K_tangents[i] = (K11 + K22) / 2 + std::sqrt(half_difference * half_difference + K12 * K12);
  }
}

}  // namespace cradle
