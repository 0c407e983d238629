// One tick: find pairs, let balls bounce, collide, fly what is free, sub-step what is in contact,
// check that every number is one, let sleep what is still.
#include "server/world/world.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/collision/fetch.h"
#include "server/collision/index.h"
#include "server/collision/manifolds.h"
#include "server/dynamics/rotation.h"
#include "server/world/contact_material.h"
#include "server/world/find_pairs.h"
#include "server/world/flight.h"
#include "server/world/impact_stops.h"
#include "server/world/load_changes.h"
#include "server/world/narrow.h"
#include "server/world/quarantine.h"
#include "server/world/sleeping.h"
#include "server/world/springs.h"
#include "server/world/state.h"
#include "server/world/step_report.h"
#include "server/world/tick_parts.h"

namespace cradle {
namespace {

/// Worth a thread: enough to fill lanes several times.
constexpr int kPairs = 64, kColliders = 32;
constexpr std::size_t kConstraints = 128;     // at a time
constexpr std::size_t kConstraintsAhead = 3;  // of them, what is fetched before it is needed

}  // namespace

// The step's parts, in the order of the step.
struct World::Steps {
  static void collide(State& s, Executor& executor);
  static void list_composites(State& s);
  static void list_touching(State& s, Executor& executor);
  static void list_contacts(State& s, Executor& executor);
  static void know_in_W(State& s, std::size_t i);
  static void prepare(State& s, Executor& executor);
  static void expect_contact(const State& s, std::size_t k);
  static bool renew(ContactConstraint& c, const Touch& touch, const BodyArrays& bodies,
                    const State& s);
  static void set_up(ContactConstraint& c, const Touch& touch, const BodyArrays& bodies, State& s);
  static void set_material(ContactConstraint& c, const State& s);
  static ContactTick contact_tick(const State& s, Executor& executor);
  static StepReport advance(State& s, bool is_first, Executor& executor, StepObserver* observer);
};

/// In one part, or in two.
StepReport World::step(Executor& executor, StepObserver* observer) {
  const Shift shift(executor);
  State& s = *state_;
  ++s.tick;
  const double dt = s.dt;
  s.parts = parts_of_tick(s);
  s.dt = dt / s.parts;
  StepReport report = Steps::advance(s, true, executor, observer);
  if (s.parts > 1) report = joined(report, Steps::advance(s, false, executor, observer));
  s.dt = dt;
  count_down(s.wrenches);
  let_sleep(s);
  report.sleeping = count_sleepers(s);
  return report;
}

StepReport World::Steps::advance(State& s, bool is_first, Executor& executor,
                                 StepObserver* observer) {
  if (observer != nullptr) observer->enter(Phase::collide);
  gather_loads(s.wrenches, is_first, s.gravity_W, s.bodies, s.loads);
  begin_balance(s, is_first);
  s.lost.assign(s.bodies.size(), 0);
  quarantine_runaways(s);
  find_pairs(s, executor);
  if (s.parts == 1 && strikes_fast(s)) {
    s.parts = 2;
    s.dt /= 2;
    find_pairs(s, executor);
  }
  while (wake_struck(s)) find_pairs(s, executor);
  bounce_balls(s, executor);
  collide(s, executor);
  foresee_impacts(s, executor);

  if (observer != nullptr) observer->enter(Phase::solve);
  list_touching(s, executor);
  list_contacts(s, executor);
  find_shaken(s);
  prepare(s, executor);
  move_with_springs(s);
  add_drag(s);
  s.solved =
      s.solver->advance(contact_tick(s, executor), s.arrays(), s.inverse_inertia_W, s.constraints);
  stop_unusable(s, executor);
  fly_free(s, executor);
  stop_at_impacts(s, executor);
  quarantine_unusable(s);
  end_balance(s);
  return report_of(s);
}

StepReport World::step() {
  SerialExecutor here;
  return step(here);
}

/// The manifolds of all pairs, also of what may touch before the tick ends.
void World::Steps::collide(State& s, Executor& executor) {
  if (!s.settings.is_planar) s.memory.follow(executor, s.pairs, s.bodies.id, s.bodies.shape);
  s.manifolds.resize(s.pairs.size());
  s.is_touching.resize(s.pairs.size());
  list_composites(s);
  executor.for_ranges(static_cast<int>(s.pairs.size()), kPairs, [&](int begin, int end) {
    Narrow narrow(s, end);
    for (int k = begin; k < end; ++k) {
      if (!s.is_composite(s.pairs[index(k)])) narrow.find(index(k));
    }
    narrow.finish();
  });
  executor.for_ranges(static_cast<int>(s.composites_used), 1, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      CompositePair& composite = s.composites[index(k)];
      const BodyPair& pair = s.pairs[composite.pair];
      const double turned = s.turned[index(pair.a)] + s.turned[index(pair.b)];
      const double margin = s.margin(pair);
      const bool remembers = !s.settings.is_planar;
      if (remembers && s.memory.is_apart(composite.pair, s.poses[index(pair.a)],
                                         s.poses[index(pair.b)], turned, margin)) {
        continue;
      }
      const Collider A = s.collider(index(pair.a)), B = s.collider(index(pair.b));
      add_manifolds(A, B, margin, composite.manifolds, s.methods());
      if (!remembers || !composite.manifolds.empty()) continue;
      s.memory.keep_apart(composite.pair, least_distance(A, B, margin));
    }
  });
}

