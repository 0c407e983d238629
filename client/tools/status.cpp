#include "status.h"

#include <cmath>
#include <utility>
#include <vector>

#include "text.h"

namespace cradle::tool {
namespace {

std::string mood(const WorldStatus& s) {
  std::string words = s.paused ? "paused" : s.lockstep ? "in lockstep" : "running";
  if (s.overloaded) words += ", overloaded";
  return words;
}

std::string json_number(double value) {
  return std::isfinite(value) ? format("%.17g", value) : "null";  // JSON has no infinity
}

std::string json_string(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    const bool is_special = c == '"' || c == '\\' || static_cast<unsigned char>(c) < 0x20;
    quoted += is_special ? format("\\u%04x", static_cast<unsigned>(c)) : std::string(1, c);
  }
  return quoted + '"';
}

}  // namespace

std::string describe(const WorldStatus& s) {
  const double tick_us = s.apply_us + s.collide_us + s.solve_us + s.publish_us;
  std::string text;
  const auto line = [&text](const char* head, const std::string& rest) {
    text += format("  %-9s %s\n", head, rest.c_str());
  };
  text += format("%s: %s\n", s.name.c_str(), mood(s).c_str());
  if (s.contested) line("WARNING", "another server claims this world: end one of them");
  line("time", format("%.2f s, tick %lld at %g Hz, %.2f times real time, %lld overruns",
                      1e-6 * static_cast<double>(s.tick_time_us), wide(s.tick), s.rate_hz,
                      s.real_time_factor, wide(s.overruns)));
  line("bodies", format("%lld, %lld contact points, %lld pushes acting, %lld quarantined",
                        wide(s.bodies), wide(s.contacts), wide(s.wrenches), wide(s.quarantined)));
  line("overlap", format("%.3f mm at most, %.3f mm mean", 1e3 * s.penetration_max_m,
                         1e3 * s.penetration_mean_m));
  line("contacts", format("%lld islands, %d sub-steps at most, %.3f mm of sag expected, %d impacts",
                          wide(s.islands), s.sub_steps_max, 1e3 * s.sag_expected_m, s.impacts));
  line("residual", format("%.3g mm/s, %.2g relative; Signorini %.3g mm/s, cone %.3g mm/s, "
                          "complementarity %.3g J",
                          1e3 * s.residual_mps, s.residual_relative, 1e3 * s.residual_signorini_mps,
                          1e3 * s.residual_cone_mps, s.residual_complementarity_J));
  line("energy", s.balance_tick == 0
                     ? std::string("no balance yet")
                     : format("%.3g J in tick %lld: gravity %.3g, pushes %.3g, friction %.3g, "
                              "impacts %.3g, driven %.3g; unaccounted %.3g J, %.3g N s",
                              s.kinetic_change_J, wide(s.balance_tick), s.work_gravity_J,
                              s.work_wrenches_J, s.work_friction_J, s.work_impacts_J,
                              s.work_driven_J, s.energy_unaccounted_J, s.momentum_unaccounted_Ns));
  line("tick", format("%.0f us: apply %.0f, collide %.0f, solve %.0f, publish %.0f", tick_us,
                      s.apply_us, s.collide_us, s.solve_us, s.publish_us));
  line("clients", format("%lld, %lld commands applied, %lld refused", wide(s.clients),
                         wide(s.commands_applied), wide(s.commands_refused)));
  line("wire",
       format("%lld datagrams rejected, %lld dropped, %lld chunks of states dropped",
              wide(s.datagrams_rejected), wide(s.datagrams_dropped), wide(s.chunks_dropped)));
  line("server",
       format("protocol %d, epoch %lld, states on port %d, datagrams up to %d B, "
              "receive buffer %d KiB, %s",
              s.protocol_version, wide(s.epoch), s.state_port, s.datagram_bytes,
              s.receive_buffer_bytes / 1024, s.controllable ? "controllable" : "not controllable"));
  return text;
}

std::string to_json(const WorldStatus& s) {
  const auto integer = [](std::int64_t value) { return std::to_string(value); };
  const auto boolean = [](bool value) { return std::string(value ? "true" : "false"); };
  const std::vector<std::pair<const char*, std::string>> fields = {
      {"name", json_string(s.name)},
      {"protocol_version", integer(s.protocol_version)},
      {"paused", boolean(s.paused)},
      {"lockstep", boolean(s.lockstep)},
      {"overloaded", boolean(s.overloaded)},
      {"controllable", boolean(s.controllable)},
      {"contested", boolean(s.contested)},
      {"epoch", integer(s.epoch)},
      {"tick", integer(s.tick)},
      {"tick_time_us", integer(s.tick_time_us)},
      {"rate_hz", json_number(s.rate_hz)},
      {"real_time_factor", json_number(s.real_time_factor)},
      {"bodies", integer(s.bodies)},
      {"contacts", integer(s.contacts)},
      {"clients", integer(s.clients)},
      {"wrenches", integer(s.wrenches)},
      {"apply_us", json_number(s.apply_us)},
      {"collide_us", json_number(s.collide_us)},
      {"solve_us", json_number(s.solve_us)},
      {"publish_us", json_number(s.publish_us)},
      {"penetration_max_m", json_number(s.penetration_max_m)},
      {"penetration_mean_m", json_number(s.penetration_mean_m)},
      {"islands", integer(s.islands)},
      {"sub_steps_max", integer(s.sub_steps_max)},
      {"sag_expected_m", json_number(s.sag_expected_m)},
      {"residual_mps", json_number(s.residual_mps)},
      {"residual_relative", json_number(s.residual_relative)},
      {"residual_signorini_mps", json_number(s.residual_signorini_mps)},
      {"residual_cone_mps", json_number(s.residual_cone_mps)},
      {"residual_complementarity_J", json_number(s.residual_complementarity_J)},
      {"balance_tick", integer(s.balance_tick)},
      {"kinetic_change_J", json_number(s.kinetic_change_J)},
      {"work_gravity_J", json_number(s.work_gravity_J)},
      {"work_wrenches_J", json_number(s.work_wrenches_J)},
      {"work_friction_J", json_number(s.work_friction_J)},
      {"work_impacts_J", json_number(s.work_impacts_J)},
      {"work_driven_J", json_number(s.work_driven_J)},
      {"energy_unaccounted_J", json_number(s.energy_unaccounted_J)},
      {"momentum_unaccounted_Ns", json_number(s.momentum_unaccounted_Ns)},
      {"impacts", integer(s.impacts)},
      {"overruns", integer(s.overruns)},
      {"commands_applied", integer(s.commands_applied)},
      {"commands_refused", integer(s.commands_refused)},
      {"datagrams_rejected", integer(s.datagrams_rejected)},
      {"datagrams_dropped", integer(s.datagrams_dropped)},
      {"chunks_dropped", integer(s.chunks_dropped)},
      {"quarantined", integer(s.quarantined)},
      {"state_port", integer(s.state_port)},
      {"datagram_bytes", integer(s.datagram_bytes)},
      {"receive_buffer_bytes", integer(s.receive_buffer_bytes)},
  };
  std::string json = "{";
  for (const auto& [key, value] : fields) {
    json += (json.size() > 1 ? ", " : "") + json_string(key) + ": " + value;
  }
  return json + "}\n";
}

}  // namespace cradle::tool
