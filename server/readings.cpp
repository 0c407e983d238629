#include "server/readings.h"

#include <cradle/version.h>

#include <algorithm>
#include <charconv>
#include <initializer_list>
#include <string_view>

#include "server/log.h"

namespace cradle {
namespace {

struct Label {
  std::string_view name, value;
};

/// Writes families of samples. Values of labels need no escape: they are constants and world names.
class Page {
 public:
  void begin(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    append({"# HELP ", name, " ", help, "\n# TYPE ", name, " ", type, "\n"});
  }

  void sample(std::initializer_list<Label> labels, auto value, std::string_view suffix = "") {
    append({name_, suffix});
    char separator = '{';
    for (const Label& label : labels) {
      text_ += separator;
      append({label.name, "=\"", label.value, "\""});
      separator = ',';
    }
    append({labels.size() == 0 ? " " : "} ", number(value), "\n"});
  }

  void counter(std::string_view name, std::string_view help, auto value) {
    begin(name, "counter", help);
    sample({}, value);
  }
  void gauge(std::string_view name, std::string_view help, auto value) {
    begin(name, "gauge", help);
    sample({}, value);
  }

  /// `labels`: none, or one.
  void histogram(const DurationHistogram& histogram, Label label = {}) {
    const bool has_label = !label.name.empty();
    const auto bucket = [&](std::string_view bound, std::int64_t count) {
      if (has_label) {
        sample({label, {"le", bound}}, count, "_bucket");
      } else {
        sample({{"le", bound}}, count, "_bucket");
      }
    };
    std::int64_t count = 0;
    for (std::size_t i = 0; i < DurationHistogram::kBounds_s.size(); ++i) {
      count += histogram.counts[i];
      bucket(number(DurationHistogram::kBounds_s[i]), count);
    }
    count += histogram.counts.back();
    bucket("+Inf", count);
    if (has_label) {
      sample({label}, histogram.sum_s, "_sum");
      sample({label}, count, "_count");
    } else {
      sample({}, histogram.sum_s, "_sum");
      sample({}, count, "_count");
    }
  }

  std::string take() { return std::move(text_); }

 private:
  void append(std::initializer_list<std::string_view> parts) {
    for (const std::string_view part : parts) text_ += part;
  }
  static std::string number(auto value) {
    std::array<char, 32> digits{};
    return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
  }

