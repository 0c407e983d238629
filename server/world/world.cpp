// One tick: find pairs, let balls bounce, collide, fly what is free, sub-step what is in contact,
// check that every number is one, let sleep what is still.
#include "server/world/world.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/collision/bounds.h"
#include "server/collision/fetch.h"
#include "server/collision/index.h"
#include "server/collision/manifolds.h"
#include "server/dynamics/rotation.h"
#include "server/world/ball_pairs.h"
#include "server/world/contact_material.h"
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
constexpr std::size_t kConstraints = 256;     // at a time
constexpr std::size_t kConstraintsAhead = 3;  // of them, what is fetched before it is needed

}  // namespace

// The step's parts, in the order of the step.
struct World::Steps {
  static void list_colliders(State& s);
  static void set_margins(State& s);
  static void find_pairs(State& s, Executor& executor);
  static void find_all_pairs(State& s, Executor& executor);
  static void put_in_boxes(State& s, Executor& executor);
  static void put_in_box(State& s, std::size_t k);
  static void put_ball_in_box(State& s, std::size_t k, std::size_t i);
  static void collide(State& s, Executor& executor);
  static void list_composites(State& s);
  static void list_touching(State& s);
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
  list_touching(s);
  list_contacts(s, executor);
  find_shaken(s);
  prepare(s, executor);
  move_with_springs(s);
  add_drag(s);
  s.solved =
      s.solver->advance(contact_tick(s, executor), s.arrays(), s.inverse_inertia_W, s.constraints);
  stop_unusable(s);
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

/// Who can collide, and room for what they need. Others cost nothing from here on.
void World::Steps::list_colliders(State& s) {
  s.colliders.clear();
  s.collider_ids.clear();
  s.half_spaces.clear();
  s.has_composites = false;
  s.has_parts.assign(s.bodies.size(), 0);
  s.reaches.resize(s.bodies.size());
  for (std::size_t i = 0; i < s.bodies.size(); ++i) {
    const ShapeKind kind = s.bodies.shape[i].kind;
    if (kind != ShapeKind::none && s.can_collide(kind)) {
      s.reaches[i] = s.reach(i);
      s.has_parts[i] = is_composite(kind) ? 1 : 0;
      s.has_composites |= is_composite(kind);
      if (kind == ShapeKind::half_space) {
        s.half_spaces.push_back(static_cast<std::int32_t>(s.colliders.size()));
      }
      s.colliders.push_back(static_cast<std::int32_t>(i));
      s.collider_ids.push_back(s.bodies.id[i]);
    }
  }
  s.boxes.resize(s.colliders.size());
  s.reach_of_tick.resize(s.colliders.size());
  s.moves.resize(s.colliders.size());
  const std::size_t slots = s.colliders.empty() ? 0 : s.bodies.size();
  s.poses.resize(slots);
  s.turned.resize(slots);
  s.turns.assign(slots, 0);
  s.margins.resize(slots);
  s.inverse_inertia_W.resize(slots);
  forget_slots_of_sleepers(s);
}

/// How far ahead contacts are made: as before, unless bodies or gravity are new.
void World::Steps::set_margins(State& s) {
  const double at_rest = kSpeculativeMargin_m + s.dt * s.dt * s.gravity_W.norm();
  if (!s.renumbered && at_rest == s.margin_at_rest) return;
  s.margin_at_rest = at_rest;
  s.margin_max = std::max(at_rest, kMarginOfThin_m);
  for (const std::int32_t slot : s.colliders) {
    const bool is_thin = s.fast.limits[index(slot)].thickness < kMarginOfThin_m;
    s.margins[index(slot)] = is_thin ? s.margin_max : at_rest;
  }
}

/// Boxes that hold each body over the whole tick, and the pairs of them that overlap.
void World::Steps::find_pairs(State& s, Executor& executor) {
  if (s.renumbered) {
    list_colliders(s);
    list_dragged(s);
    measure_fast_limits(s);
    list_balls(s);
  }
  set_margins(s);
  begin_fast_bodies(s);
  begin_balls(s, executor);
  s.planes.clear();
  put_in_boxes(s, executor);
  for (const std::int32_t slot : s.colliders) {
    if (s.fast.is_fast[index(slot)] != 0) list_fast(s, index(slot));
  }
  for (const std::int32_t k : s.half_spaces) {
    const std::size_t i = index(s.colliders[index(k)]);
    if (s.bodies.quarantined[i] != 0) continue;
    const Vector normal = s.poses[i].R.col(2);
    s.planes.push_back({k, normal, normal.dot(s.poses[i].x)});
  }
  if (s.balls.are_apart) find_pairs_beside_balls(s, executor);
  if (!s.balls.are_apart) find_all_pairs(s, executor);
  std::size_t near = 0;  // pairs of boxes that meet by their corners alone are none
  for (const auto [k, m] : s.pairs) {
    const bool is_apart = s.reach_of_tick[index(k)].is_apart(s.reach_of_tick[index(m)]);
    s.pairs[near] = {s.colliders[index(k)], s.colliders[index(m)]};
    near += is_apart ? 0 : 1;
  }
  s.pairs.resize(near);
  s.renumbered = false;
}

/// Of colliders, by number.
void World::Steps::find_all_pairs(State& s, Executor& executor) {
  const bool renumbered = s.renumbered || std::exchange(s.balls.was_told_of_some, false);
  s.culling = s.broad_phase->find_pairs(
      {s.boxes, s.moves, s.planes, renumbered, s.collider_ids, &executor}, s.pairs);
}

/// All but slow balls among themselves: nobody asks how these are turned, or for their boxes.
void World::Steps::put_in_boxes(State& s, Executor& executor) {
  if (!s.balls.are_apart || !s.balls.are_slow) {
    for_each_index(executor, s.colliders.size(), kColliders,
                   [&s](std::size_t k) { put_in_box(s, k); });
    return;
  }
  const std::span<const std::int32_t> others = s.balls.others.colliders;
  for_each_index(executor, others.size(), kColliders,
                 [&](std::size_t k) { put_in_box(s, index(others[k])); });
}

/// Of a collider, by its number.
void World::Steps::put_in_box(State& s, std::size_t k) {
  const std::size_t i = index(s.colliders[k]);
  if (s.balls.could_fly(i)) return put_ball_in_box(s, k, i);
  s.moves[k] = moves_for_pairs(s, i) ? 1 : 0;
  if (s.bodies.is_asleep(i) && s.sleepers.is_box_known[i] != 0) return;
  s.sleepers.is_box_known[i] = s.bodies.is_asleep(i) ? 1 : 0;
  s.reach_of_tick[k] = {};
  const BodyFrame B = s.bodies.frame(i);
  const Pose now{B.p_WBo, B.q_WB.toRotationMatrix()};
  s.turned[i] += way_of_turning(s.poses[i].R, now.R, s.reaches[i]);
  s.poses[i] = now;
  s.turns[i] = nearer_by_turning(s, i);
  s.boxes[k] = {};
  if (s.bodies.quarantined[i] != 0 || s.bodies.shape[i].kind == ShapeKind::half_space) return;
  s.boxes[k] = box_over_tick(s, i);
  if (s.fast.is_fast[i] != 0) return;
  s.reach_of_tick[k] = {now.x, s.reaches[i] + s.margins[i] + s.dt * s.bodies.v[i].norm()};
}

/// Of one that could take part in the impacts of this tick.
void World::Steps::put_ball_in_box(State& s, std::size_t k, std::size_t i) {
  show_ball(s, k, i);
  take_pose_of_ball(s, i);
  if (!s.balls.are_slow) note_if_fast(s, i);
  if (!s.balls.are_apart) s.boxes[k] = box_of_ball(s, s.balls.ball(i));
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
void World::Steps::list_touching(State& s) {
  std::size_t most = s.pairs.size(), count = 0, next = 0;
  for (std::size_t k = 0; k < s.composites_used; ++k) most += s.composites[k].manifolds.size();
  s.touching.resize(most);
  auto meeting = s.fast.meetings.cbegin();
  for (std::size_t k = 0; k < s.pairs.size(); ++k) {
    const bool is_ahead = meeting != s.fast.meetings.cend() && meeting->pair == k;
    const Meeting* ahead = is_ahead ? &*meeting++ : nullptr;
    s.touching[count] = {s.pairs[k], &s.manifolds[k], ahead};  // counts if it touches
    count += s.is_touching[k];
    if (next == s.composites_used || s.composites[next].pair != k) continue;
    for (const Manifold& manifold : s.composites[next].manifolds) {
      s.touching[count++] = {s.pairs[k], &manifold, ahead};
    }
    ++next;
  }
  s.touching.resize(count);
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
               Overlaps& overlaps = s.overlaps_of_parts[part] = {};
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
                 look_at(c);
                 overlaps.add(c);
                 if (!s.settings.collides_twice) continue;
                 overlaps.closing_mps = std::max(overlaps.closing_mps, closing_speed(c, bodies));
               }
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
