#include "server/simulate.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "server/stopwatch.h"
#include "server/thread_pool.h"
#include "server/trace.h"

namespace cradle {
namespace {

void check_range(const std::string& option, double value, double least, double most) {
  if (value >= least && value <= most) return;
  char text[80];
  std::snprintf(text, sizeof text, " must be %g to %g", least, most);
  throw OptionError(option + text);
}

/// Writes all bodies after each tick, under their names or ids.
class Trace {
 public:
  Trace(const std::string& path, const SceneRun& run) : output_(path) {
    for (const BodySpec& body : run.scene().bodies) {
      const std::string id = std::to_string(run.id(names_.size()).value);
      names_.push_back(body.name.empty() ? id : csv_field(body.name));
    }
    output_.write(kTraceHeader);
  }

  void write(const World& world) {
    world.snapshot(states_);
    const double time_s = static_cast<double>(world.tick()) / world.settings().rate_hz;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      output_.write(trace_line(world.tick(), time_s, names_[i], states_[i]));
    }
  }

  void finish() { output_.finish(); }

 private:
  Output output_;
  std::vector<std::string> names_;
  std::vector<BodyState> states_;
};

/// Of the last step.
void add_accuracy(Summary& s, Tick tick) {
  s.residual_max_mps = std::max(s.residual_max_mps, s.last_step.residual_mps);
  s.residual_relative_max = std::max(s.residual_relative_max, s.last_step.residual_relative);
  const StepBalance& one = s.last_step.balance;
  // The report of a tick without one has the last that there was.
  if (one.tick == 0 || one.tick != tick) return;
  ++s.balance.tick;
  s.balance.kinetic_J += one.kinetic_J;
  s.balance.gravity_J += one.gravity_J;
  s.balance.wrenches_J += one.wrenches_J;
  s.balance.friction_J += one.friction_J;
  s.balance.impacts_J += one.impacts_J;
  s.balance.driven_J += one.driven_J;
  s.balance.unaccounted_J += one.unaccounted_J;
  s.energy_unaccounted_max_J = std::max(s.energy_unaccounted_max_J, std::abs(one.unaccounted_J));
  s.momentum_unaccounted_max_Ns =
      std::max(s.momentum_unaccounted_max_Ns, one.momentum_unaccounted_Ns);
}

}  // namespace

SceneRun::SceneRun(Scene scene) : scene_(std::move(scene)), world_(scene_.settings) {
  for (const GeometryPointer& geometry : scene_.geometries) world_.add_geometry(geometry);
  const Outcome made = world_.spawn(scene_.bodies);
  if (made.result != Result::ok) {
    const std::string& name = scene_.bodies[static_cast<std::size_t>(made.item)].name;
    throw SceneError(scene_.name + ": body number " + std::to_string(made.item) +
                     (name.empty() ? "" : " \"" + name + "\"") + ": " +
                     std::string(to_string(made.result)));
  }
  first_ = made.body;
  for (std::size_t i = 0; i < scene_.drags.size(); ++i) {
    if (scene_.drags[i].any()) accept(world_.set_drag(id(i), scene_.drags[i]), "drag", i);
  }
  for (std::size_t i = 0; i < scene_.springs.size(); ++i) {
    Spring spring = scene_.springs[i].spring;
    spring.a = id(scene_.springs[i].a);
    if (scene_.springs[i].b) spring.b = id(*scene_.springs[i].b);
    accept(world_.add_springs(std::span(&spring, 1)), "spring", i);
  }
}

void SceneRun::accept(const Outcome& outcome, const char* what, std::size_t number) const {
  if (outcome.result == Result::ok) return;
  throw SceneError(scene_.name + ": " + what + " number " + std::to_string(number) + ": " +
                   std::string(to_string(outcome.result)));
}

BodyId SceneRun::id(std::size_t index) const {
  return {first_.value + static_cast<std::int64_t>(index)};
}

void SceneRun::begin_due_wrenches() {
  const Tick tick = world_.tick() + 1;
  for (; next_wrench_ < scene_.wrenches.size(); ++next_wrench_) {
    const TimedWrench& due = scene_.wrenches[next_wrench_];
    if (due.tick > tick) return;
    Wrench wrench = due.wrench;
    wrench.body = id(due.body);
    if (world_.push(std::span(&wrench, 1)).result != Result::ok) ++wrenches_left_out_;
  }
}

