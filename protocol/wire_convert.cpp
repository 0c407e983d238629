#include "protocol/wire_convert.h"

#include <cradle/limits.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "protocol/wire_fields.h"

namespace cradle {
namespace {

// --- items ------------------------------------------------------------------------------------

void to_wire(const BodySpec& v, wire::body_spec_v3& w) {
  w.kind = static_cast<std::int32_t>(v.kind);
  w.shape = static_cast<std::int32_t>(v.shape.kind);
  std::copy(v.shape.parameters.begin(), v.shape.parameters.end(), w.shape_parameters);
  w.mass_kg = v.mass_kg;
  w.density_kgpm3 = v.density_kgpm3;
  put(v.inertia_kgm2, w.inertia_kgm2);
  put(v.inertia_products_kgm2, w.inertia_products_kgm2);
  w.sets = v.sets_centre_of_mass ? wire::body_spec_v3::CENTRE_OF_MASS : 0;
  put(v.p_BoBcm, w.p_BoBcm_m);
  w.friction = v.material.friction;
  w.restitution = v.material.restitution;
  w.rolling_friction_m = v.material.rolling_friction_m;
  w.torsional_friction_m = v.material.torsional_friction_m;
  w.contact_tolerance_m = v.contact_tolerance_m;
  w.friction_rule = static_cast<std::int32_t>(v.material.friction_rule);
  w.restitution_rule = static_cast<std::int32_t>(v.material.restitution_rule);
  put(v.p_WBo, w.p_WBo_m);
  put(v.q_WB, w.q_WB);
  put(v.v_WBcm, w.v_WBcm_mps);
  put(v.w_WB, w.w_WB_radps);
  put(v.name, w.name);
}

bool from_wire(const wire::body_spec_v3& w, BodySpec& v) {
  std::copy(std::begin(w.shape_parameters), std::end(w.shape_parameters),
            v.shape.parameters.begin());
  v.mass_kg = w.mass_kg;
  v.density_kgpm3 = w.density_kgpm3;
  v.inertia_kgm2 = vector(w.inertia_kgm2);
  v.inertia_products_kgm2 = vector(w.inertia_products_kgm2);
  v.sets_centre_of_mass = w.sets != 0;
  v.p_BoBcm = vector(w.p_BoBcm_m);
  v.material.friction = w.friction;
  v.material.restitution = w.restitution;
  v.material.rolling_friction_m = w.rolling_friction_m;
  v.material.torsional_friction_m = w.torsional_friction_m;
  v.contact_tolerance_m = w.contact_tolerance_m;
  v.p_WBo = vector(w.p_WBo_m);
  v.q_WB = rotation(w.q_WB);
  v.v_WBcm = vector(w.v_WBcm_mps);
  v.w_WB = vector(w.w_WB_radps);
  return get(w.kind, BodyKind::dynamic, v.kind) && get(w.shape, ShapeKind::polygon, v.shape.kind) &&
         get(w.friction_rule, CombineRule::maximum, v.material.friction_rule) &&
         get(w.restitution_rule, CombineRule::maximum, v.material.restitution_rule) &&
         w.sets >= 0 && w.sets <= wire::body_spec_v3::CENTRE_OF_MASS && get(w.name, v.name);
}

void to_wire(BodyId v, std::int64_t& w) { w = v.value; }
bool from_wire(std::int64_t w, BodyId& v) {
  v.value = w;
  return is_integer(w);
}

void to_wire(const Wrench& v, wire::wrench_spec_v1& w) {
  w.body = v.body.value;
  w.quantity = static_cast<std::int32_t>(v.quantity);
  w.frame = static_cast<std::int32_t>(v.frame);
  w.point_kind = static_cast<std::int32_t>(v.point_kind);
  w.duration_kind = static_cast<std::int32_t>(v.duration);
  w.ticks = v.ticks;
  put(v.value, w.value);
  put(v.point, w.point_m);
}

bool from_wire(const wire::wrench_spec_v1& w, Wrench& v) {
  v.body.value = w.body;
  v.ticks = w.ticks;
  v.value = vector(w.value);
  v.point = vector(w.point_m);
  return is_integer(w.body) && is_integer(w.ticks) &&
         get(w.quantity, WrenchQuantity::acceleration, v.quantity) &&
         get(w.frame, WrenchFrame::body, v.frame) &&
         get(w.point_kind, WrenchPoint::body_point, v.point_kind) &&
         get(w.duration_kind, WrenchDuration::until_cleared, v.duration);
}

void to_wire(const Motion& v, wire::motion_spec_v1& w) {
  using wire::motion_spec_v1;
  w.body = v.body.value;
  w.what =
      (v.sets_pose ? motion_spec_v1::POSE : 0) | (v.sets_velocity ? motion_spec_v1::VELOCITY : 0);
  put(v.p_WBo, w.p_WBo_m);
  put(v.q_WB, w.q_WB);
  put(v.v_WBcm, w.v_WBcm_mps);
  put(v.w_WB, w.w_WB_radps);
}

bool from_wire(const wire::motion_spec_v1& w, Motion& v) {
  v.body.value = w.body;
  v.sets_pose = (w.what & wire::motion_spec_v1::POSE) != 0;
  v.sets_velocity = (w.what & wire::motion_spec_v1::VELOCITY) != 0;
  v.p_WBo = vector(w.p_WBo_m);
  v.q_WB = rotation(w.q_WB);
  v.v_WBcm = vector(w.v_WBcm_mps);
  v.w_WB = vector(w.w_WB_radps);
  return is_integer(w.body) && w.what >= 0 &&
         w.what <= int{wire::motion_spec_v1::POSE} + int{wire::motion_spec_v1::VELOCITY};
}

void to_wire(const Receipt& v, wire::receipt_v1& w) {
  w.client = v.client;
  w.sequence = v.sequence;
  w.tick = v.tick;
  w.body = v.outcome.body.value;
  w.result = static_cast<std::int32_t>(v.outcome.result);
  w.item = v.outcome.item;
}

bool from_wire(const wire::receipt_v1& w, Receipt& v) {
  v.client = w.client;
  v.sequence = w.sequence;
  v.tick = w.tick;
  v.outcome.body.value = w.body;
  v.outcome.result = static_cast<Result>(w.result);
  v.outcome.item = w.item;
  return is_integer(w.client) && is_integer(w.sequence) && is_integer(w.tick) &&
         is_integer(w.body) && w.item >= 0 && to_string(v.outcome.result) != "unlisted";
}

void to_wire(const BodyState& v, wire::body_state_v1& w) {
  using wire::body_state_v1;
  w.body = v.body.value;
  w.kind = static_cast<std::int32_t>(v.kind);
  w.flags = (v.in_contact ? body_state_v1::IN_CONTACT : 0) |
            (v.quarantined ? body_state_v1::QUARANTINED : 0) |
            (v.asleep ? body_state_v1::ASLEEP : 0);
  put(v.p_WBo, w.p_WBo_m);
  put(v.q_WB, w.q_WB);
  put(v.v_WBcm, w.v_WBcm_mps);
  put(v.w_WB, w.w_WB_radps);
}

bool from_wire(const wire::body_state_v1& w, BodyState& v) {
  v.body.value = w.body;
  v.in_contact = (w.flags & wire::body_state_v1::IN_CONTACT) != 0;
  v.quarantined = (w.flags & wire::body_state_v1::QUARANTINED) != 0;
  v.asleep = (w.flags & wire::body_state_v1::ASLEEP) != 0;
  v.p_WBo = vector(w.p_WBo_m);
  v.q_WB = rotation(w.q_WB);
  v.v_WBcm = vector(w.v_WBcm_mps);
  v.w_WB = vector(w.w_WB_radps);
  const int known = int{wire::body_state_v1::IN_CONTACT} + int{wire::body_state_v1::QUARANTINED} +
                    int{wire::body_state_v1::ASLEEP};
  return is_integer(w.body, 1) && (w.flags & ~known) == 0 && get(w.kind, BodyKind::dynamic, v.kind);
}

void to_wire(const Event& v, wire::event_v2& w) {
  w.body = v.body.value;
  w.client = v.client;
  w.tick = v.tick;
  w.event = static_cast<std::int32_t>(v.kind);
  w.reason = static_cast<std::int32_t>(v.reason);
  w.kind = static_cast<std::int32_t>(v.body_kind);
  w.shape = static_cast<std::int32_t>(v.shape.kind);
  std::copy(v.shape.parameters.begin(), v.shape.parameters.end(), w.shape_parameters);
  w.mass_kg = v.mass_kg;
  put(v.p_BoBcm, w.p_BoBcm_m);
  put(v.name, w.name);
}

bool from_wire(const wire::event_v2& w, Event& v) {
  v.body.value = w.body;
  v.client = w.client;
  v.tick = w.tick;
  v.reason = static_cast<Result>(w.reason);
  std::copy(std::begin(w.shape_parameters), std::end(w.shape_parameters),
            v.shape.parameters.begin());
  v.mass_kg = w.mass_kg;
  v.p_BoBcm = vector(w.p_BoBcm_m);
  return is_integer(w.body, 1) && is_integer(w.client) && is_integer(w.tick) &&
         to_string(v.reason) != "unlisted" && get(w.event, EventKind::woke, v.kind) &&
         get(w.kind, BodyKind::dynamic, v.body_kind) &&
         get(w.shape, ShapeKind::polygon, v.shape.kind) && get(w.name, v.name);
}

template <class Wire, class Items>
Wire list_to_wire(const Items& items) {
  Wire w{};
  w.count = static_cast<std::int32_t>(items.size());
  items_of(w).resize(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) to_wire(items[i], items_of(w)[i]);
  return w;
}

template <class WireItems, class Items>
bool list_from_wire(const WireItems& wire_items, Items& items) {
  items.resize(wire_items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!from_wire(wire_items[i], items[i])) return false;
  }
  return true;
}

}  // namespace

