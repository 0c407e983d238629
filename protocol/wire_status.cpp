// The status of a world <-> its message.
#include <algorithm>
#include <iterator>

#include "protocol/wire_convert.h"
#include "protocol/wire_fields.h"

namespace cradle {
namespace {

using wire::world_status_v3;

/// Calls `f(ours, theirs)` for each number that both call the same.
template <class Status, class Message, class F>
void for_each_number(Status& v, Message& w, F&& f) {
  f(v.protocol_version, w.protocol_version);
  f(v.epoch, w.epoch);
  f(v.tick, w.tick);
  f(v.tick_time_us, w.tick_time_us);
  f(v.rate_hz, w.rate_hz);
  f(v.real_time_factor, w.real_time_factor);
  f(v.bodies, w.bodies);
  f(v.contacts, w.contacts);
  f(v.clients, w.clients);
  f(v.wrenches, w.wrenches);
  f(v.apply_us, w.apply_us);
  f(v.collide_us, w.collide_us);
  f(v.solve_us, w.solve_us);
  f(v.publish_us, w.publish_us);
  f(v.penetration_max_m, w.penetration_max_m);
  f(v.penetration_mean_m, w.penetration_mean_m);
  f(v.islands, w.islands);
  f(v.sub_steps_max, w.sub_steps_max);
  f(v.sag_expected_m, w.sag_expected_m);
  f(v.residual_mps, w.residual_mps);
  f(v.residual_relative, w.residual_relative);
  f(v.residual_signorini_mps, w.residual_signorini_mps);
  f(v.residual_cone_mps, w.residual_cone_mps);
  f(v.residual_complementarity_J, w.residual_complementarity_J);
  f(v.balance_tick, w.balance_tick);
  f(v.kinetic_change_J, w.kinetic_change_J);
  f(v.work_gravity_J, w.work_gravity_J);
  f(v.work_wrenches_J, w.work_wrenches_J);
  f(v.work_friction_J, w.work_friction_J);
  f(v.work_impacts_J, w.work_impacts_J);
  f(v.work_driven_J, w.work_driven_J);
  f(v.energy_unaccounted_J, w.energy_unaccounted_J);
  f(v.momentum_unaccounted_Ns, w.momentum_unaccounted_Ns);
  f(v.impacts, w.impacts);
  f(v.overruns, w.overruns);
  f(v.commands_applied, w.commands_applied);
  f(v.commands_refused, w.commands_refused);
  f(v.datagrams_rejected, w.datagrams_rejected);
  f(v.datagrams_dropped, w.datagrams_dropped);
  f(v.chunks_dropped, w.chunks_dropped);
  f(v.quarantined, w.quarantined);
  f(v.state_port, w.state_port);
  f(v.datagram_bytes, w.datagram_bytes);
  f(v.receive_buffer_bytes, w.receive_buffer_bytes);
}

}  // namespace

world_status_v3 to_wire(const WorldStatus& v) {
  world_status_v3 w{};
  w.flags = (v.paused ? world_status_v3::PAUSED : 0) |
            (v.lockstep ? world_status_v3::LOCKSTEP : 0) |
            (v.overloaded ? world_status_v3::OVERLOADED : 0) |
            (v.controllable ? world_status_v3::CONTROLLABLE : 0) |
            (v.contested ? world_status_v3::CONTESTED : 0);
  for_each_number(v, w, [](const auto& from, auto& to) { to = from; });
  put(v.name, w.name);
  return w;
}

bool from_wire(const world_status_v3& w, WorldStatus& v) {
  const int known = int{world_status_v3::PAUSED} + int{world_status_v3::LOCKSTEP} +
                    int{world_status_v3::OVERLOADED} + int{world_status_v3::CONTROLLABLE} +
                    int{world_status_v3::CONTESTED};
  v.paused = (w.flags & world_status_v3::PAUSED) != 0;
  v.lockstep = (w.flags & world_status_v3::LOCKSTEP) != 0;
  v.overloaded = (w.flags & world_status_v3::OVERLOADED) != 0;
  v.controllable = (w.flags & world_status_v3::CONTROLLABLE) != 0;
  v.contested = (w.flags & world_status_v3::CONTESTED) != 0;
  for_each_number(v, w, [](auto& to, const auto& from) { to = from; });
  const std::int64_t counts[] = {w.tick,
                                 w.tick_time_us,
                                 w.bodies,
                                 w.contacts,
                                 w.clients,
                                 w.wrenches,
                                 w.overruns,
                                 w.commands_applied,
                                 w.commands_refused,
                                 w.datagrams_rejected,
                                 w.datagrams_dropped,
                                 w.chunks_dropped,
                                 w.quarantined,
                                 w.islands,
                                 w.sub_steps_max,
                                 w.impacts,
                                 w.state_port,
                                 w.datagram_bytes,
                                 w.receive_buffer_bytes};
  return (w.flags & ~known) == 0 && is_integer(w.epoch, 1) &&
         std::all_of(std::begin(counts), std::end(counts), [](auto n) { return is_integer(n); }) &&
         get(w.name, v.name);
}

}  // namespace cradle
