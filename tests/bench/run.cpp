#include "tests/bench/run.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "server/collision/machine_lanes.h"
#include "server/config.h"
#include "server/dynamics/free_flight.h"
#include "server/large_pages.h"
#include "server/simulate.h"
#include "server/thread_pool.h"
#include "tests/bench/conservation.h"
#include "tests/bench/penetration.h"

namespace cradle::bench {
namespace {

std::string hexadecimal(const std::array<std::uint8_t, 8>& bytes) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += digits[byte >> 4];
    text += digits[byte & 15];
  }
  return text;
}

std::unique_ptr<Executor> make_executor(int threads) {
  if (threads == 1) return std::make_unique<SerialExecutor>();
  return std::make_unique<ThreadPool>(threads);
}

/// Ticks are timed one after the other, as a loop of nothing else would make them: what looks at
/// all bodies between two of them takes the caches away that the next one would have found. So
/// states are kept, and looked at after so many ticks; of many bodies after fewer, for room.
std::size_t ticks_a_stretch(const Scene& scene) {
  constexpr std::size_t kTicks = 64, kStates = 1 << 17;
  return std::clamp<std::size_t>(kStates / std::max<std::size_t>(1, scene.bodies.size()), 1,
                                 kTicks);
}

}  // namespace

Scene scene_of(const Case& which) {
  return load_scene(CRADLE_SCENE_DIR "/" + std::string(which.scene_file));
}

Row watch(const Case& which, const Scene& scene, const Engine& engine, const Between& between) {
  take_memory(static_cast<std::size_t>(Config().memory_mib) << 20);  // as cradled, for all engines
  const double rate_hz = scene.settings.rate_hz;
  const auto measure = which.measure(scene);
  PenetrationCheck check(scene);
  Drift drift(scene);
  Row row;
  row.scene = which.name;
  row.dt_s = 1 / rate_hz;
  row.error_kind = which.error_kind;

  const auto ticks = std::max<Tick>(1, std::llround(which.duration_s * rate_hz));
  const auto warm_up = std::min<Tick>(ticks - 1, std::llround(which.warm_up_s * rate_hz));
  std::vector<double> us;
  Penetration penetration;
  const auto look = [&](Tick tick, std::span<const BodyState> states) {
    if (states.size() != scene.bodies.size()) throw std::logic_error("a snapshot lacks bodies");
    if (tick % which.ticks_a_look == 0 || tick == ticks) penetration = check.look(states);
    row.penetration_max_m = worse(row.penetration_max_m, penetration.max_m);
    row.penetration_mean_m = penetration.mean_m;
    drift.tick(budget(scene, states));
    measure->tick({static_cast<double>(tick) / rate_hz, states, penetration});
  };
  std::vector<std::vector<BodyState>> kept(ticks_a_stretch(scene));
  std::size_t used = 0;
  for (Tick tick = 1; tick <= ticks; ++tick) {
    const Stopwatch stopwatch;
    engine.step();
    if (tick > warm_up) us.push_back(stopwatch.elapsed_us());

    engine.look(kept[used++]);
    if (used == kept.size() || tick == ticks) {
      Tick looked_at = tick - static_cast<Tick>(used);
      for (const auto& states : std::span(kept).first(used)) look(++looked_at, states);
      used = 0;
    }
    if (between) between(static_cast<double>(tick) / static_cast<double>(ticks));
  }

  row.us_per_tick = summarise(std::move(us));
  const auto bodies = static_cast<double>(dynamic_bodies(scene).size());
  row.ns_per_body = 1000 * row.us_per_tick.median_us / bodies;
  row.error = measure->error();
  row.energy_drift = drift.energy();
  row.momentum_drift = drift.momentum();
  return row;
}

Row run(const Case& which, const Options& options) { return run(which, scene_of(which), options); }

Row run(const Case& which, Scene scene, const Options& options, const Between& between) {
  if (options.method) scene.settings.solver = *options.method;
  if (options.dt_s) scene.settings.rate_hz = 1 / *options.dt_s;
  if (options.sub_steps) scene.settings.sub_steps = *options.sub_steps;
  scene.settings.lanes = options.lanes;

  const auto executor = make_executor(options.threads);
  SceneRun run(scene);
  Row row = watch(which, scene,
                  {[&] { run.step(*executor); },
                   [&](std::vector<BodyState>& states) { run.world().snapshot(states); }},
                  between);
  row.engine = "cradle";
  row.method = scene.settings.solver;
  row.sub_steps = scene.settings.sub_steps;
  row.threads = options.threads;
  row.lanes = options.lanes > 0 ? options.lanes : machine_lanes().back();
  if (run.world().quarantined_count() > 0) row.error = std::numeric_limits<double>::quiet_NaN();
  row.hash = hexadecimal(run.world().hash());
  return row;
}

}  // namespace cradle::bench
