/// The solver's view of a manifold, and of the bodies it joins.
///
/// Frame W, about the centres of mass. Symbols: n normal from A to B, t1 t2 tangents, rA rB arms
/// from the centres to the point, s separation (m), lambda impulses (N s), K inverse effective
/// mass.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/fetch.h"
#include "server/collision/manifold.h"

namespace cradle {

/// What a group of bodies in contact remembers of its motion; its first body keeps it.
struct Sway {
  double kinetic_J = 0;  ///< at the last tick's end
  double low_J = 0;      ///< where it was lowest, since the last peak
  double rise_s = 0;     ///< since then
  double speed_mps = 0;  ///< of its fastest body, at the last tick's end
  double bodies = 0;     ///< in it; 0: nothing is remembered
};

/// Which method moved a body's group in the last tick in which it was in contact, of those that
/// "hybrid" chooses from; and what it remembers of attempts: newton/hand_over.h.
struct Poise {
  enum Method : std::int32_t { none, soft, newton };
  Method method = none;
  std::int32_t cool = 0;      ///< ticks until the next attempt
  std::int32_t free = 0;      ///< ticks in which nobody ends its sway
  std::int32_t fails = 0;     ///< attempts in vain since it last moved fast
  std::int32_t stiff_as = 1;  ///< as ContactTick has it, when it was last moved by soft steps
  /// 1: some contact of it rests elsewhere than it touches (PointRest).
  std::int32_t has_rested = 0;
  std::int32_t busy = 0;  ///< ticks in which it took iterations of Newton's method, less others
};

/// The bodies' arrays, one a quantity, indexed by slot. Owned by the world.
struct BodyArrays {
  std::span<Vector> x;                      ///< m, in W
  std::span<Rotation> q;                    ///< q_WB
  std::span<Vector> v;                      ///< m/s, in W
  std::span<Vector> w;                      ///< rad/s, in W
  std::span<const double> inverse_mass;     ///< 1/kg; 0 for bodies that do not yield
  std::span<const Vector> inertia;          ///< principal moments J in B, kg m^2
  std::span<const Vector> inverse_inertia;  ///< of J; 0: does not turn
  std::span<const Vector> acceleration;     ///< m/s^2, in W: gravity and forces of this tick
  std::span<const Vector> torque;           ///< N m, in W, of this tick
                                            ///< both of bodies in contact only
  /// Of bodies that are round in shape and inertia, about an axis: the moment about it by that
  /// across it; else 0. Empty: all 0.
  std::span<const double> axial_share = {};
  std::span<Vector> x_rest =
      {};                       ///< m: what rounding has left out of x, for the next tick. Or empty
  std::span<Sway> sway = {};    ///< empty: nothing comes to rest before its velocities are 0
  std::span<Poise> poise = {};  ///< empty: nothing is remembered

  /// It moves without yielding: a kinematic body.
  bool is_driven(std::size_t i) const {
    return inverse_mass[i] == 0 && !(v[i].isZero(0) && w[i].isZero(0));
  }
  /// m, of a body that yields: the largest radius of gyration.
  double gyration(std::size_t i) const {
    return std::sqrt(inertia[i].maxCoeff() * inverse_mass[i]);
  }
};

/// A force may fall by so much before less is preloaded.
inline constexpr double kPreloadExcess = 1.1;

// Kernels read and write whole lines of eight numbers of it, here and below: contact_block.h says
// which.
struct alignas(64) ConstraintPoint {
  Vector rA;                                          ///< m
  double s0 = 0;                                      ///< separation at the tick's start
  Eigen::Vector2d force_t = Eigen::Vector2d::Zero();  ///< N
  double force = 0;                                   ///< N: lambda over its sub-step
  double press = 0;  ///< m/s^2: what `force` alone would give, as far as it lasts: soft_step.cpp
};
static_assert(sizeof(ConstraintPoint) == 64);

/// Where a point is at rest under a load, whatever the method: newton/hand_over.h.
struct PointRest {
  double m = 0;
  double load = 0;  ///< m/s^2, as `press`

  bool is_none() const { return m == 0 && load == 0; }
};

/// Of a point that is solved by itself; blocks have their own.
struct PointImpulse {
  Eigen::Vector2d lambda_t = Eigen::Vector2d::Zero();  ///< of a sub-step
  double lambda = 0;                                   ///< normal, >= 0
  double s = 0;                                        ///< separation at the last evaluation
};

// What every tick writes and reads of most contacts comes first, and has as few lines as can be: it
// is memory that a heap of thousands waits for.
struct alignas(64) ContactConstraint {
  Vector n, t1;
  double friction = 0;
  double preload = 0;  ///< share of a load that lasts by which it does not sink in: soft_step.cpp

  Vector from_B;                                  ///< m, from B's centre to A's
  double inverse_mass_A = 0, inverse_mass_B = 0;  ///< 1/kg
  double restitution = 0;
  std::uint64_t part = 0;  ///< as in the manifold
  /// 1/(kg m^2), in W, at the attitudes for which the arms hold. Owned by whoever made this.
  const Matrix* inverse_inertia_A = nullptr;

  // What methods ask for before they choose: one line.
  std::int32_t a = 0, b = 0;  ///< slots
  std::int8_t count = 0;
  std::int8_t carrying = 0;               ///< points with a force at the tick's start
  bool bounces = false;                   ///< with restitution
  bool is_ahead = false;                  ///< the arms hold for other attitudes than those of then
  bool is_met = false;                    ///< a point without a gap there
  bool is_known = false;                  ///< there was one like it in the tick before
  bool has_rested = false;                ///< `rests` are not all 0, or may be
  double press = 0;                       ///< m/s^2: the largest of its points at the tick's start
  double tolerance_m = 0;                 ///< what it may sink in by; 0: the tick's
  double deepest_m = 0;                   ///< overlap of its points at the tick's start
  double rolling_m = 0, torsional_m = 0;  ///< greatest torques by the sum of normal forces
  const Matrix* inverse_inertia_B = nullptr;

