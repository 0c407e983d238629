#include "server/world/flight.h"

#include "server/dynamics/free_flight.h"
#include "server/dynamics/schemes/scheme.h"
#include "server/world/quarantine.h"

namespace cradle {
namespace {

/// By the world's scheme, with drag.
void fly_alone(World::State& s, std::size_t i) {
  const Course course = s.loads.course[i];
  if (course != Course::falls && course != Course::pushed) return;
  if (course == Course::falls) s.loads.set_to_gravity(i, s.gravity_W);
  const BodyTable& bodies = s.bodies;
  FlightLoads loads;
  loads.force_W = bodies.mass[i] * s.loads.acceleration[i];
  loads.torque_W = s.loads.torque_W[i];
  loads.torque_B = s.loads.torque_P[i];
  loads.drag = bodies.drag[i];
  Flight body{bodies.x[i], bodies.q[i], bodies.v[i], bodies.w[i]};
  Work work;
  s.scheme->advance(body, {bodies.mass[i], bodies.inertia[i]}, loads, s.dt, work);
  end_tick(s, i, body);
}

}  // namespace

void list_dragged(World::State& s) {
  s.dragged.clear();
  for (std::size_t i = 0; i < s.bodies.size(); ++i) {
    if (s.bodies.drag[i].any()) s.dragged.push_back(static_cast<std::int32_t>(i));
  }
}

void add_drag(World::State& s) {
  BodyTable& bodies = s.bodies;
  for (const std::int32_t slot : s.dragged) {
    const auto i = static_cast<std::size_t>(slot);
    const bool has_it_already = !s.is_sprung.empty() && s.is_sprung[i] != 0;
    if (s.loads.course[i] != Course::touches || has_it_already) continue;
    FlightLoads loads;
    loads.force_W = bodies.mass[i] * s.loads.acceleration[i];
    loads.drag = {bodies.drag[i].linear, bodies.drag[i].quadratic, 0};
    Flight end{bodies.x[i], bodies.q[i], bodies.v[i], Vector::Zero()};
    Work work;
    exact(end, {bodies.mass[i], Vector::Zero()}, loads, s.dt, work);
    s.loads.acceleration[i] = (end.v - bodies.v[i]) / s.dt;
    if (bodies.inertia[i].isZero(0)) continue;
    const Vector w_P = bodies.q[i].conjugate() * bodies.w[i];
    const Vector scale = bodies.inertia[i] + Vector::Constant(s.dt * bodies.drag[i].angular);
    const Vector torque_P =
        bodies.drag[i].angular * bodies.inertia[i].cwiseQuotient(scale).cwiseProduct(w_P);
    s.loads.torque_W[i] -= bodies.q[i] * torque_P;
  }
}

void fly_free(World::State& s, Executor& executor) {
  if (s.scheme->advance != exact) {
    for (std::size_t i = 0; i < s.bodies.size(); ++i) fly_alone(s, i);
  } else {
    for (const std::int32_t slot : s.dragged) fly_alone(s, static_cast<std::size_t>(slot));
  }
  const FlightTick tick{s.dt, s.gravity_W, s.settings.lanes};
  const FlightArrays bodies = s.flight_arrays();
  executor.for_ranges(static_cast<int>(s.bodies.size()),
                      [&](int begin, int end) { fly_all(tick, bodies, begin, end); });
}

}  // namespace cradle
