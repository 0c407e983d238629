#include "server/world/flight.h"

#include <algorithm>

#include "server/dynamics/free_flight.h"
#include "server/dynamics/schemes/scheme.h"
#include "server/world/quarantine.h"

namespace cradle {
namespace {

/// Worth a thread: one by one, and side by side.
constexpr int kFlights = 16, kFlightsInLanes = 256;

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
  if (work.unsolved > 0) s.unsolved[i] = 1;
  end_tick(s, i, body);
}

/// In the full model all that moves does so by loads of its own, at one rate.
FlightTick flight_tick(World::State& s) {
  FlightTick tick{s.dt, s.gravity_W, s.settings.lanes, 0, s.settings.is_planar};
  if (!s.settings.is_full) return tick;
  double most = 1;
  for (std::size_t i = 0; i < s.bodies.size(); ++i) {
    if (s.loads.course[i] == Course::falls) {
      s.loads.set_to_gravity(i, s.gravity_W);
      s.loads.course[i] = Course::pushed;
    }
    if (s.loads.course[i] != Course::pushed) continue;
    most = std::max(most, flight_need(tick, s.flight_arrays(), i).steps);
  }
  tick.full_steps = kFullModel * most;
  return tick;
}

void keep_accounts(World::State& s, const FlightTick& tick) {
  const BodyTable& b = s.bodies;
  s.accounts.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) {
    FlightAccount& account = s.accounts[i];
    account = {};
    account.course = s.loads.course[i];
    account.start = {b.x[i], b.q[i], b.v[i], b.w[i]};
    account.mass = b.mass[i];
    account.inertia = b.inertia[i];
    account.offset_m = b.p_BoBcm[i].norm();
    if (account.course >= Course::touches) continue;
    account.need = flight_need(tick, s.flight_arrays(), i);
    if (account.course != Course::pushed) continue;
    account.torque_W = s.loads.torque_W[i];
    account.torque_P = s.loads.torque_P[i];
  }
  for (const Loads::OfBody& one : s.loads.resultants) {
    s.accounts[static_cast<std::size_t>(one.slot)].resultants.push_back(one.resultant);
  }
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
  s.unsolved.clear();
  if (s.scheme->advance != exact || !s.dragged.empty()) s.unsolved.assign(s.bodies.size(), 0);
  if (s.scheme->advance != exact) {
    executor.for_ranges(static_cast<int>(s.bodies.size()), kFlights, [&s](int begin, int end) {
      for (int i = begin; i < end; ++i) fly_alone(s, static_cast<std::size_t>(i));
    });
  } else {
    executor.for_ranges(static_cast<int>(s.dragged.size()), kFlights, [&s](int begin, int end) {
      for (int k = begin; k < end; ++k) {
        fly_alone(s, static_cast<std::size_t>(s.dragged[static_cast<std::size_t>(k)]));
      }
    });
  }
  const FlightTick tick = flight_tick(s);
  if (s.keeps_accounts) keep_accounts(s, tick);
  const FlightArrays bodies = s.flight_arrays();
  executor.for_ranges(static_cast<int>(s.bodies.size()), kFlightsInLanes,
                      [&](int begin, int end) { fly_all(tick, bodies, begin, end); });
}

}  // namespace cradle
