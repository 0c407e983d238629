#include "server/world/quarantine.h"

#include <cradle/limits.h>

#include "server/world/edit.h"

namespace cradle {
namespace {

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
  std::erase_if(s.wrenches, [id = bodies.id[i]](const ActiveWrench& active) {
    return active.wrench.body.value == id;
  });
  s.contacts.forget(std::span(&bodies.id[i], 1));
  ++s.quarantined;
  s.events.push_back(event_of(s, i, EventKind::quarantined));
  s.events.back().reason = reason;
}

}  // namespace

void quarantine_runaways(World::State& s) {
  for (std::size_t i = 0; i < s.bodies.size(); ++i) {
    if (!s.bodies.is_moving(i)) continue;
    const Vector v = s.bodies.v[i] + s.dt * s.loads.acceleration[i];
    const Vector turn = s.dt * (s.bodies.q[i].conjugate() * s.loads.torque[i]);
    const Vector w = s.bodies.w[i] + s.bodies.q[i] * turn.cwiseProduct(s.bodies.inverse_inertia[i]);
    const Result result = check(s.bodies.x[i], s.bodies.q[i], v, w);
    if (result != Result::ok) quarantine(s, i, result);
  }
}

void quarantine_unusable(World::State& s) {
  for (std::size_t i = 0; i < s.bodies.size(); ++i) {
    if (s.bodies.kind[i] == BodyKind::fixed || s.bodies.quarantined[i] != 0) continue;
    const Result result = check(s.bodies.x[i], s.bodies.q[i], s.bodies.v[i], s.bodies.w[i]);
    if (result == Result::ok) continue;
    s.bodies.x[i] = s.x_start[i];
    s.bodies.q[i] = s.q_start[i];
    quarantine(s, i, result);
  }
}

}  // namespace cradle