/// The pairs with more than one manifold, none found yet.
void World::Steps::list_composites(State& s) {
  s.composites_used = 0;
  if (!s.has_composites) return;
  for (std::size_t k = 0; k < s.pairs.size(); ++k) {
    if (!s.is_composite(s.pairs[k])) continue;
    s.is_touching[k] = 0;
    if (s.composites_used == s.composites.size()) s.composites.emplace_back();
    CompositePair& composite = s.composites[s.composites_used++];
    composite.pair = k;
    composite.manifolds.clear();
  }
}

/// All manifolds with points, in the order of their pairs.
void World::Steps::list_touching(State& s, Executor& executor) {
  const std::span composites = std::span(s.composites).first(s.composites_used);
  const auto composites_from = [composites](std::size_t pair) {
    return std::ranges::lower_bound(composites, pair, {}, &CompositePair::pair);
  };
  const auto number = [&](std::size_t begin, std::size_t end) {
    std::size_t count = 0;
    for (std::size_t k = begin; k < end; ++k) count += s.is_touching[k];
    for (auto it = composites_from(begin); it != composites.end() && it->pair < end; ++it) {
      count += it->manifolds.size();
    }
    return count;
  };
  const auto write = [&](std::size_t begin, std::size_t end, std::size_t to) {
    auto meeting = std::ranges::lower_bound(s.fast.meetings, begin, {}, &Meeting::pair);
    const auto add = [&](std::size_t k, const Manifold& manifold) {
      while (meeting != s.fast.meetings.end() && meeting->pair < k) ++meeting;
      const bool is_ahead = meeting != s.fast.meetings.end() && meeting->pair == k;
      s.touching[to++] = {s.pairs[k], &manifold, is_ahead ? &*meeting : nullptr};
    };
    auto composite = composites_from(begin);
    const auto add_composites_before = [&](std::size_t k) {
      for (; composite != composites.end() && composite->pair < k; ++composite) {
        for (const Manifold& manifold : composite->manifolds) add(composite->pair, manifold);
      }
    };
    for_marked(s.is_touching, begin, end, [&](std::size_t k) {
      add_composites_before(k);
      add(k, s.manifolds[k]);
    });
    add_composites_before(end);
  };
  s.in_order.list(
      executor, s.pairs.size(), number, [&s](std::size_t count) { s.touching.resize(count); },
      write);
}

/// Who is in contact: these bodies are sub-stepped, with all that acts on them known in W.
void World::Steps::list_contacts(State& s, Executor& executor) {
  BodyTable& bodies = s.bodies;
  std::fill(bodies.in_contact.begin(), bodies.in_contact.end(), std::uint8_t{0});
  for (const Touch& touch : s.touching) {
    bodies.in_contact[index(touch.pair.a)] = bodies.in_contact[index(touch.pair.b)] = 1;
  }
  s.moving.clear();
  s.driven.clear();
  for (const std::int32_t slot : s.colliders) {
    const std::size_t i = index(slot);
    if (bodies.in_contact[i] == 0) continue;
    if (bodies.kind[i] == BodyKind::kinematic) s.driven.push_back(slot);
    if (bodies.kind[i] == BodyKind::dynamic) s.moving.push_back(slot);
  }
  for_each_index(executor, s.colliders.size(), kColliders, [&s](std::size_t k) {
    const std::size_t i = index(s.colliders[k]);
    if (s.bodies.in_contact[i] != 0) know_in_W(s, i);
  });
  s.x_start.resize(s.moving.size());
  s.q_start.resize(s.moving.size());
  for_each_index(executor, s.moving.size(), kColliders, [&s](std::size_t k) {
    s.x_start[k] = s.bodies.x[index(s.moving[k])];
    s.q_start[k] = s.bodies.q[index(s.moving[k])];
  });
  mark_sleepers_in_contact(s);
}

/// What is in contact: its inertia, and what acts on it.
void World::Steps::know_in_W(State& s, std::size_t i) {
  const BodyTable& bodies = s.bodies;
  const bool is_offset = bodies.is_offset[i] != 0;  // the shape's frame is not the principal one
  s.inverse_inertia_W[i] = rotated_diagonal(
      is_offset ? Matrix(bodies.q[i].toRotationMatrix()) : s.poses[i].R, bodies.inverse_inertia[i]);
  if (bodies.kind[i] != BodyKind::dynamic) {
    s.loads.set_to_gravity(i, Vector::Zero());
    return;
  }
  if (s.loads.course[i] == Course::falls) s.loads.set_to_gravity(i, s.gravity_W);
  s.loads.torque_W[i] += bodies.q[i] * s.loads.torque_P[i];
  s.loads.torque_P[i] = Vector::Zero();
  s.loads.course[i] = Course::touches;
}