// --- commands ---------------------------------------------------------------------------------

wire::command_header_v1 to_wire(const CommandHeader& v) {
  return {v.client, v.sequence, v.epoch, v.target_tick};
}
bool from_wire(const wire::command_header_v1& w, CommandHeader& v) {
  v = {w.client, w.sequence, w.epoch, w.target_tick};
  return is_integer(w.client, 1) && is_integer(w.sequence, 1) && is_integer(w.epoch) &&
         is_integer(w.target_tick);
}

wire::hello_v1 to_wire(const Hello& v) {
  wire::hello_v1 w{};
  w.protocol_version = v.protocol_version;
  put(v.name, w.name);
  return w;
}
bool from_wire(const wire::hello_v1& w, Hello& v) {
  v.protocol_version = w.protocol_version;
  return get(w.name, v.name);
}

wire::spawn_v3 to_wire(const Spawn& v) { return list_to_wire<wire::spawn_v3>(v.bodies); }
bool from_wire(const wire::spawn_v3& w, Spawn& v) { return list_from_wire(w.bodies, v.bodies); }

wire::despawn_v1 to_wire(const Despawn& v) { return list_to_wire<wire::despawn_v1>(v.bodies); }
bool from_wire(const wire::despawn_v1& w, Despawn& v) {
  return list_from_wire(w.removed, v.bodies);
}

