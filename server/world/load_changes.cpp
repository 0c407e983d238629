#include "server/world/load_changes.h"

#include "server/collision/index.h"
#include "server/world/state.h"

namespace cradle {
namespace {

/// Of the larger load: less is followed by the sub-steps as they are ("a pushed box", where a push
/// grows for a second).
constexpr double kChange = 0.05;

/// As an acceleration squared: what takes as much kinetic energy from rest.
double size2(const World::State& s, std::size_t i, const Vector& acceleration,
             const Vector& torque) {
  const Vector torque_P = s.bodies.q[i].conjugate() * torque;
  return acceleration.squaredNorm() +
         s.bodies.inverse_mass[i] *
             torque_P.dot(s.bodies.inverse_inertia[i].cwiseProduct(torque_P));
}

bool are_same(const BodyLoad& p, const BodyLoad& q) {
  return p.acceleration == q.acceleration && p.torque == q.torque;
}

bool has_changed(const World::State& s, std::size_t i, const BodyLoad& before,
                 const BodyLoad& now) {
  const double change2 =
      size2(s, i, now.acceleration - before.acceleration, now.torque - before.torque);
  const double larger2 = std::max(size2(s, i, s.gravity_W + now.acceleration, now.torque),
                                  size2(s, i, s.gravity_W + before.acceleration, before.torque));
  return change2 > kChange * kChange * larger2;
}

}  // namespace

void find_shaken(World::State& s) {
  PastLoads& past = s.past_loads;
  s.shaken.clear();
  s.stirred.clear();
  if (past.gravity_W != s.gravity_W) s.shaken = s.stirred = s.moving;
  past.gravity_W = s.gravity_W;
  s.pushed.clear();
  for (const std::int32_t slot : s.loads.pushed) {
    const std::size_t i = index(slot);
    s.pushed.push_back({s.bodies.id[i], s.loads.acceleration[i] - s.gravity_W,
                        s.loads.torque_W[i] + s.bodies.q[i] * s.loads.torque_P[i]});
  }
  auto before = past.pushed.cbegin();
  auto now = s.pushed.cbegin();
  while (before != past.pushed.cend() || now != s.pushed.cend()) {
    const bool was =
        before != past.pushed.cend() && (now == s.pushed.cend() || before->id <= now->id);
    const bool is = now != s.pushed.cend() && (!was || now->id == before->id);
    const BodyLoad none{is ? now->id : before->id, Vector::Zero(), Vector::Zero()};
    const auto slot = s.bodies.slot({none.id});
    const BodyLoad &then = was ? *before : none, &here = is ? *now : none;
    if (slot && !are_same(then, here)) {
      s.stirred.push_back(static_cast<std::int32_t>(*slot));
      if (has_changed(s, *slot, then, here)) s.shaken.push_back(s.stirred.back());
    }
    before += was ? 1 : 0;
    now += is ? 1 : 0;
  }
  past.pushed.swap(s.pushed);
}

}  // namespace cradle
