// Commands: first everything is checked, then everything is changed. A command given between two
// steps shows in the state of the coming tick; its events carry that tick.
#include "server/world/edit.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <set>

#include "protocol/validate.h"
#include "server/dynamics/rotation.h"
#include "server/world/geometry_digest.h"
#include "server/world/plane.h"
#include "server/world/sleeping.h"

namespace cradle {
namespace {

Outcome refused(Result result, std::size_t item) {
  return {result, {}, static_cast<std::int32_t>(item)};
}

/// Ids of bodies, ascending and each once; or the first that does not exist, as an outcome.
Outcome find_all(const BodyTable& bodies, std::span<const BodyId> wanted,
                 std::vector<std::int64_t>& ids) {
  ids.clear();
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    if (!bodies.slot(wanted[k])) return refused(Result::unknown_body, k);
    ids.push_back(wanted[k].value);
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return {};
}

/// A shape's stored geometry and what it weighs, if it is one that the world holds.
struct Stored {
  const StoredGeometry* geometry = nullptr;
  const MassDistribution* mass = nullptr;
};
Result find_stored(const World::State& s, const Shape& shape, Stored& found) {
  if (!is_stored(shape.kind)) return Result::ok;
  const auto number = static_cast<std::size_t>(shape.parameters[0]);
  if (number < 1 || number > s.geometries.size()) return Result::bad_shape;
  if (s.geometries[number - 1]->kind() != shape.kind) return Result::bad_shape;
  found = {s.geometries[number - 1].get(), &s.geometry_masses[number - 1]};
  return Result::ok;
}

/// What a body of this specification weighs in this world, if that takes it.
Result find_mass(const World::State& s, const BodySpec& spec, MassProperties& mass) {
  Stored stored;
  Result result = validate(spec);
  if (result == Result::ok) result = find_stored(s, spec.shape, stored);
  if (result != Result::ok) return result;
  if (spec.contact_tolerance_m > 0 && s.settings.sub_steps > 0) return Result::not_allowed;
  if (!s.settings.is_planar) {
    if (!shape_out_of_space(spec.shape, stored.geometry).empty()) return Result::bad_shape;
    return mass_properties(spec, stored.mass, mass);
  }
  if (!shape_out_of_plane(spec.shape, stored.geometry).empty()) return Result::out_of_plane;
  result = planar_mass_properties(spec, stored.mass, mass);
  if (result != Result::ok) return result;
  if (!out_of_plane(spec, mass).empty()) return Result::out_of_plane;
  mass = planar(mass);
  return Result::ok;
}

/// Names must be new to the world and to each other.
Outcome check_names(const World::State& s, std::span<const BodySpec> specs) {
  std::set<std::string_view> fresh;
  for (std::size_t k = 0; k < specs.size(); ++k) {
    const std::string& name = specs[k].name;
    if (name.empty()) continue;
    if (s.names.contains(name) || !fresh.insert(name).second) {
      return refused(Result::duplicate_name, k);
    }
  }
  return {};
}

/// What wrenches or motions are for.
template <class Item>
void wake_for_command(World::State& s, std::span<const Item> items) {
  std::vector<std::int64_t> ids;
  for (const Item& item : items) ids.push_back(item.body.value);
  std::sort(ids.begin(), ids.end());
  wake_for_command(s, std::span<const std::int64_t>(ids));
}

void wake_ends(World::State& s, std::span<const Spring> springs) {
  std::vector<std::int64_t> ids;
  for (const Spring& spring : springs) {
    ids.push_back(spring.a.value);
    if (spring.b) ids.push_back(spring.b.value);
  }
  std::sort(ids.begin(), ids.end());
  wake_for_command(s, std::span<const std::int64_t>(ids));
}

/// Coefficients of drag and springs.
Result check_coefficients(std::initializer_list<double> values) {
  for (const double value : values) {
    if (!std::isfinite(value)) return Result::not_finite;
    if (value < 0 || value > limits::kWrenchMax) return Result::out_of_range;
  }
  return Result::ok;
}

Result check_spring(const BodyTable& bodies, const Spring& spring) {
  const Result result = check_coefficients({spring.stiffness, spring.damping, spring.rest_length});
  if (result != Result::ok) return result;
  bool is_moved = false;
  if (!spring.a) return Result::unknown_body;
  for (const BodyId body : {spring.a, spring.b}) {
    if (!body) continue;  // the world
    const auto i = bodies.slot(body);
    if (!i) return Result::unknown_body;
    is_moved = is_moved || bodies.kind[*i] == BodyKind::dynamic;
  }
  if (!is_moved || spring.a == spring.b) return Result::wrong_kind;
  for (const Vec3& p : {spring.point_a, spring.point_b}) {
    const Vector point = to_eigen(p);
    if (!point.allFinite()) return Result::not_finite;
    if (point.cwiseAbs().maxCoeff() > limits::kPositionMax_m) return Result::out_of_range;
  }
  return Result::ok;
}

}  // namespace

Event event_of(const World::State& s, std::size_t i, EventKind kind) {
  Event event;
  event.kind = kind;
  event.body = {s.bodies.id[i]};
  event.tick = s.tick;
  event.body_kind = s.bodies.kind[i];
  event.shape = s.bodies.shape[i];
  event.mass_kg = s.bodies.mass[i];
  event.p_BoBcm = to_plain(s.bodies.p_BoBcm[i]);
  event.name = s.bodies.name_text(i);
  return event;
}

std::int64_t World::add_geometry(const GeometryPointer& geometry) {
  State& s = *state_;
  if (s.geometries.size() >= static_cast<std::size_t>(limits::kGeometries)) return 0;
  s.geometries.push_back(geometry);
  s.geometry_masses.push_back(geometry_mass(*geometry, s.settings.is_planar));
  s.geometry_digests.push_back(digest(*geometry));
  return static_cast<std::int64_t>(s.geometries.size());
}

Outcome World::spawn(std::span<const BodySpec> specs) {
  State& s = *state_;
  const auto count = static_cast<std::int64_t>(specs.size());
  if (s.next_id > limits::kIntegerMax - count ||
      static_cast<std::int64_t>(s.bodies.size()) > s.settings.bodies_max - count) {
    return refused(Result::over_quota, 0);
  }
  std::vector<MassProperties> masses(specs.size());
  for (std::size_t k = 0; k < specs.size(); ++k) {
    const Result result = find_mass(s, specs[k], masses[k]);
    if (result != Result::ok) return refused(result, k);
  }
  if (const Outcome names = check_names(s, specs); names.result != Result::ok) return names;

  const BodyId first{s.next_id};
  for (std::size_t k = 0; k < specs.size(); ++k) {
    s.bodies.append(s.next_id++, specs[k], masses[k]);
    if (s.settings.is_planar) keep_in_plane(s.bodies, s.bodies.size() - 1);
    if (!specs[k].name.empty()) s.names.insert(specs[k].name);
    s.events.push_back(event_of(s, s.bodies.size() - 1, EventKind::spawned));
    s.events.back().tick = s.tick + 1;
  }
  s.renumbered = true;
  return {Result::ok, first, 0};
}

Outcome World::despawn(std::span<const BodyId> bodies) {
  State& s = *state_;
  std::vector<std::int64_t> ids;
  if (const Outcome missing = find_all(s.bodies, bodies, ids); missing.result != Result::ok) {
    return missing;
  }
  wake_for_command(s, ids);
  std::vector<std::uint8_t> is_removed(s.bodies.size(), 0);
  for (const std::int64_t id : ids) {
    const std::size_t i = *s.bodies.slot({id});
    is_removed[i] = 1;
    s.names.erase(std::string(s.bodies.name_text(i)));
    s.events.push_back(event_of(s, i, EventKind::removed));
    s.events.back().tick = s.tick + 1;
  }
  s.bodies.remove(is_removed);
  remove_slots(is_removed, s.poses);
  remove_slots(is_removed, s.turned);
  std::erase_if(s.wrenches, [&](const ActiveWrench& active) {
    return std::binary_search(ids.begin(), ids.end(), active.wrench.body.value);
  });
  std::erase_if(s.springs, [&](const Spring& spring) {
    return std::binary_search(ids.begin(), ids.end(), spring.a.value) ||
           std::binary_search(ids.begin(), ids.end(), spring.b.value);
  });
  s.contacts.forget(ids);
  s.renumbered = true;
  return {};
}

Outcome World::push(std::span<const Wrench> wrenches) {
  State& s = *state_;
  if (static_cast<std::int64_t>(s.wrenches.size() + wrenches.size()) > s.settings.wrenches_max) {
    return refused(Result::over_quota, 0);
  }
  for (std::size_t k = 0; k < wrenches.size(); ++k) {
    const Result result = validate(wrenches[k]);
    if (result != Result::ok) return refused(result, k);
    const auto i = s.bodies.slot(wrenches[k].body);
    if (!i) return refused(Result::unknown_body, k);
    if (!s.bodies.is_moving(*i)) return refused(Result::wrong_kind, k);
    if (s.settings.is_planar && !out_of_plane(wrenches[k]).empty()) {
      return refused(Result::out_of_plane, k);
    }
  }
  wake_for_command(s, wrenches);
  for (const Wrench& wrench : wrenches) {
    Tick ticks = 1;
    if (wrench.duration == WrenchDuration::ticks) ticks = wrench.ticks;
    if (wrench.duration == WrenchDuration::until_cleared) ticks = kUntilCleared;
    s.wrenches.push_back({wrench, ticks});
  }
  return {};
}

Outcome World::clear_wrenches(std::span<const BodyId> bodies) {
  State& s = *state_;
  std::vector<std::int64_t> ids;
  if (const Outcome missing = find_all(s.bodies, bodies, ids); missing.result != Result::ok) {
    return missing;
  }
  std::erase_if(s.wrenches, [&](const ActiveWrench& active) {
    return std::binary_search(ids.begin(), ids.end(), active.wrench.body.value);
  });
  return {};
}

Outcome World::set_motion(std::span<const Motion> motions) {
  State& s = *state_;
  for (std::size_t k = 0; k < motions.size(); ++k) {
    const Result result = validate(motions[k]);
    if (result != Result::ok) return refused(result, k);
    const auto i = s.bodies.slot(motions[k].body);
    if (!i) return refused(Result::unknown_body, k);
    if (s.bodies.kind[*i] == BodyKind::fixed && motions[k].sets_velocity) {
      return refused(Result::wrong_kind, k);
    }
    if (s.settings.is_planar && !out_of_plane(motions[k], s.bodies.shape[*i].kind).empty()) {
      return refused(Result::out_of_plane, k);
    }
  }
  wake_for_command(s, motions);
  for (const Motion& motion : motions) {
    const std::size_t i = *s.bodies.slot(motion.body);
    if (motion.sets_pose) {
      s.bodies.place(i, {to_eigen(motion.p_WBo), normalised(to_eigen(motion.q_WB))});
      s.contacts.forget(std::span(&s.bodies.id[i], 1));
    }
    if (motion.sets_velocity) {
      s.bodies.v[i] = to_eigen(motion.v_WBcm);
      s.bodies.w[i] = to_eigen(motion.w_WB);
    }
    if (s.settings.is_planar) keep_in_plane(s.bodies, i);
    if (motion.sets_pose && motion.sets_velocity) s.bodies.quarantined[i] = 0;
  }
  return {};
}

Outcome World::set_gravity(const Vec3& gravity_W) {
  Result result = validate_gravity(gravity_W);
  if (result == Result::ok && state_->settings.is_planar &&
      !out_of_plane_gravity(gravity_W).empty()) {
    result = Result::out_of_plane;
  }
  if (result == Result::ok && to_eigen(gravity_W) != state_->gravity_W) wake_all(*state_);
  if (result == Result::ok) state_->gravity_W = to_eigen(gravity_W);
  return {result, {}, 0};
}

Outcome World::set_drag(BodyId body, const Drag& drag) {
  State& s = *state_;
  const auto i = s.bodies.slot(body);
  if (!i) return refused(Result::unknown_body, 0);
  if (s.bodies.kind[*i] != BodyKind::dynamic) return refused(Result::wrong_kind, 0);
  const Result result = check_coefficients({drag.linear, drag.quadratic, drag.angular});
  if (result == Result::ok) {
    wake_for_command(s, std::span(&s.bodies.id[*i], 1));
    s.bodies.drag[*i] = drag;
    s.renumbered = true;
  }
  return {result, {}, 0};
}

Outcome World::add_springs(std::span<const Spring> springs) {
  State& s = *state_;
  if (static_cast<std::int64_t>(s.springs.size() + springs.size()) > s.settings.wrenches_max) {
    return refused(Result::over_quota, 0);
  }
  for (std::size_t k = 0; k < springs.size(); ++k) {
    Result result = check_spring(s.bodies, springs[k]);
    if (result == Result::ok && s.settings.is_planar && !out_of_plane(springs[k]).empty()) {
      result = Result::out_of_plane;
    }
    if (result != Result::ok) return refused(result, k);
  }
  wake_ends(s, springs);
  s.springs.insert(s.springs.end(), springs.begin(), springs.end());
  return {};
}

}  // namespace cradle