wire::wrench_v1 to_wire(const Push& v) { return list_to_wire<wire::wrench_v1>(v.wrenches); }
bool from_wire(const wire::wrench_v1& w, Push& v) { return list_from_wire(w.wrenches, v.wrenches); }

wire::clear_wrenches_v1 to_wire(const ClearWrenches& v) {
  return list_to_wire<wire::clear_wrenches_v1>(v.bodies);
}
bool from_wire(const wire::clear_wrenches_v1& w, ClearWrenches& v) {
  return list_from_wire(w.cleared, v.bodies);
}

wire::set_motion_v1 to_wire(const SetMotion& v) {
  return list_to_wire<wire::set_motion_v1>(v.motions);
}
bool from_wire(const wire::set_motion_v1& w, SetMotion& v) {
  return list_from_wire(w.motions, v.motions);
}

wire::set_gravity_v1 to_wire(const SetGravity& v) {
  wire::set_gravity_v1 w{};
  put(v.gravity_W, w.gravity_mps2);
  return w;
}
bool from_wire(const wire::set_gravity_v1& w, SetGravity& v) {
  v.gravity_W = vector(w.gravity_mps2);
  return true;
}

wire::control_v1 to_wire(const Control& v) {
  wire::control_v1 w{};
  w.action = static_cast<std::int32_t>(v.action);
  w.steps = v.steps;
  return w;
}
bool from_wire(const wire::control_v1& w, Control& v) {
  v.steps = w.steps;
  return is_integer(w.steps) && get(w.action, ControlAction::shutdown, v.action);
}

