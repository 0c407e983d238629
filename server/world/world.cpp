// One tick: find pairs, collide, fly what is free, sub-step what is in contact, remember the
// impulses, check that every number is one.
#include "server/world/world.h"

#include <algorithm>
#include <cmath>

#include "server/collision/bounds.h"
#include "server/collision/narrow_phase.h"
#include "server/dynamics/free_flight.h"
#include "server/dynamics/rotation.h"
#include "server/world/quarantine.h"
#include "server/world/springs.h"
#include "server/world/state.h"

namespace cradle {
namespace {

/// Contacts are made this far ahead of touching, m: several times the sag of a resting contact, so
/// that a body at rest never loses its contacts ("a stack of ten cubes stands").
constexpr double kSpeculativeMargin_m = 0.02;

std::size_t index(std::int32_t slot) { return static_cast<std::size_t>(slot); }

}  // namespace

// The step's parts, in the order of the step.
struct World::Steps {
  static void find_pairs(State& s);
  static void collide(State& s, Executor& executor);
  static void prepare(State& s);
  static void add_drag(State& s);
  static void fly_free(State& s);
  static StepReport report(const State& s);
};

StepReport World::step(Executor& executor, StepObserver* observer) {
  State& s = *state_;
  ++s.tick;
  if (observer != nullptr) observer->enter(Phase::collide);
  begin_tick(s.wrenches, s.gravity_W, s.bodies, s.loads);
  quarantine_runaways(s);
  Steps::find_pairs(s);
  Steps::collide(s, executor);

  if (observer != nullptr) observer->enter(Phase::solve);
  Steps::prepare(s);
  move_with_springs(s);
  Steps::add_drag(s);
  s.contacts.restore(s.bodies.id, s.constraints);
  s.solver->advance({s.dt, s.settings.sub_steps, s.moving, s.driven}, s.arrays(),
                    s.inverse_inertia_W, s.constraints);
  Steps::fly_free(s);
  s.contacts.store(s.bodies.id, s.constraints);
  quarantine_unusable(s);
  return Steps::report(s);
}

StepReport World::step() {
  SerialExecutor here;
  return step(here);
}

/// Boxes that hold each body over the whole tick, and the pairs of them that overlap.
void World::Steps::find_pairs(State& s) {
  const std::size_t n = s.bodies.size();
  s.x_start = s.bodies.x;
  s.q_start = s.bodies.q;
  s.poses.resize(n);
  s.boxes.resize(n);
  s.moves.resize(n);
  s.planes.clear();
  for (std::size_t i = 0; i < n; ++i) {
    const BodyFrame B = s.bodies.frame(i);
    s.poses[i] = {B.p_WBo, B.q_WB.toRotationMatrix()};
    s.moves[i] = s.bodies.is_moving(i) ? 1 : 0;
    s.boxes[i] = {};
    if (s.bodies.quarantined[i] != 0) continue;
    if (s.bodies.shape[i].kind == ShapeKind::half_space) {
      const Vector normal = s.poses[i].R.col(2);
      s.planes.push_back({static_cast<std::int32_t>(i), normal, normal.dot(s.poses[i].x)});
      continue;
    }
    s.boxes[i] =
        swept(bounds(s.bodies.shape[i], s.poses[i]), s.dt * s.bodies.v[i], kSpeculativeMargin_m);
  }
  s.broad_phase->find_pairs({s.boxes, s.moves, s.planes, s.renumbered}, s.pairs);
  s.renumbered = false;
}

/// One manifold a pair, also for what may touch before the tick ends.
void World::Steps::collide(State& s, Executor& executor) {
  s.manifolds.resize(s.pairs.size());
  executor.for_ranges(static_cast<int>(s.pairs.size()), [&s](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const auto [a, b] = s.pairs[index(k)];
      const std::size_t A = index(a);
      const std::size_t B = index(b);
      const double margin = kSpeculativeMargin_m + s.dt * (s.bodies.v[B] - s.bodies.v[A]).norm();
      s.manifolds[index(k)] =
          cradle::collide(s.bodies.shape[A], s.poses[A], s.bodies.shape[B], s.poses[B], margin);
    }
  });
}

