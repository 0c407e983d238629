// What a world tells about itself, and its making.
#include <xxhash.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <utility>

#include "server/dynamics/rotation.h"
#include "server/world/edit.h"
#include "server/world/springs.h"
#include "server/world/state.h"

namespace cradle {
namespace {

BodyState state_of(const BodyTable& bodies, std::size_t i) {
  BodyState state;
  state.body = {bodies.id[i]};
  state.kind = bodies.kind[i];
  state.in_contact = bodies.in_contact[i] != 0;
  state.quarantined = bodies.quarantined[i] != 0;
  state.asleep = bodies.is_asleep(i);
  const BodyFrame B = bodies.frame(i);
  state.p_WBo = to_plain(B.p_WBo);
  state.q_WB = to_plain(B.q_WB);
  state.v_WBcm = to_plain(bodies.v[i]);
  state.w_WB = to_plain(bodies.w[i]);
  return state;
}

}  // namespace

World::State::State(const WorldSettings& s)
    : settings(s),
      dt(1 / s.rate_hz),
      gravity_W(to_eigen(s.gravity_W)),
      broad_phase(make_broad_phase(s.broad_phase)),
      solver(make_contact_solver(s.solver)),
      scheme(find_scheme(s.scheme)) {
  assert(s.rate_hz > 0 && s.sub_steps >= 0 && (s.sub_steps > 0 || s.contact_tolerance_m > 0));
  assert((!s.is_planar || s.gravity_W.z == 0) && "gravity of a planar world lies in it");
  assert(solver != nullptr && "settings name a solver of solver_names()");
  assert(scheme != nullptr && "settings name a scheme of scheme_names()");
  assert(broad_phase != nullptr && "settings name one of broad_phase_names()");
}

BodyArrays World::State::arrays() {
  return {bodies.x,
          bodies.q,
          bodies.v,
          bodies.w,
          bodies.inverse_mass,
          bodies.inertia,
          bodies.inverse_inertia,
          loads.acceleration,
          loads.torque_W,
          axial_shares,
          bodies.x_rest,
          bodies.sway,
          bodies.poise};
}

FlightArrays World::State::flight_arrays() {
  return {loads.course,
          bodies.x,
          bodies.q,
          bodies.v,
          bodies.w,
          bodies.inertia,
          bodies.inverse_inertia,
          loads.acceleration,
          loads.torque_W,
          loads.torque_P,
          lost};
}

World::World(const WorldSettings& settings) : state_(std::make_unique<State>(settings)) {}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

std::vector<std::string> solver_names() { return contact_solver_names(); }

std::vector<std::string> scheme_names() {
  std::vector<std::string> names;
  for (const Scheme& scheme : schemes()) names.emplace_back(scheme.name);
  return names;
}

Tick World::tick() const { return state_->tick; }
const WorldSettings& World::settings() const { return state_->settings; }
Vec3 World::gravity_W() const { return to_plain(state_->gravity_W); }
std::int64_t World::body_count() const { return static_cast<std::int64_t>(state_->bodies.size()); }
std::int64_t World::awake_count() const {
  const BodyTable& bodies = state_->bodies;
  std::int64_t count = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    count += bodies.is_moving(i) && !bodies.is_asleep(i) ? 1 : 0;
  }
  return count;
}
std::int64_t World::wrench_count() const {
  return static_cast<std::int64_t>(state_->wrenches.size());
}
bool World::can_collide(ShapeKind kind) const { return state_->can_collide(kind); }
std::int64_t World::not_colliding_count() const {
  return std::count_if(state_->bodies.shape.begin(), state_->bodies.shape.end(),
                       [this](const Shape& shape) { return !can_collide(shape.kind); });
}
std::int64_t World::spring_count() const {
  return static_cast<std::int64_t>(state_->springs.size());
}
void World::keep_accounts() { state_->loads.keeps_resultants = state_->keeps_accounts = true; }
std::span<const FlightAccount> World::accounts() const { return state_->accounts; }
std::span<const SubStepChoice> World::sub_step_choices() const {
  return std::span(state_->solved.choices).first(state_->solved.choices_used);
}
std::int64_t World::quarantined_count() const { return state_->quarantined; }

void World::snapshot(std::vector<BodyState>& states) const {
  states.resize(state_->bodies.size());
  for (std::size_t i = 0; i < states.size(); ++i) states[i] = state_of(state_->bodies, i);
}

bool World::find(BodyId body, BodyState& state) const {
  const auto i = state_->bodies.slot(body);
  if (i) state = state_of(state_->bodies, *i);
  return i.has_value();
}

std::vector<Event> World::describe(BodyId after, int count) const {
  const auto& ids = state_->bodies.id;
  const auto first = std::upper_bound(ids.begin(), ids.end(), after.value);
  std::vector<Event> events;
  for (auto i = static_cast<std::size_t>(first - ids.begin());
       i < ids.size() && events.size() < static_cast<std::size_t>(count); ++i) {
    events.push_back(event_of(*state_, i, EventKind::described));
  }
  return events;
}

std::vector<Event> World::take_events() { return std::exchange(state_->events, {}); }

Totals World::totals() const {
  const BodyTable& bodies = state_->bodies;
  Vector momentum = Vector::Zero();
  Vector angular = Vector::Zero();
  Totals totals;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!bodies.is_moving(i)) continue;
    const Vector w_P = bodies.q[i].conjugate() * bodies.w[i];
    const Vector p = bodies.mass[i] * bodies.v[i];
    const Vector spin_P = bodies.inertia[i].cwiseProduct(w_P);
    totals.kinetic_energy_J += 0.5 * (p.dot(bodies.v[i]) + spin_P.dot(w_P));
    totals.potential_energy_J -= bodies.mass[i] * state_->gravity_W.dot(bodies.x[i]);
    momentum += p;
    angular += bodies.x[i].cross(p) + bodies.q[i] * spin_P;
  }
  totals.potential_energy_J += energy_of_springs(*state_);
  totals.momentum_Ns = to_plain(momentum);
  totals.angular_momentum_Nms = to_plain(angular);
  return totals;
}

std::array<std::uint8_t, 8> World::hash() const {
  XXH64_hash_t hash = 0;
  state_->for_each_part([&](const char*, std::span<std::byte> bytes) {
    hash = XXH3_64bits_withSeed(bytes.data(), bytes.size(), hash);
  });
  XXH64_canonical_t canonical;
  XXH64_canonicalFromHash(&canonical, hash);
  std::array<std::uint8_t, 8> digest;
  std::memcpy(digest.data(), canonical.digest, digest.size());
  return digest;
}

std::vector<World::StatePart> World::state_parts() {
  std::vector<StatePart> parts;
  state_->for_each_part([&](const char* name, std::span<std::byte> bytes) {
    parts.push_back({name, bytes});
  });
  return parts;
}

}  // namespace cradle