  std::string text_;
  std::string_view name_;
};

void write_time(Page& page, const Readings& r) {
  page.counter("cradle_ticks_total", "Ticks made since the start.", r.tick);
  page.begin("cradle_tick_seconds", "histogram", "Wall time of a tick.");
  page.histogram(r.ticks.whole);
  page.begin("cradle_tick_phase_seconds", "histogram", "Wall time of a tick's parts.");
  page.histogram(r.ticks.apply, {"phase", "apply"});
  page.histogram(r.ticks.collide, {"phase", "collide"});
  page.histogram(r.ticks.solve, {"phase", "solve"});
  page.histogram(r.ticks.publish, {"phase", "publish"});
  page.gauge("cradle_tick_period_seconds", "Simulated time of a tick.", r.period_s);
  page.counter("cradle_tick_overruns_total", "Ticks that came too late and slowed time.",
               r.overruns);
  page.gauge("cradle_real_time_factor", "Simulated over wall time, over the last second.",
             r.real_time_factor);
}

void write_world(Page& page, const Readings& r) {
  page.gauge("cradle_bodies", "Bodies there are.", r.bodies);
  page.gauge("cradle_bodies_awake",
             "Dynamic bodies that are simulated: neither asleep nor in quarantine.", r.awake);
  page.gauge("cradle_contacts", "Touching contact points in the last tick.", r.contacts);
  page.gauge("cradle_bodies_crowded",
             "Bodies of which the last tick left out pairs: too many are in one place.", r.crowded);
  page.gauge("cradle_surface_pairs_passing",
             "Pairs of two meshes or height fields in one place in the last tick: these do not "
             "collide yet.",
             r.surfaces_passing);
  page.gauge("cradle_wrenches", "Wrenches that act.", r.wrenches);
  page.counter("cradle_energy_paid_joules_total",
               "Energy that what bounces for ever paid for overlaps that were pushed out.",
               r.energy_paid_J);
  page.counter(
      "cradle_springs_unconverged_total",
      "Parts of ticks in which springs were too stiff for their equations: impulses instead.",
      r.springs_unconverged);
  page.counter("cradle_islands_makeshift_total",
               "Times that a contact solver other than soft had to solve an island by a makeshift.",
               r.islands_makeshift);
  page.gauge("cradle_islands_at_rest",
             "Groups of bodies for which the contact solver hybrid had nothing to solve.",
             r.last_step.islands_at_rest);
  page.gauge("cradle_islands_by_newton", "Likewise, that Newton's method moved.",
             r.last_step.islands_by_newton);
  page.counter("cradle_steps_unsolved_total",
               "Steps of bodies whose implicit scheme did not solve its equations.",
               r.steps_unsolved);
  page.counter("cradle_bodies_stopped_at_impact_total",
               "Times that a fast body lost the rest of a tick to what it would have passed.",
               r.stopped_at_impact);
  page.counter("cradle_impacts_total", "Impacts of flying balls, each at its time.", r.impacts);
  page.counter("cradle_impacts_ordered_total",
               "Sets of impacts at once that were too large to be solved together.",
               r.impacts_ordered);
  page.counter("cradle_impacts_spent_total",
               "Times that a ball had so many impacts that it lost the rest of a tick.",
               r.impacts_spent);
  page.counter("cradle_impacts_unresolved_total",
               "Searches for a time of impact that ended early, and bodies that stayed for it.",
               r.impacts_unresolved);
  page.counter("cradle_spins_cut_total",
               "Times that a body in contact would have spun beyond the limit, and was slowed.",
               r.spins_cut);
  page.counter("cradle_ticks_in_halves_total",
               "Ticks that looked for contacts twice, since some closed fast (collides_twice).",
               r.ticks_in_halves);
  page.counter("cradle_quarantines_total", "Bodies taken out of the simulation.", r.quarantines);
}

void write_accuracy(Page& page, const Readings& r) {
  const StepReport& step = r.last_step;
  page.begin("cradle_penetration_meters", "gauge",
             "Depth of touching contact points at the last tick's start.");
  page.sample({{"of", "max"}}, step.penetration_max_m);
  page.sample({{"of", "mean"}}, step.penetration_mean_m);
  page.gauge("cradle_sag_expected_meters",
             "How far contacts sink in by the loads that last, as stiff as they are.",
             step.sag_expected_m);
  page.gauge("cradle_sub_steps_max", "Most sub-steps that a group of bodies in contact took.",
             step.sub_steps_max);
  page.begin("cradle_contact_residual_meters_per_second", "gauge",
             "How far the worst contact point is from the laws of contact at the last tick's end.");
  page.sample({{"law", "natural_map"}}, step.residual_mps);
  page.sample({{"law", "signorini"}}, step.residual_signorini_mps);
  page.sample({{"law", "cone"}}, step.residual_cone_mps);
  page.gauge("cradle_contact_complementarity_joules",
             "Of the worst point: friction that does not oppose the sliding at its limit.",
             step.residual_complementarity_J);
  page.gauge("cradle_contact_residual_ratio",
             "Natural map of all contact points by their impulses and velocities.",
             step.residual_relative);
  const StepBalance& balance = step.balance;
  page.gauge("cradle_balance_tick", "The tick that the balance is of; 0: none yet.", balance.tick);
  page.gauge("cradle_kinetic_change_joules",
             "Change of the kinetic energy of bodies in contact in that tick.", balance.kinetic_J);
  page.begin("cradle_work_joules", "gauge",
             "What changed it, by what; below 0 where it was taken.");
  page.sample({{"by", "gravity"}}, balance.gravity_J);
  page.sample({{"by", "wrenches"}}, balance.wrenches_J);
  page.sample({{"by", "friction"}}, balance.friction_J);
  page.sample({{"by", "impacts"}}, balance.impacts_J);
  page.sample({{"by", "kinematic_bodies"}}, balance.driven_J);
  page.sample({{"by", "unaccounted"}}, balance.unaccounted_J);
  page.gauge("cradle_momentum_unaccounted_newton_seconds",
             "Momentum that they got beyond what loads and what does not yield gave them.",
             balance.momentum_unaccounted_Ns);
}

void write_commands(Page& page, const Readings& r) {
  page.gauge("cradle_clients", "Clients heard within the last 10 s.", r.clients);
  page.begin("cradle_commands_total", "counter",
             "Answers to commands, by result; what was queued or held is answered again.");
  for (int code = 0; code < kServerResults; ++code) {
    const std::string_view name = to_string(static_cast<Result>(code));
    if (name == "unlisted") continue;
    page.sample({{"result", name}}, r.answers[static_cast<std::size_t>(code)]);
  }
  page.counter("cradle_answers_repeated_total", "Answers sent again because a command came again.",
               r.repeated_answers);
}

void write_network(Page& page, const Readings& r) {
  const auto fault = [&](DatagramFault f) { return r.control.faults[static_cast<std::size_t>(f)]; };
  page.counter("cradle_datagrams_received_total",
               "LCM messages on the port of commands, our own too.", r.control.received);
  page.begin("cradle_datagrams_rejected_total", "counter",
             "Datagrams on the port of commands that are no command, by reason.");
  page.sample({{"reason", "too_short"}}, fault(DatagramFault::too_short));
  page.sample({{"reason", "bad_magic"}}, fault(DatagramFault::bad_magic));
  page.sample({{"reason", "fragment"}}, fault(DatagramFault::fragment));
  page.sample({{"reason", "bad_channel"}}, fault(DatagramFault::bad_channel));
  page.sample({{"reason", "too_long"}}, fault(DatagramFault::too_long));
  page.sample({{"reason", "unknown_channel"}}, r.unknown_channel);
  page.sample({{"reason", "no_count"}}, r.inbox.no_count);
  page.sample({{"reason", "bad_count"}}, r.inbox.bad_count);
  page.sample({{"reason", "wrong_size"}}, r.inbox.wrong_size);
  page.sample({{"reason", "malformed"}}, r.malformed);
  page.begin("cradle_datagrams_dropped_total", "counter",
             "Datagrams lost on our side for want of room, by where.");
  page.sample({{"reason", "kernel_buffer"}}, r.control.dropped_by_kernel);
  page.sample({{"reason", "inbox_full"}}, r.inbox.dropped);
  page.begin("cradle_datagrams_sent_total", "counter", "Datagrams sent, by port.");
  page.sample({{"port", "control"}}, r.control.sent);
  page.sample({{"port", "states"}}, r.states.sent);
  page.begin("cradle_sent_bytes_total", "counter", "Payload of datagrams sent, by port.");
  page.sample({{"port", "control"}}, r.control.sent_bytes);
  page.sample({{"port", "states"}}, r.states.sent_bytes);
  page.begin("cradle_send_failures_total", "counter", "Datagrams the host did not send, by port.");
  page.sample({{"port", "control"}}, r.control.send_failures);
  page.sample({{"port", "states"}}, r.states.send_failures);
  page.counter("cradle_chunks_sent_total", "Chunks of states sent.", r.states.sent);
  page.begin("cradle_chunks_dropped_total", "counter", "Chunks of states not sent, by reason.");
  page.sample({{"reason", "overtaken"}}, r.chunks_overtaken);
  page.sample({{"reason", "send_failed"}}, r.states.send_failures);
}

}  // namespace

void DurationHistogram::add(double duration_s) {
  const auto bucket = std::lower_bound(kBounds_s.begin(), kBounds_s.end(), duration_s);
  ++counts[static_cast<std::size_t>(bucket - kBounds_s.begin())];
  sum_s += duration_s;
}

std::string metrics_text(const Readings& r) {
  Page page;
  page.begin("cradle_build_info", "gauge", "What runs here; always 1.");
  page.sample({{"version", CRADLE_VERSION}, {"protocol", std::to_string(kProtocolVersion)}}, 1);
  page.begin("cradle_world_info", "gauge", "Which world this is; always 1.");
  page.sample({{"world", r.world}}, 1);
  write_time(page, r);
  write_world(page, r);
  write_accuracy(page, r);
  write_commands(page, r);
  write_network(page, r);
  page.begin("cradle_log_lines_dropped_total", "counter",
             "Lines that the log does not show, by reason.");
  page.sample({{"reason", "repeated"}}, r.log_lines_left_out);
  page.sample({{"reason", "stderr_full"}}, log_lines_lost());
  return page.take();
}

void ReadingsBoard::put(const Readings& readings) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (lock) latest_ = readings;
}

}  // namespace cradle