/// The constraints of this tick, and who takes part in them.
void World::Steps::prepare(State& s) {
  BodyTable& bodies = s.bodies;
  s.inverse_inertia_W.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const bool is_offset = bodies.is_offset[i] != 0;  // the shape's frame is not the principal one
    s.inverse_inertia_W[i] =
        rotated_diagonal(is_offset ? Matrix(bodies.q[i].toRotationMatrix()) : s.poses[i].R,
                         bodies.inverse_inertia[i]);
  }
  std::fill(bodies.in_contact.begin(), bodies.in_contact.end(), std::uint8_t{0});
  s.constraints.clear();
  for (std::size_t k = 0; k < s.pairs.size(); ++k) {
    if (s.manifolds[k].count == 0) continue;
    const auto [a, b] = s.pairs[k];
    const Material& A = bodies.material[index(a)];
    const Material& B = bodies.material[index(b)];
    ContactConstraint& c = s.constraints.emplace_back(
        make_constraint(s.manifolds[k], a, b, s.arrays(), s.inverse_inertia_W));
    c.friction = std::sqrt(A.friction * B.friction);
    c.restitution = std::max(A.restitution, B.restitution);
    bodies.in_contact[index(a)] = bodies.in_contact[index(b)] = 1;
  }
  s.moving.clear();
  s.driven.clear();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies.in_contact[i] == 0) continue;
    if (bodies.kind[i] == BodyKind::dynamic) s.moving.push_back(static_cast<std::int32_t>(i));
    if (bodies.kind[i] == BodyKind::kinematic) s.driven.push_back(static_cast<std::int32_t>(i));
  }
}

/// Bodies in contact feel the mean of their drag over the tick, as it would be without contact: so
/// it brings them to rest at most, however strong it is.
void World::Steps::add_drag(State& s) {
  BodyTable& bodies = s.bodies;
  for (const std::int32_t slot : s.moving) {
    const std::size_t i = index(slot);
    if (!bodies.drag[i].any() || s.is_sprung[i] != 0) continue;
    FlightLoads loads;
    loads.force_W = bodies.mass[i] * s.loads.acceleration[i];
    loads.drag = {bodies.drag[i].linear, bodies.drag[i].quadratic, 0};
    Flight end{bodies.x[i], bodies.q[i], bodies.v[i], Vector::Zero()};
    Work work;
    exact(end, {bodies.mass[i], Vector::Zero()}, loads, s.dt, work);
    s.loads.acceleration[i] = (end.v - bodies.v[i]) / s.dt;
    if (bodies.inertia[i].isZero(0)) continue;
    const Vector w_B = bodies.q[i].conjugate() * bodies.w[i];
    const Vector scale = bodies.inertia[i] + Vector::Constant(s.dt * bodies.drag[i].angular);
    const Vector torque_B =
        bodies.drag[i].angular * bodies.inertia[i].cwiseQuotient(scale).cwiseProduct(w_B);
    s.loads.torque[i] -= bodies.q[i] * torque_B;
  }
}

/// Dynamic bodies without contact by the world's scheme, and kinematic ones: one step each.
void World::Steps::fly_free(State& s) {
  BodyTable& bodies = s.bodies;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const bool is_driven = bodies.kind[i] == BodyKind::kinematic;
    const bool is_free = bodies.is_moving(i) && bodies.in_contact[i] == 0;
    if ((!is_driven && !is_free) || bodies.quarantined[i] != 0 || s.has_moved[i] != 0) continue;
    Flight flight{bodies.x[i], bodies.q[i], bodies.v[i], bodies.w[i]};
    const Vector none = Vector::Zero();
    if (is_free && (s.scheme->advance != exact || bodies.drag[i].any())) {
      FlightLoads loads;
      loads.force_W = bodies.mass[i] * s.loads.acceleration[i];
      loads.torque_W = s.loads.torque[i];
      loads.drag = bodies.drag[i];
      Work work;
      s.scheme->advance(flight, {bodies.mass[i], bodies.inertia[i]}, loads, s.dt, work);
    } else {
      fly(flight, s.dt, is_driven ? none : s.loads.acceleration[i],
          is_driven ? none : s.loads.torque[i], is_driven ? none : bodies.inertia[i]);
    }
    bodies.x[i] = flight.x;
    bodies.q[i] = flight.q;
    bodies.v[i] = flight.v;
    bodies.w[i] = flight.w;
  }
}

StepReport World::Steps::report(const State& s) {
  StepReport report;
  double sum = 0;
  for (const ContactConstraint& c : s.constraints) {
    for (const ConstraintPoint& p : c.used()) {
      if (p.s0 > 0) continue;
      ++report.contacts;
      sum -= p.s0;
      report.penetration_max_m = std::max(report.penetration_max_m, -p.s0);
    }
  }
  if (report.contacts > 0) report.penetration_mean_m = sum / report.contacts;
  report.bodies_in_contact = static_cast<int>(s.moving.size());
  report.springs_unconverged = s.springs_unconverged;
  return report;
}

}  // namespace cradle
