#include "server/explain.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "server/collision/bounds.h"
#include "server/trace.h"

namespace cradle {
namespace {

struct Words {
  const char* what;
  const char* why;
};
constexpr std::array<Words, kOmissions> kWords{{
    {"rotation", "no angular velocity and no torque"},
    {"gyroscopic term", "equal principal moments, or driven"},
    {"torque series", "no torque"},
    {"third dimension", "a planar world: x, y and an angle"},
    {"smaller steps", "order 6 at its own rate, whatever others need"},
    {"sub-steps", "no contact: one step is exact for a constant force"},
    {"collision", "no shape, or none that collides"},
}};

/// Farthest point of the body from Bo, m.
double reach(const BodySpec& body, std::span<const GeometryPointer> geometries) {
  if (!is_stored(body.shape.kind)) return bounding_radius(body.shape);
  return bounding_radius(*geometries[static_cast<std::size_t>(body.shape.parameters[0]) - 1]);
}

FlightSample sample_of(const FlightAccount& account, double dt, double full_steps) {
  FlightSample sample;
  sample.dt = dt;
  sample.need = account.need;
  sample.start = account.start;
  sample.mass = account.mass;
  sample.inertia = account.inertia;
  sample.torque_W = account.torque_W;
  sample.torque_P = account.torque_P;
  sample.resultants = account.resultants;
  sample.full_steps = full_steps;
  return sample;
}

/// A bound as people read it; "-": no body of the row has one.
std::string number(double value, const Saving& saving) {
  if (saving.bounded == 0) return "-";
  if (!std::isfinite(saving.distance_m)) return "unknown";
  char text[20];
  std::snprintf(text, sizeof text, "%.1e", value);
  return text;
}

bool flies(Course course) {
  return course == Course::driven || course == Course::falls || course == Course::pushed;
}

}  // namespace

Explanation::Explanation(SceneRun& run) : run_(run) {
  run.world().keep_accounts();
  const Scene& scene = run.scene();
  for (const BodySpec& spec : scene.bodies) {
    Body& body = bodies_.emplace_back();
    body.reach_m = reach(spec, scene.geometries);
    const bool collides =
        spec.shape.kind != ShapeKind::none && run.world().can_collide(spec.shape.kind);
    body.does_without[static_cast<std::size_t>(Omission::contact)] = !collides;
  }
}

void Explanation::step(Executor& executor) {
  const StepReport report = run_.step(executor);
  sub_steps_most_ = std::max(sub_steps_most_, report.sub_steps_max);
  penetration_most_m_ = std::max(penetration_most_m_, report.penetration_max_m);
  const std::span<const SubStepChoice> choices = run_.world().sub_step_choices();
  if (!choices.empty()) {
    choices_.assign(choices.begin(), choices.end());
    choices_tick_ = run_.world().tick();
  }
  const std::span<const FlightAccount> accounts = run_.world().accounts();
  double most = 1;
  for (const FlightAccount& account : accounts) most = std::max(most, account.need.steps);
  steps_most_ = std::max(steps_most_, most);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    look(bodies_[i], accounts[i], kFullModel * most);
  }
}

void Explanation::look(Body& body, const FlightAccount& account, double full_steps) {
  body.offset_m = account.offset_m;
  const double dt = 1 / run_.world().settings().rate_hz;
  body.place_m = account.start.x.norm() + dt * account.start.v.norm();
  body.touched = body.touched || account.course == Course::touches;
  body.was_alone = body.was_alone || account.course == Course::moved;
  if (!flies(account.course)) return;
  const auto leave_out = [&](Omission omission) {
    body.does_without[static_cast<std::size_t>(omission)] = true;
  };
  const Turn turn = account.need.turn;
  leave_out(Omission::sub_steps);
  if (turn == Turn::none) leave_out(Omission::rotation);
  if (turn == Turn::steady || turn == Turn::twisted_round) leave_out(Omission::gyroscopic_term);
  if (turn == Turn::tumbling || turn == Turn::tumbling_fast) leave_out(Omission::torque_series);
  if (turn == Turn::planar) leave_out(Omission::third_dimension);
  if (account.need.steps > 0) leave_out(Omission::common_rate);
  if (!body.is_bounded() || account.course == Course::driven) return;

  body.error.fly(sample_of(account, dt, full_steps));
}

bool Explanation::bound(std::size_t i, Bound& bound) const {
  const Body& body = bodies_[i];
  bound.angle_rad = body.error.angle_rad();
  bound.distance_m = body.error.distance_m() + (body.reach_m + body.offset_m) * bound.angle_rad;
  // Bo is where Bcm is, less a turned vector: in each model rounded to half a digit of the place.
  constexpr double kDigit = std::numeric_limits<double>::epsilon();
  constexpr double kDigitsOfTurned = 4;  // of the vector: matrix and products, in two models
  if (body.offset_m > 0) {
    bound.distance_m += kDigit * (body.place_m + kDigitsOfTurned * body.offset_m);
  }
  return body.is_bounded();
}