// --- of the server ----------------------------------------------------------------------------

wire::receipts_v1 to_wire(const Receipts& v) {
  auto w = list_to_wire<wire::receipts_v1>(v.receipts);
  w.epoch = v.epoch;
  return w;
}
bool from_wire(const wire::receipts_v1& w, Receipts& v) {
  v.epoch = w.epoch;
  return is_integer(w.epoch, 1) && list_from_wire(w.receipts, v.receipts);
}

wire::body_states_v1 to_wire(const StateChunk& v) {
  auto w = list_to_wire<wire::body_states_v1>(v.states);
  w.epoch = v.epoch;
  w.tick = v.tick;
  w.tick_time_us = v.tick_time_us;
  w.sent_us = v.sent_us;
  w.chunk = v.chunk;
  w.chunks = v.chunks;
  w.first_body = v.first_body.value;
  w.last_body = v.last_body.value;
  return w;
}
bool from_wire(const wire::body_states_v1& w, StateChunk& v) {
  v.epoch = w.epoch;
  v.tick = w.tick;
  v.tick_time_us = w.tick_time_us;
  v.sent_us = w.sent_us;
  v.chunk = w.chunk;
  v.chunks = w.chunks;
  v.first_body.value = w.first_body;
  v.last_body.value = w.last_body;
  if (!is_integer(w.epoch, 1) || !is_integer(w.tick) || !is_integer(w.tick_time_us) ||
      !is_integer(w.sent_us) || !is_integer(w.first_body) || !is_integer(w.last_body) ||
      w.chunk < 0 || w.chunk >= w.chunks || !list_from_wire(w.states, v.states)) {
    return false;
  }
  const auto by_id = [](const BodyState& a, const BodyState& b) { return a.body < b.body; };
  const bool is_ascending =
      std::adjacent_find(v.states.begin(), v.states.end(), [&](const auto& a, const auto& b) {
        return !by_id(a, b);
      }) == v.states.end();
  return is_ascending && (v.states.empty() || (v.states.front().body >= v.first_body &&
                                               v.states.back().body <= v.last_body));
}

wire::events_v2 to_wire(const Events& v) {
  auto w = list_to_wire<wire::events_v2>(v.events);
  w.epoch = v.epoch;
  w.first = v.first;
  return w;
}
bool from_wire(const wire::events_v2& w, Events& v) {
  v.epoch = w.epoch;
  v.first = w.first;
  return is_integer(w.epoch, 1) && is_integer(w.first) && list_from_wire(w.events, v.events);
}

}  // namespace cradle
