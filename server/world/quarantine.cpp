#include "server/world/quarantine.h"

#include <cradle/limits.h>

#include <algorithm>

#include "server/collision/in_order.h"
#include "server/collision/index.h"
#include "server/world/balance.h"
#include "server/world/edit.h"
#include "server/world/plane.h"

namespace cradle {
namespace {

constexpr int kBodies = 128;  // worth a thread, at some nanoseconds each

Result check(const Vector& x, const Rotation& q, const Vector& v, const Vector& w) {
  if (!(x.allFinite() && q.coeffs().allFinite() && v.allFinite() && w.allFinite())) {
    return Result::not_finite;
  }
  const bool is_within = x.cwiseAbs().maxCoeff() <= limits::kPositionMax_m &&
                         v.cwiseAbs().maxCoeff() <= limits::kSpeedMax_mps &&
                         w.cwiseAbs().maxCoeff() <= limits::kAngularSpeedMax_radps;
  return is_within ? Result::ok : Result::out_of_range;
}

void quarantine(World::State& s, std::size_t i, Result reason) {
  BodyTable& bodies = s.bodies;
  bodies.v[i] = bodies.w[i] = Vector::Zero();
  bodies.quarantined[i] = 1;
  bodies.in_contact[i] = 0;
  s.loads.course[i] = Course::still;
  std::erase_if(s.wrenches, [id = bodies.id[i]](const ActiveWrench& active) {
    return active.wrench.body.value == id;
  });
  s.contacts.forget(std::span(&bodies.id[i], 1));
  ++s.quarantined;
  s.events.push_back(event_of(s, i, EventKind::quarantined));
  s.events.back().reason = reason;
}

/// Leaves a spin that is too fast at what stays within the limit however the body tumbles: its
/// angular momentum is then that of the fastest spin about the axis of least inertia, less what
/// rounding may add.
void cut_spin(World::State& s, std::size_t i) {
  Vector& w = s.bodies.w[i];
  if (!(w.cwiseAbs().maxCoeff() > limits::kAngularSpeedMax_radps && w.allFinite())) return;
  const Momentum before = momentum_before(s, i);
  const Vector& J = s.bodies.inertia[i];
  const double momentum = J.cwiseProduct(s.bodies.q[i].conjugate() * w).norm();
  constexpr double kRoom = 1 - 1e-9;
  w *= kRoom * limits::kAngularSpeedMax_radps * J.minCoeff() / momentum;
  add_unaccounted(s, i, s.bodies.x[i], before);
  ++s.spins_cut;
}

/// Drag or a spring may keep it from what its loads alone would do; its state at the tick's end is
/// looked at anyway.
bool is_held_back(const World::State& s, std::size_t i) {
  const BodyId body{s.bodies.id[i]};
  return s.bodies.drag[i].any() ||
         std::any_of(s.springs.begin(), s.springs.end(),
                     [&](const Spring& spring) { return spring.a == body || spring.b == body; });
}

}  // namespace

void quarantine_runaways(World::State& s) {
  for (const std::int32_t slot : s.loads.pushed) {
    const auto i = static_cast<std::size_t>(slot);
    const Vector v = s.bodies.v[i] + s.dt * s.loads.acceleration[i];
    const Vector turn =
        s.dt * (s.bodies.q[i].conjugate() * s.loads.torque_W[i] + s.loads.torque_P[i]);
    const Vector w = s.bodies.w[i] + s.bodies.q[i] * turn.cwiseProduct(s.bodies.inverse_inertia[i]);
    const Result result = check(s.bodies.x[i], s.bodies.q[i], v, w);
    if (result != Result::ok && !is_held_back(s, i)) quarantine(s, i, result);
  }
}

void end_tick(World::State& s, std::size_t i, Flight end) {
  BodyTable& bodies = s.bodies;
  if (s.settings.is_planar) keep_in_plane(end);
  s.loads.course[i] = Course::moved;
  bodies.v[i] = end.v;
  bodies.w[i] = end.w;
  if (check(end.x, end.q, end.v, end.w) != Result::ok) {
    s.lost[i] = 1;
    return;
  }
  bodies.x[i] = end.x;
  bodies.q[i] = end.q;
}

void stop_unusable(World::State& s, Executor& executor) {
  BodyTable& bodies = s.bodies;
  const auto is_usable = [&bodies](std::size_t i) {
    return check(bodies.x[i], bodies.q[i], bodies.v[i], bodies.w[i]) == Result::ok;
  };
  s.spins_cut = 0;
  s.are_unusable.resize(s.moving.size());
  for_each_index(executor, s.moving.size(), kBodies, [&](std::size_t k) {
    const std::size_t i = index(s.moving[k]);
    if (s.settings.is_planar) keep_in_plane(bodies, i);
    s.are_unusable[k] = is_usable(i) ? 0 : 1;
  });
  for_all_marked(s.are_unusable, [&](std::size_t k) {
    const std::size_t i = index(s.moving[k]);
    cut_spin(s, i);
    if (is_usable(i)) return;
    bodies.x[i] = s.x_start[k];
    bodies.q[i] = s.q_start[k];
    s.lost[i] = 1;
  });
}

void quarantine_unusable(World::State& s) {
  const auto is_lost = [](std::uint8_t flag) { return flag != 0; };
  for (auto found = s.lost.begin();; ++found) {
    found = std::find_if(found, s.lost.end(), is_lost);
    if (found == s.lost.end()) return;
    const auto i = static_cast<std::size_t>(found - s.lost.begin());
    const bool is_finite = s.bodies.v[i].allFinite() && s.bodies.w[i].allFinite();
    quarantine(s, i, is_finite ? Result::out_of_range : Result::not_finite);
  }
}

}  // namespace cradle
