/// Values <-> generated types, field by field. Only codec.cpp, wire_convert.cpp and wire_status.cpp
/// include this.
///
/// `from_wire` is false where a field has no meaning: an unknown enumerator or flag, an integer
/// beyond 2^53 - 1 or below its range, a name without its zero padding.
#pragma once

#include <cradle_wire/body_states_v1.hpp>
#include <cradle_wire/clear_wrenches_v1.hpp>
#include <cradle_wire/control_v1.hpp>
#include <cradle_wire/despawn_v1.hpp>
#include <cradle_wire/events_v2.hpp>
#include <cradle_wire/hello_v1.hpp>
#include <cradle_wire/receipts_v1.hpp>
#include <cradle_wire/set_gravity_v1.hpp>
#include <cradle_wire/set_motion_v1.hpp>
#include <cradle_wire/spawn_v3.hpp>
#include <cradle_wire/world_status_v3.hpp>
#include <cradle_wire/wrench_v1.hpp>

#include "protocol/messages.h"

namespace cradle {

namespace wire = cradle_wire;

wire::command_header_v1 to_wire(const CommandHeader& v);
wire::hello_v1 to_wire(const Hello& v);
wire::spawn_v3 to_wire(const Spawn& v);
wire::despawn_v1 to_wire(const Despawn& v);
wire::wrench_v1 to_wire(const Push& v);
wire::clear_wrenches_v1 to_wire(const ClearWrenches& v);
wire::set_motion_v1 to_wire(const SetMotion& v);
wire::set_gravity_v1 to_wire(const SetGravity& v);
wire::control_v1 to_wire(const Control& v);
wire::receipts_v1 to_wire(const Receipts& v);
wire::world_status_v3 to_wire(const WorldStatus& v);
wire::body_states_v1 to_wire(const StateChunk& v);
wire::events_v2 to_wire(const Events& v);

bool from_wire(const wire::command_header_v1& w, CommandHeader& v);
bool from_wire(const wire::hello_v1& w, Hello& v);
bool from_wire(const wire::spawn_v3& w, Spawn& v);
bool from_wire(const wire::despawn_v1& w, Despawn& v);
bool from_wire(const wire::wrench_v1& w, Push& v);
bool from_wire(const wire::clear_wrenches_v1& w, ClearWrenches& v);
bool from_wire(const wire::set_motion_v1& w, SetMotion& v);
bool from_wire(const wire::set_gravity_v1& w, SetGravity& v);
bool from_wire(const wire::control_v1& w, Control& v);
bool from_wire(const wire::receipts_v1& w, Receipts& v);
bool from_wire(const wire::world_status_v3& w, WorldStatus& v);
bool from_wire(const wire::body_states_v1& w, StateChunk& v);
bool from_wire(const wire::events_v2& w, Events& v);

// The one array of each message that has a count.
inline auto& items_of(wire::spawn_v3& w) { return w.bodies; }
inline auto& items_of(wire::despawn_v1& w) { return w.removed; }
inline auto& items_of(wire::wrench_v1& w) { return w.wrenches; }
inline auto& items_of(wire::clear_wrenches_v1& w) { return w.cleared; }
inline auto& items_of(wire::set_motion_v1& w) { return w.motions; }
inline auto& items_of(wire::receipts_v1& w) { return w.receipts; }
inline auto& items_of(wire::body_states_v1& w) { return w.states; }
inline auto& items_of(wire::events_v2& w) { return w.events; }

}  // namespace cradle