std::array<Saving, kOmissions> Explanation::savings() const {
  // What is left out exactly has no error: the rest is the same to the last bit.
  constexpr std::array kInexact{Omission::rotation, Omission::gyroscopic_term,
                                Omission::third_dimension, Omission::common_rate};
  std::array<Saving, kOmissions> savings;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Bound of_body;
    const bool is_bounded = bound(i, of_body);
    for (std::size_t k = 0; k < kOmissions; ++k) {
      if (!bodies_[i].does_without[k]) continue;
      ++savings[k].bodies;
      savings[k].bounded += is_bounded ? 1 : 0;
      const auto omission = static_cast<Omission>(k);
      const bool is_exact = std::find(kInexact.begin(), kInexact.end(), omission) == kInexact.end();
      if (!is_bounded || is_exact) continue;
      savings[k].distance_m = std::max(savings[k].distance_m, of_body.distance_m);
      savings[k].angle_rad = std::max(savings[k].angle_rad, of_body.angle_rad);
    }
  }
  return savings;
}

std::int64_t Explanation::touching() const {
  return std::count_if(bodies_.begin(), bodies_.end(), [](const Body& b) { return b.touched; });
}

std::int64_t Explanation::one_by_one() const {
  return std::count_if(bodies_.begin(), bodies_.end(), [](const Body& b) { return b.was_alone; });
}

std::string describe_sub_steps(const Explanation& explanation, const WorldSettings& settings) {
  std::string text;
  const auto add = [&text](const char* format, const auto&... values) {
    char line[300];
    std::snprintf(line, sizeof line, format, values...);
    text += line;
  };
  add("\n%9s %8s %8s %12s  in tick %lld, the last in which somebody awake was in contact\n",
      "sub-steps", "groups", "bodies", "sag, mm",
      static_cast<long long>(explanation.choices_tick()));
  for (const SubStepChoice& c : explanation.choices()) {
    add("%9d %8d %8d %12.3g\n", c.sub_steps, c.islands, c.bodies, 1e3 * c.sag_m);
  }
  if (settings.solver == "hybrid") {
    text += "1 sub-step: groups at rest, solved at once by Newton's method, or left as they are;\n";
  }
  if (settings.solver != "soft" && settings.solver != "hybrid") {
    add("contact solver %s: sub-steps are its own, up to %d in this run, and no sag is foreseen;\n",
        settings.solver.c_str(), explanation.sub_steps_most());
  } else if (settings.sub_steps > 0) {
    add("groups of bodies in contact take %d sub-steps each, as the scene says;\n",
        settings.sub_steps);
  } else {
    add("each group of bodies in contact takes the sub-steps that keep its sag below %g mm, or "
        "what\n"
        "a body says, or what they move in a tick; a large one in turmoil three in five of these:\n"
        "up to %d in this run;\n",
        1e3 * settings.contact_tolerance_m, explanation.sub_steps_most());
  }
  add("sag: how far the most loaded contact is expected to sink in. The deepest overlap of any "
      "tick,\nimpacts included, was %.3g mm.\n",
      1e3 * explanation.penetration_most_m());
  return text;
}

std::string to_text(const Explanation& explanation, const SceneRun& run, std::int64_t ticks) {
  std::string text;
  const auto add = [&text](const char* format, const auto&... values) {
    char line[400];
    std::snprintf(line, sizeof line, format, values...);
    text += line;
  };
  const WorldSettings& settings = run.world().settings();
  add("%zu bodies, %lld ticks of %g ms\n\n", run.scene().bodies.size(),
      static_cast<long long>(ticks), 1000 / settings.rate_hz);
  add("%-16s %8s %9s %9s  %s\n", "left out", "bodies", "m", "rad", "why");
  const auto savings = explanation.savings();
  bool is_any_unknown = false;
  for (std::size_t k = 0; k < kOmissions; ++k) {
    if (savings[k].bodies == 0) continue;
    is_any_unknown = is_any_unknown || !std::isfinite(savings[k].distance_m);
    add("%-16s %8lld %9s %9s  %s\n", kWords[k].what, static_cast<long long>(savings[k].bodies),
        number(savings[k].distance_m, savings[k]).c_str(),
        number(savings[k].angle_rad, savings[k]).c_str(), kWords[k].why);
  }
  add("\nm, rad: how far any point and the attitude may end from those of the full model, in "
      "which\n"
      "every free body goes through every term of its equations in at least %g steps a tick: the\n"
      "largest of the row's bodies, each with all that it leaves out in other rows as well.\n",
      kFullModel * explanation.steps_most());
  if (is_any_unknown) {
    text += "unknown: some body's error may have grown beyond what can be bounded, up to pi rad.\n";
  }
  if (explanation.touching() > 0) {
    add("%lld bodies came into contact and are sub-stepped there: no bound.\n",
        static_cast<long long>(explanation.touching()));
    text += describe_sub_steps(explanation, settings);
  }
  if (explanation.one_by_one() > 0) {
    add("%lld bodies move one by one, with drag, springs or the scheme %s: not bounded here.\n",
        static_cast<long long>(explanation.one_by_one()), settings.scheme.c_str());
  }
  return text;
}

void explain(const ExplainOptions& options) {
  SimulateOptions run_options;
  run_options.dt_s = options.dt_s;
  run_options.scheme = options.scheme;
  Scene scene = load_scene(options.scene);
  scene.settings = settings_of(run_options, scene.settings);
  const std::int64_t ticks = ticks_of(options.duration_s, scene.settings);
  SceneRun run(std::move(scene));
  Explanation explanation(run);
  SerialExecutor executor;
  for (std::int64_t tick = 0; tick < ticks; ++tick) explanation.step(executor);
  Output output("-");
  output.write(to_text(explanation, run, ticks));
  output.finish();
}

}  // namespace cradle
