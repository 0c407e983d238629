#include "server/world/balance.h"

#include <algorithm>

#include "server/world/state.h"

namespace cradle {
namespace {

bool has_only_constant_force(const World::State& s, std::size_t i) {
  if (s.bodies.drag[i].any()) return false;
  const bool is_sprung = std::ranges::any_of(s.springs, [&](const Spring& spring) {
    return spring.a.value == s.bodies.id[i] || spring.b.value == s.bodies.id[i];
  });
  if (is_sprung) return false;
  return s.loads.course[i] == Course::falls ||
         (s.loads.torque_W[i].isZero(0) && s.loads.torque_P[i].isZero(0));
}

void list_flyers(World::State& s) {
  for (std::size_t i = 0; i < s.bodies.size(); ++i) {
    const Course course = s.loads.course[i];
    if (course != Course::falls && course != Course::pushed) continue;
    if (has_only_constant_force(s, i)) {
      s.balance.flyers.push_back({static_cast<std::int32_t>(i), s.bodies.x[i], momentum_of(s, i)});
    }
  }
}

/// Gravity and one force, on a body that had no contact.
void add_flyer(World::State& s, const Balance::Flyer& flyer) {
  const auto i = static_cast<std::size_t>(flyer.slot);
  if (s.bodies.in_contact[i] != 0 || s.bodies.quarantined[i] != 0) return;
  const Momentum now = momentum_of(s, i);
  const double mass = s.bodies.mass[i];
  const bool is_pushed = std::ranges::binary_search(s.loads.pushed, flyer.slot);
  const Vector way = s.bodies.x[i] - flyer.x;
  StepBalance& tick = s.balance.tick;
  const double gravity_J = mass * s.gravity_W.dot(way);
  const Vector acceleration = is_pushed ? s.loads.acceleration[i] : s.gravity_W;
  tick.kinetic_J += now.kinetic_J - flyer.momentum.kinetic_J;
  tick.gravity_J += gravity_J;
  tick.wrenches_J += mass * acceleration.dot(way) - gravity_J;
  s.balance.momentum_unaccounted +=
      now.linear_Ns - flyer.momentum.linear_Ns - s.dt * mass * acceleration;
}

}  // namespace

Momentum momentum_of(const World::State& s, std::size_t i) {
  const BodyTable& bodies = s.bodies;
  const Vector p = bodies.mass[i] * bodies.v[i];
  const Vector w_P = bodies.q[i].conjugate() * bodies.w[i];
  return {0.5 * (p.dot(bodies.v[i]) + bodies.inertia[i].dot(w_P.cwiseAbs2())), p};
}

Momentum momentum_before(const World::State& s, std::size_t i) {
  return s.balance.is_due ? momentum_of(s, i) : Momentum{};
}

void begin_balance(World::State& s, bool is_first) {
  const int every = s.settings.balance_every;
  s.balance.is_due = every > 0 && s.tick % every == 0;
  s.balance.flyers.clear();
  if (!s.balance.is_due) return;
  if (is_first) {
    s.balance.tick = {};
    s.balance.tick.tick = s.tick;
    s.balance.momentum_unaccounted = Vector::Zero();
    s.balance.tick.kinetic_J = s.balance.tick.wrenches_J = s.loads.impulses_J;
  }
  if (s.settings.balance_flight) list_flyers(s);
}

void end_balance(World::State& s) {
  if (!s.balance.is_due) return;
  for (const Balance::Flyer& flyer : s.balance.flyers) add_flyer(s, flyer);
  StepBalance& tick = s.balance.tick;
  const ContactBalance& contacts = s.solved.balance;
  const double gravity_J = s.gravity_W.dot(contacts.mass_way);
  tick.kinetic_J += contacts.kinetic_J;
  tick.gravity_J += gravity_J;
  tick.wrenches_J += contacts.loads_J - gravity_J;
  tick.friction_J += contacts.friction_J;
  tick.impacts_J += contacts.impacts_J;
  tick.driven_J += contacts.driven_J;
  tick.unaccounted_J = tick.kinetic_J - tick.gravity_J - tick.wrenches_J - tick.friction_J -
                       tick.impacts_J - tick.driven_J;
  s.balance.momentum_unaccounted += contacts.momentum - contacts.loads_Ns - contacts.contacts_Ns;
  tick.momentum_unaccounted_Ns = s.balance.momentum_unaccounted.norm();
}

void add_ball(World::State& s, std::size_t i, const Vector& x, const Momentum& before) {
  if (!s.balance.is_due) return;
  const Momentum now = momentum_of(s, i);
  const Vector way = s.bodies.x[i] - x;
  const double taken = now.kinetic_J - before.kinetic_J - s.bodies.mass[i] * s.gravity_W.dot(way);
  s.balance.tick.impacts_J += taken;
  if (s.settings.balance_flight) {  // its flight tells the rest
    s.balance.momentum_unaccounted -= now.linear_Ns - before.linear_Ns;
    return;
  }
  s.balance.tick.kinetic_J += taken;
}

void add_unaccounted(World::State& s, std::size_t i, const Vector& x, const Momentum& before) {
  if (!s.balance.is_due) return;
  const bool is_flyer = std::ranges::any_of(
      s.balance.flyers, [i](const auto& f) { return static_cast<std::size_t>(f.slot) == i; });
  if (is_flyer && s.bodies.in_contact[i] == 0) return;  // its flight tells
  const Momentum now = momentum_of(s, i);
  s.balance.tick.kinetic_J += now.kinetic_J - before.kinetic_J;
  s.balance.tick.gravity_J += s.bodies.mass[i] * s.gravity_W.dot(s.bodies.x[i] - x);
  s.balance.momentum_unaccounted += now.linear_Ns - before.linear_Ns;
}

}  // namespace cradle
