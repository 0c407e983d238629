#include "server/trace.h"

#include <cradle/version.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <iostream>
#include <system_error>

namespace cradle {
namespace {

std::string text_of(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", number);
  return text;
}

std::string text_of(const std::array<std::uint8_t, 8>& bytes) {
  std::string text;
  char digits[3];
  for (unsigned byte : bytes) {
    std::snprintf(digits, sizeof digits, "%02x", byte);
    text += digits;
  }
  return text;
}

/// One flat JSON object, a key a line.
class JsonObject {
 public:
  void add(const char* key, std::int64_t value) { add_raw(key, std::to_string(value)); }
  void add(const char* key, int value) { add_raw(key, std::to_string(value)); }
  void add(const char* key, double value) { add_raw(key, number(value)); }
  void add(const char* key, const Vec3& v) {
    add_raw(key, "[" + number(v.x) + ", " + number(v.y) + ", " + number(v.z) + "]");
  }
  void add(const char* key, const std::string& value) { add_raw(key, quoted(value)); }
  std::string text() const { return "{\n" + members_ + "\n}\n"; }

 private:
  /// JSON has no infinity and no NaN.
  static std::string number(double value) { return std::isfinite(value) ? text_of(value) : "null"; }

  static std::string quoted(const std::string& value) {
    std::string text = "\"";
    for (char c : value) {
      if (c == '"' || c == '\\') text += '\\';
      if (static_cast<unsigned char>(c) >= 0x20) {
        text += c;
        continue;
      }
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\u%04x", static_cast<unsigned>(c));
      text += escape;
    }
    return text + '"';
  }

  void add_raw(const char* key, const std::string& value) {
    members_ += (members_.empty() ? "  \"" : ",\n  \"") + std::string(key) + "\": " + value;
  }

  std::string members_;
};

}  // namespace

Output::Output(const std::string& path) : path_(path) {
  if (path_ == "-") return;
  errno = 0;
  file_.open(path_, std::ios::binary);
  if (!file_) throw OutputError(path_ + ": " + std::generic_category().message(errno));
}

std::ostream& Output::stream() { return path_ == "-" ? std::cout : file_; }

void Output::write(const std::string& text) {
  errno = 0;
  if (!(stream() << text) && error_ == 0) error_ = errno;
}

void Output::finish() {
  errno = error_;
  if (stream() && stream().flush()) return;
  const std::string reason =
      errno != 0 ? std::generic_category().message(errno) : "not all written";
  throw OutputError((path_ == "-" ? "standard output" : path_) + ": " + reason);
}

std::string trace_line(Tick tick, double time_s, const std::string& name, const BodyState& s) {
  std::string line = std::to_string(tick) + "," + text_of(time_s) + "," + name;
  for (double number : {s.p_WBo.x, s.p_WBo.y, s.p_WBo.z, s.q_WB.w, s.q_WB.x, s.q_WB.y, s.q_WB.z,
                        s.v_WBcm.x, s.v_WBcm.y, s.v_WBcm.z, s.w_WB.x, s.w_WB.y, s.w_WB.z}) {
    line += ',';
    line += text_of(number);
  }
  return line + '\n';
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string to_json(const Summary& s) {
  JsonObject json;
  json.add("version", std::string(CRADLE_VERSION));
  json.add("scene", s.scene);
  json.add("solver", s.settings.solver);
  json.add("scheme", s.settings.scheme);
  json.add("dt_s", 1 / s.settings.rate_hz);
  json.add("sub_steps", s.settings.sub_steps);
  json.add("contact_tolerance_m", s.settings.sub_steps > 0 ? 0 : s.settings.contact_tolerance_m);
  json.add("sub_steps_max", s.sub_steps_max);
  json.add("sag_expected_m", s.last_step.sag_expected_m);
  json.add("islands_makeshift", s.islands_makeshift);
  json.add("islands_at_rest", s.last_step.islands_at_rest);
  json.add("islands_by_newton", s.last_step.islands_by_newton);
  json.add("impacts", s.impacts);
  json.add("impacts_ordered", s.impacts_ordered);
  json.add("impacts_spent", s.impacts_spent);
  json.add("threads", s.threads);
  json.add("ticks", s.ticks);
  json.add("wall_time_s", s.wall_time_s);
  json.add("us_per_tick_median", s.tick_times.median_us);
  json.add("us_per_tick_mean", s.tick_times.mean_us);
  json.add("us_per_tick_p99", s.tick_times.p99_us);
  json.add("bodies", s.bodies);
  json.add("quarantined", s.quarantined);
  json.add("steps_unsolved", s.steps_unsolved);
  json.add("springs_unconverged", s.springs_unconverged);
  json.add("not_colliding", s.not_colliding);
  json.add("pairs_by", std::string(s.last_step.pairs_by));
  json.add("crowded_max", s.crowded_max);
  json.add("stopped_at_impact", s.stopped_at_impact);
  json.add("impacts_unresolved", s.impacts_unresolved);
  json.add("spins_cut", s.spins_cut);
  json.add("ticks_in_halves", s.ticks_in_halves);
  json.add("surfaces_passing_max", s.surfaces_passing_max);
  json.add("asleep", s.last_step.sleeping);
  json.add("contacts", s.last_step.contacts);
  json.add("penetration_max_m", s.penetration_max_m);
  json.add("penetration_mean_m", s.last_step.penetration_mean_m);
  json.add("residual_max_mps", s.residual_max_mps);
  json.add("residual_relative_max", s.residual_relative_max);
  json.add("residual_mps", s.last_step.residual_mps);
  json.add("residual_relative", s.last_step.residual_relative);
  json.add("residual_signorini_mps", s.last_step.residual_signorini_mps);
  json.add("residual_cone_mps", s.last_step.residual_cone_mps);
  json.add("residual_complementarity_J", s.last_step.residual_complementarity_J);
  json.add("balanced_ticks", s.balance.tick);
  json.add("kinetic_change_J", s.balance.kinetic_J);
  json.add("work_gravity_J", s.balance.gravity_J);
  json.add("work_wrenches_J", s.balance.wrenches_J);
  json.add("work_friction_J", s.balance.friction_J);
  json.add("work_impacts_J", s.balance.impacts_J);
  json.add("work_driven_J", s.balance.driven_J);
  json.add("energy_unaccounted_J", s.balance.unaccounted_J);
  json.add("energy_unaccounted_max_J", s.energy_unaccounted_max_J);
  json.add("energy_paid_J", s.energy_paid_J);
  json.add("momentum_unaccounted_max_Ns", s.momentum_unaccounted_max_Ns);
  json.add("kinetic_energy_J", s.totals.kinetic_energy_J);
  json.add("potential_energy_J", s.totals.potential_energy_J);
  json.add("energy_J", s.totals.kinetic_energy_J + s.totals.potential_energy_J);
  json.add("momentum_Ns", s.totals.momentum_Ns);
  json.add("angular_momentum_Nms", s.totals.angular_momentum_Nms);
  json.add("hash", text_of(s.hash));
  return json.text();
}

}  // namespace cradle