  // By point:
  std::array<double, kManifoldPoints> K_normals{};  ///< 1/kg; until the solver sets them, those of
                                                    ///< the tick before
  std::array<std::uint32_t, kManifoldPoints> features{};  ///< as in the manifold

  std::array<ConstraintPoint, kManifoldPoints> points;

  // What most contacts have no use for.
  std::array<PointRest, kManifoldPoints> rests;        ///< all 0 unless `has_rested`
  std::array<PointImpulse, kManifoldPoints> impulses;  ///< of contacts that are solved one by one
  /// Likewise: 1/kg, the largest in the tangent plane.
  std::array<double, kManifoldPoints> K_tangents{};
  Vector torque = Vector::Zero();  ///< N m, in W, on B: of rolling and torsional friction
  /// From the attitudes at the tick's start to those for which the arms hold; none unless
  /// `is_ahead`.
  Rotation turn_A = Rotation::Identity(), turn_B = Rotation::Identity();

  Vector t2() const { return n.cross(t1); }
  /// m, to one of its points.
  Vector rB(const ConstraintPoint& p) const { return p.rA + from_B; }
  // Of one of its points.
  std::size_t index(const ConstraintPoint& p) const {
    return static_cast<std::size_t>(&p - points.data());
  }
  double K_normal(const ConstraintPoint& p) const { return K_normals[index(p)]; }
  double K_tangent(const ConstraintPoint& p) const { return K_tangents[index(p)]; }
  const PointRest& rest(const ConstraintPoint& p) const { return rests[index(p)]; }
  PointImpulse& impulse(const ConstraintPoint& p) { return impulses[index(p)]; }
  const PointImpulse& impulse(const ConstraintPoint& p) const { return impulses[index(p)]; }
  void set_rest(const ConstraintPoint& p, const PointRest& rest) {
    rests[index(p)] = rest;
    has_rested |= !rest.is_none();
  }
  /// m/s^2: what its force alone gives.
  double load(const ConstraintPoint& p) const { return p.force * K_normal(p); }
  /// m/s^2: what a preload goes by. Not the force itself: one that is preloaded by what it was a
  /// tick ago drives what sways ("heaps of cubes come to rest").
  double lasting_load(const ConstraintPoint& p) const {
    return std::min(p.press, kPreloadExcess * p.force * K_normal(p));
  }
  /// m, as the method sees it that lets a load of 1 m/s^2 sink in by `give`, s^2.
  double gap(const ConstraintPoint& p, double give) const {
    return p.s0 - rest(p).m - give * rest(p).load;
  }

  bool turns_heavily() const { return rolling_m > 0 || torsional_m > 0; }
  std::span<ConstraintPoint> used() { return {points.data(), static_cast<std::size_t>(count)}; }
  std::span<const ConstraintPoint> used() const {
    return {points.data(), static_cast<std::size_t>(count)};
  }
};

/// Fetches the line of choices of a constraint a few ahead of the k-th: they are far from each
/// other in memory, and to wait for one takes longer than to look at it.
inline void expect_next(std::span<ContactConstraint* const> constraints, std::size_t k) {
  constexpr std::size_t kAhead = 8;
  if (k + kAhead < constraints.size()) fetch(&constraints[k + kAhead]->a);
}

/// A unit vector across the unit vector n; smooth in n but for one switch of the helper axis.
Vector tangent(const Vector& n);

/// Where a body is when its manifold holds.
struct BodyPlace {
  Vector x;                         ///< Bcm, m, in W
  const Matrix& inverse_inertia_W;  ///< 1/(kg m^2); lasts as long as the constraint
};

/// Overwrites `c` with the constraint of a manifold of bodies that are in these places, without
/// forces yet.
void set_constraint(ContactConstraint& c, const Manifold& manifold, std::int32_t a, std::int32_t b,
                    const BodyArrays& bodies, const BodyPlace& place_A, const BodyPlace& place_B);

/// Likewise, at the bodies' present poses. `inverse_inertia_W` is indexed by slot, and lasts as
/// long as the constraint.
void set_constraint(ContactConstraint& c, const Manifold& manifold, std::int32_t a, std::int32_t b,
                    const BodyArrays& bodies, std::span<const Matrix> inverse_inertia_W);
/// Whether nothing of it but its points carries, and these are the manifold's, one by one.
bool has_same_points(const ContactConstraint& c, const Manifold& manifold);
/// Likewise, where that is so: they carry what they did.
void renew_constraint(ContactConstraint& c, const Manifold& manifold, std::int32_t a,
                      std::int32_t b, const BodyArrays& bodies,
                      std::span<const Matrix> inverse_inertia_W);
ContactConstraint make_constraint(const Manifold& manifold, std::int32_t a, std::int32_t b,
                                  const BodyArrays& bodies,
                                  std::span<const Matrix> inverse_inertia_W);

/// Of a constraint at the tick's start: those without a gap, and the sum of their overlaps, m.
struct PointsMet {
  int count = 0;
  double overlaps_m = 0;
};

/// Sets what is known of a constraint at a glance: press, carrying, is_met, deepest_m, bounces.
/// Once its forces and material are set.
PointsMet look_at(ContactConstraint& c);

/// m/s, of the point that closes fastest, if any does.
double closing_speed(const ContactConstraint& c, const BodyArrays& bodies);

/// K of each point.
void find_effective_masses(ContactConstraint& c);

}  // namespace cradle