/// The constraints of this tick, with the forces of the last one.
void World::Steps::prepare(State& s, Executor& executor) {
  std::erase_if(s.touching, [&s](const Touch& touch) {
    return s.bodies.inverse_mass[index(touch.pair.a)] == 0 &&
           s.bodies.inverse_mass[index(touch.pair.b)] == 0;
  });
  turn_inertia(s);
  s.contacts.follow(executor, s.touching.size(), [&s](std::size_t k) {
    const Touch& touch = s.touching[k];
    return ContactName{{s.bodies.id[index(touch.pair.a)], s.bodies.id[index(touch.pair.b)]},
                       touch.manifold->part};
  });
  s.constraints.resize(s.touching.size());
  s.overlaps_of_parts.resize(chunks_of(s.touching.size(), kConstraints));
  const BodyArrays bodies = s.arrays();
  for_chunks(executor, s.touching.size(), kConstraints,
             [&](std::size_t part, std::size_t begin, std::size_t end) {
               ContactMemory last_tick;
               Overlaps overlaps;
               for (std::size_t k = begin; k < end; ++k) {
                 if (k + kConstraintsAhead < end) expect_contact(s, k + kConstraintsAhead);
                 ContactConstraint& c = s.contacts[k];
                 s.constraints[k] = &c;
                 const bool is_renewed = s.contacts.lasts(k) && renew(c, s.touching[k], bodies, s);
                 if (!is_renewed) {
                   s.contacts.recall(k, last_tick);
                   set_up(c, s.touching[k], bodies, s);
                   last_tick.restore(c);
                 }
                 const PointsMet met = look_at(c);
                 overlaps.add(met, c.deepest_m);
                 if (!s.settings.collides_twice) continue;
                 overlaps.closing_mps = std::max(overlaps.closing_mps, closing_speed(c, bodies));
               }
               s.overlaps_of_parts[part] = overlaps;
             });
  s.overlaps = {};
  for (const Overlaps& part : s.overlaps_of_parts) s.overlaps.add(part);
  note_closing(s);
}

/// Fetches what the k-th contact is made of, but for its first body: that is the same for some.
void World::Steps::expect_contact(const State& s, std::size_t k) {
  const Touch& touch = s.touching[k];
  const std::size_t b = index(touch.pair.b);
  s.contacts.expect(k);
  fetch(touch.manifold, sizeof(Manifold));
  fetch(&s.bodies.material[b]);
  fetch(&s.bodies.x[b]);
  fetch(&s.bodies.inverse_mass[b]);
}

/// With the forces of last tick, where the same points meet.
bool World::Steps::renew(ContactConstraint& c, const Touch& touch, const BodyArrays& bodies,
                         const State& s) {
  if (touch.ahead != nullptr || !has_same_points(c, *touch.manifold)) return false;
  const auto [a, b] = touch.pair;
  renew_constraint(c, *touch.manifold, a, b, bodies, s.inverse_inertia_W);
  set_material(c, s);
  return true;
}

/// Without forces.
void World::Steps::set_up(ContactConstraint& c, const Touch& touch, const BodyArrays& bodies,
                          State& s) {
  const auto [a, b] = touch.pair;
  if (touch.ahead != nullptr) {
    set_constraint(c, *touch.ahead, *touch.manifold, s);
  } else {
    set_constraint(c, *touch.manifold, a, b, bodies, s.inverse_inertia_W);
  }
  set_material(c, s);
}

void World::Steps::set_material(ContactConstraint& c, const State& s) {
  const std::size_t a = index(c.a), b = index(c.b);
  const ContactMaterial material = combined(s.bodies.material[a], s.bodies.material[b]);
  c.friction = material.friction;
  c.restitution = material.restitution;
  c.rolling_m = material.rolling_m;
  c.torsional_m = material.torsional_m;
  c.tolerance_m = s.contact_tolerance(a, b);
}

/// What the contact solver is to know beside bodies and constraints.
ContactTick World::Steps::contact_tick(const State& s, Executor& executor) {
  ContactTick tick;
  tick.executor = &executor;
  tick.dt = s.dt;
  tick.sub_steps = (s.settings.sub_steps + s.parts - 1) / s.parts;
  tick.tolerance_m = s.settings.contact_tolerance_m;
  tick.lanes = s.settings.lanes;
  tick.moving = s.moving;
  tick.driven = s.driven;
  tick.is_balanced = s.balance.is_due;
  tick.stirred = s.stirred;
  tick.shaken = s.shaken;
  return tick;
}

}  // namespace cradle
