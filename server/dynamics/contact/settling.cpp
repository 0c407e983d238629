// Kinetic damping and the look at what rests.
//
// Source: kinetic damping as Day (1965) has it in dynamic relaxation: where the kinetic energy of a
// structure that swings about its equilibrium is at a peak, it is near it, and all velocities are
// taken. Where we differ: only of swings smaller than the contact tolerance, so that nothing that a
// user could see is slowed down. From rest to the peak is a quarter of a period T, the amplitude
//   A = v / omega = v T / 2 pi = v t 2 / pi,  t the time since the kinetic energy was lowest
// and what rolls or slides on hardly loses any. Measured on a wall of 465 cubes: 3e-4 m/s after 600
// ticks without, 8e-11 m/s after 400 with it.
//
// At rest: all velocities are 0, no load is new, and for every body  m a + sum F = 0,  tau + sum r
// x F = 0, within kSettlingTolerances.balance of its loads; every contact has sunk in by its sag,
// none is beyond its friction. Levers are those of the kernels (contact_method.h): in the plane of
// the manifold's centre.
//
// Order: exact, but for what the tolerance leaves. Cost: 15 ns a point.
#include "server/dynamics/contact/settling.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/collision/index.h"

namespace cradle {
namespace {

struct SettlingTolerances {
  /// Of a body's load that may be left unbalanced at rest: what sinks in by 0.5 mm would move by
  /// 0.05 um ("a wall at rest stays where it is").
  double balance = 1e-4;
  /// m: by which the overlap of a point may differ from the sag that its force asks for ("a block
  /// that is pushed gets what the force does").
  double sag_m = 1e-9;
  /// A peak of kinetic energy is so many times what it was at the lowest ("what rolls on rolls
  /// on").
  double peak = 2;
  /// And it is past where so much is lost in a tick: of what swings 2 omega dt tan(phase), of what
  /// rolls on the error of the step ("what was set going").
  double fall = 1e-3;
};
constexpr SettlingTolerances kSettlingTolerances;

double kinetic_energy(const BodyArrays& bodies, std::size_t i) {
  const Vector w_P = bodies.q[i].conjugate() * bodies.w[i];
  return 0.5 * (bodies.v[i].squaredNorm() / bodies.inverse_mass[i] +
                bodies.inertia[i].dot(w_P.cwiseAbs2()));
}

/// m, of gyration at most.
bool is_still(const BodyArrays& bodies, std::size_t i) {
  return bodies.v[i].isZero(0) && bodies.w[i].isZero(0);
}

/// Whether it may be at rest, but for the balance of its bodies. `give`: sag by acceleration, s^2.
bool may_rest(const ContactConstraint& c, double give) {
  constexpr double kSlack = 1 + kSettlingTolerances.balance;
  double normal = 0;
  bool may = !c.is_ahead;
  for (const ConstraintPoint& p : c.used()) {
    const double preload = c.preload * std::max(c.lasting_load(p) - c.rest(p).load, 0.0);
    const double gap = c.gap(p, give) + give * (c.load(p) - preload);
    normal += p.force;
    may &= p.force > 0 ? std::abs(gap) <= kSettlingTolerances.sag_m
                       : gap >= -kSettlingTolerances.sag_m;
    may &= p.force_t.norm() <= kSlack * c.friction * p.force;
  }
  may &= std::abs(c.n.dot(c.torque)) <= kSlack * c.torsional_m * normal;
  return may && c.n.cross(c.torque).norm() <= kSlack * c.rolling_m * normal;
}

/// m, of what swings about its equilibrium.
double amplitude(const Sway& peak) {
  return 2 * std::numbers::inv_pi * peak.speed_mps * peak.rise_s;
}

/// What a group remembers, from what it did and what it is now; nothing in motion if it is to end
/// here.
Sway sway_after(const Sway& before, const Sway& now, const ContactTick& tick) {
  Sway next = now;
  if (before.bodies != now.bodies) {
    next.low_J = now.kinetic_J;
    return next;
  }
  const bool is_past_peak = now.kinetic_J < (1 - kSettlingTolerances.fall) * before.kinetic_J &&
                            before.kinetic_J > kSettlingTolerances.peak * before.low_J;
  if (is_past_peak && amplitude(before) <= tick.tolerance_m) return {0, 0, 0, 0, now.bodies};
  const bool is_low = is_past_peak || now.kinetic_J <= before.low_J;
  next.low_J = is_low ? now.kinetic_J : before.low_J;
  next.rise_s = is_low ? 0 : before.rise_s + tick.dt;
  return next;
}

}  // namespace

void Settling::find(const ContactTick& tick, const BodyArrays& bodies,
                    std::span<const Matrix> inverse_inertia_W, const Grouping& groups,
                    std::span<ContactConstraint* const> constraints) {
  rests_.resize(groups.count());
  for (std::size_t island = 0; island < rests_.size(); ++island) {
    rests_[island] = !bodies.sway.empty() && groups.has(island) ? 1 : 0;
  }
  unbalanced_mps_ = 0;
  for (std::size_t k = 0; k < tick.moving.size(); ++k) {
    std::uint8_t& rests = rests_[groups.of(k)];
    if (rests != 0 && !is_still(bodies, index(tick.moving[k]))) rests = 0;
  }
  for (const std::int32_t slot : tick.stirred) {  // however little: it may be free to move
    const std::int32_t k = groups.number[index(slot)];
    if (k >= 0) rests_[groups.of(index(k))] = 0;
  }
  if (std::ranges::find(rests_, 1) == rests_.end()) return;
  start_loads(tick, bodies, groups);
  for (std::size_t k = 0; k < constraints.size(); ++k) {
    const std::size_t island = groups.islands.of_constraint(k);
    if (rests_[island] == 0) continue;
    const ContactConstraint& c = *constraints[k];
    const double give = groups.give[island];
    const bool is_driven = !is_still(bodies, index(c.a)) || !is_still(bodies, index(c.b));
    if (is_driven || !may_rest(c, give)) rests_[island] = 0;
    add_contact(c, groups);
  }
  weigh(tick, bodies, inverse_inertia_W, groups);
}

void Settling::start_loads(const ContactTick& tick, const BodyArrays& bodies,
                           const Grouping& groups) {
  loads_.resize(tick.moving.size());
  for (std::size_t k = 0; k < tick.moving.size(); ++k) {
    if (!rests(groups.of(k))) continue;
    const std::size_t i = index(tick.moving[k]);
    loads_[k] = {bodies.acceleration[i] / bodies.inverse_mass[i], bodies.torque[i]};
  }
}

void Settling::add_contact(const ContactConstraint& c, const Grouping& groups) {
  Vector centre = Vector::Zero();
  for (const ConstraintPoint& p : c.used()) centre += p.rA / static_cast<double>(c.count);
  const Vector t2 = c.t2();
  Vector force = Vector::Zero(), torque = c.torque;  // on B, about the centre
  for (const ConstraintPoint& p : c.used()) {
    const Vector one = p.force * c.n + p.force_t.x() * c.t1 + p.force_t.y() * t2;
    const Vector lever = p.rA - centre;
    force += one;
    torque += Vector(lever - c.n * c.n.dot(lever)).cross(one);
  }
  const auto push = [&](std::int32_t slot, const Vector& arm, double sign) {
    const std::int32_t k = groups.number[index(slot)];
    if (k < 0) return;
    loads_[index(k)].force += sign * force;
    loads_[index(k)].torque += sign * (arm.cross(force) + torque);
  };
  push(c.a, centre, -1);
  push(c.b, centre + c.from_B, 1);
}

void Settling::weigh(const ContactTick& tick, const BodyArrays& bodies,
                     std::span<const Matrix> inverse_inertia_W, const Grouping& groups) {
  for (std::size_t k = 0; k < tick.moving.size(); ++k) {
    std::uint8_t& rests = rests_[groups.of(k)];
    const std::size_t i = index(tick.moving[k]);
    if (rests == 0) continue;
    const double left =
        std::max(bodies.inverse_mass[i] * loads_[k].force.norm(),
                 bodies.gyration(i) * (inverse_inertia_W[i] * loads_[k].torque).norm());
    if (!(left <= kSettlingTolerances.balance * bodies.acceleration[i].norm())) rests = 0;
    unbalanced_mps_ = std::max(unbalanced_mps_, rests != 0 ? tick.dt * left : 0);
  }
}

/// The kinetic energies of calm groups, beside what they remember.
void Settling::measure(const ContactTick& tick, const BodyArrays& bodies, const Grouping& groups,
                       std::span<const std::uint8_t> is_calm) {
  sways_.assign(groups.count(), {});
  for (std::size_t k = 0; k < tick.moving.size(); ++k) {
    const std::size_t i = index(tick.moving[k]);
    if (is_calm[groups.of(k)] == 0) continue;
    Sway& now = sways_[groups.of(k)];
    const double speed = bodies.v[i].norm() + bodies.gyration(i) * bodies.w[i].norm();
    now.kinetic_J += kinetic_energy(bodies, i);
    now.speed_mps = std::max(now.speed_mps, speed);
    now.bodies += 1;
  }
}

void Settling::damp(const ContactTick& tick, const BodyArrays& bodies, const Grouping& groups,
                    std::span<const std::uint8_t> is_calm, ContactBalance& balance) {
  ends_.assign(groups.count(), 0);
  if (bodies.sway.empty()) return;
  measure(tick, bodies, groups, is_calm);
  std::size_t seen = 0;  // groups: they are numbered by their first bodies, which remember
  for (std::size_t k = 0; k < tick.moving.size(); ++k) {
    const std::size_t island = groups.of(k), i = index(tick.moving[k]);
    const bool is_first = island == seen;
    seen += is_first ? 1 : 0;
    if (!groups.has(island)) continue;
    const Sway before = bodies.sway[i];
    bodies.sway[i] = {};
    if (is_first) {
      bodies.sway[i] = sway_after(before, sways_[island], tick);
      ends_[island] = bodies.sway[i].kinetic_J < sways_[island].kinetic_J ? 1 : 0;
    }
    if (ends_[island] == 0) continue;
    if (tick.is_balanced) {
      const double kinetic_J = kinetic_energy(bodies, i);
      const Vector momentum = bodies.v[i] / bodies.inverse_mass[i];
      balance.kinetic_J -= kinetic_J;
      balance.impacts_J -= kinetic_J;
      balance.momentum -= momentum;
      balance.contacts_Ns -= momentum;
    }
    bodies.v[i].setZero();
    bodies.w[i].setZero();
  }
}

}  // namespace cradle