StepReport SceneRun::step(Executor& executor, StepObserver* observer) {
  begin_due_wrenches();
  return world_.step(executor, observer);
}

WorldSettings settings_of(const SimulateOptions& options, WorldSettings settings) {
  if (options.dt_s) {
    check_range("--dt", *options.dt_s, 1 / limits::kRateMax_hz, 1 / limits::kRateMin_hz);
    settings.rate_hz = 1 / *options.dt_s;
  }
  if (options.sub_steps) {
    check_range("--substeps", *options.sub_steps, 1, limits::kSubStepsMax);
    settings.sub_steps = *options.sub_steps;
  }
  if (options.solver) settings.solver = *options.solver;
  if (options.scheme) settings.scheme = *options.scheme;
  settings.is_full = options.is_full;
  return settings;
}

std::int64_t ticks_of(double duration_s, const WorldSettings& settings) {
  check_range("--duration, in ticks", duration_s * settings.rate_hz, 0.5, 1e9);
  return std::llround(duration_s * settings.rate_hz);
}

void simulate(const SimulateOptions& options) {
  check_range("--threads", options.threads, 1, ThreadPool::kThreadsMax);
  if (!options.trace.empty() && options.trace == options.summary) {
    throw OptionError("--trace and --summary cannot both be " +
                      (options.trace == "-" ? "standard output" : options.trace));
  }
  Scene scene = load_scene(options.scene);
  scene.settings = settings_of(options, scene.settings);
  Summary summary;
  summary.scene = options.scene;
  summary.settings = scene.settings;
  summary.threads = options.threads;
  summary.ticks = ticks_of(options.duration_s, scene.settings);

  SceneRun run(std::move(scene));
  std::optional<Trace> trace;
  std::optional<Output> summary_output;
  if (!options.trace.empty()) trace.emplace(options.trace, run);
  if (!options.summary.empty()) summary_output.emplace(options.summary);

  ThreadPool threads(options.threads);
  std::vector<double> times_us;
  if (trace) trace->write(run.world());
  for (Tick tick = 1; tick <= summary.ticks; ++tick) {
    const Stopwatch stopwatch;
    summary.last_step = run.step(threads);
    summary.steps_unsolved += summary.last_step.unsolved;
    summary.energy_paid_J += summary.last_step.paid_J;
    summary.islands_makeshift += summary.last_step.islands_makeshift;
    summary.springs_unconverged += summary.last_step.springs_unconverged;
    times_us.push_back(stopwatch.elapsed_us());
    summary.penetration_max_m =
        std::max(summary.penetration_max_m, summary.last_step.penetration_max_m);
    summary.stopped_at_impact += summary.last_step.stopped_at_impact;
    summary.impacts += summary.last_step.impacts;
    summary.impacts_ordered += summary.last_step.impacts_ordered;
    summary.impacts_spent += summary.last_step.impacts_spent;
    summary.sub_steps_max = std::max(summary.sub_steps_max, summary.last_step.sub_steps_max);
    summary.impacts_unresolved += summary.last_step.impacts_unresolved;
    summary.spins_cut += summary.last_step.spins_cut;
    summary.ticks_in_halves += summary.last_step.parts - 1;
    add_accuracy(summary, tick);
    summary.crowded_max = std::max(summary.crowded_max, summary.last_step.crowded);
    summary.surfaces_passing_max =
        std::max(summary.surfaces_passing_max, summary.last_step.surfaces_passing);
    if (trace) trace->write(run.world());
  }
  if (trace) trace->finish();
  if (!summary_output) return;
  summary.wall_time_s = 1e-6 * std::accumulate(times_us.begin(), times_us.end(), 0.0);
  summary.tick_times = summarise(std::move(times_us));
  summary.bodies = run.world().body_count();
  summary.quarantined = run.world().quarantined_count();
  summary.not_colliding = run.world().not_colliding_count();
  summary.totals = run.world().totals();
  summary.hash = run.world().hash();
  summary_output->write(to_json(summary));
  summary_output->finish();
}

}  // namespace cradle
