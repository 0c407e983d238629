#include "tests/bench/side_by_side.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <type_traits>

#include "server/collision/machine_lanes.h"
#include "server/dynamics/free_flight.h"
#include "tests/bench/in_child.h"

namespace cradle::bench {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// An engine's turn is so much of its run, and more of a fast one: caches are cold when it begins.
constexpr double kPartOfRun = 1.0 / 32;
constexpr double kLeastTurn_us = 20'000;

/// Ends turns.
Between in_turns(const PassOn& pass_on) {
  return [&pass_on, next = kPartOfRun, turn = Stopwatch()](double done) mutable {
    if (done < next) return;
    next = kPartOfRun * (std::floor(done / kPartOfRun) + 1);
    if (done >= 1 || turn.elapsed_us() < kLeastTurn_us) return;
    pass_on();
    turn = Stopwatch();
  };
}

/// What a child finds out, as it comes through a pipe.
struct Found {
  TickTimes us_per_tick;
  double ns_per_body, error, penetration_max_m, penetration_mean_m;
  std::optional<double> energy_drift, momentum_drift;
  std::array<char, 16> hash;
};
static_assert(std::is_trivially_copyable_v<Found>);

std::string packed(const Row& row) {
  Found found{row.us_per_tick,        row.ns_per_body,  row.error,          row.penetration_max_m,
              row.penetration_mean_m, row.energy_drift, row.momentum_drift, {}};
  std::copy_n(row.hash.begin(), std::min(row.hash.size(), found.hash.size()), found.hash.begin());
  std::string text(sizeof found, '\0');
  std::memcpy(text.data(), &found, sizeof found);
  return text;
}

void unpack(const std::string& text, Row& row) {
  Found found;
  if (text.size() != sizeof found) throw std::logic_error("a run sent something else");
  std::memcpy(&found, text.data(), sizeof found);
  row.us_per_tick = found.us_per_tick;
  row.ns_per_body = found.ns_per_body;
  row.error = found.error;
  row.penetration_max_m = found.penetration_max_m;
  row.penetration_mean_m = found.penetration_mean_m;
  row.energy_drift = found.energy_drift;
  row.momentum_drift = found.momentum_drift;
  row.hash.assign(found.hash.begin(), std::ranges::find(found.hash, '\0'));
}

/// Of a run that is still to come.
Row row_of(const Case& which, const Scene& scene, const Options& options) {
  Row row;
  row.scene = which.name;
  row.dt_s = options.dt_s.value_or(1 / scene.settings.rate_hz);
  row.error_kind = which.error_kind;
  return row;
}

Row peer_row(const PeerLibrary& library, const Case& which, const Scene& scene,
             const Options& options, const PeerSettings& settings) {
  Row row = row_of(which, scene, options);
  row.engine = library.name;
  const int iterations = settings.iterations > 0 ? settings.iterations : library.iterations;
  row.method = std::to_string(iterations) + " it";
  row.sub_steps = settings.steps_a_tick;
  return row;
}

Fared fared(Row row, const ChildResult& result) {
  Fared engine{std::move(row), "ok"};
  if (result.is_done) {
    unpack(result.text, engine.row);
  } else {
    engine.outcome = result.text;
    engine.row.us_per_tick = {kNaN, kNaN, kNaN};
    engine.row.ns_per_body = engine.row.error = kNaN;
    engine.row.penetration_max_m = engine.row.penetration_mean_m = kNaN;
  }
  return engine;
}

/// Of one engine, in a child.
struct Run {
  Row row;  ///< what is known before
  ChildWork work;
};

Run run_of(const Case& which, const Scene& scene, const Options& options) {
  Row row = row_of(which, scene, options);
  row.engine = "cradle";
  row.method = options.method.value_or(scene.settings.solver);
  row.sub_steps = options.sub_steps.value_or(scene.settings.sub_steps);
  row.threads = options.threads;
  row.lanes = options.lanes > 0 ? options.lanes : machine_lanes().back();
  return {std::move(row), [&](const PassOn& pass_on) {
            return packed(run(which, scene, options, in_turns(pass_on)));
          }};
}

Run run_of(const PeerLibrary& library, const Case& which, const Scene& scene,
           const Options& options, const PeerSettings& settings) {
  return {peer_row(library, which, scene, options, settings), [&, settings](const PassOn& pass_on) {
            return packed(run_peer(library, which, scene, options, settings, in_turns(pass_on)));
          }};
}

/// Side by side.
std::vector<Fared> try_all(std::vector<Run> runs) {
  std::vector<ChildWork> works;
  for (const Run& run : runs) works.push_back(run.work);
  const std::vector<ChildResult> results = in_children(works);
  std::vector<Fared> all;
  for (std::size_t i = 0; i < runs.size(); ++i)
    all.push_back(fared(std::move(runs[i].row), results[i]));
  return all;
}

/// See Fared. None if one of the runs failed.
std::optional<double> median_ratio(const Case& which, std::span<const Fared> ours,
                                   std::span<const Fared> theirs) {
  std::vector<double> ratios;
  for (std::size_t round = 0; round < ours.size(); ++round) {
    if (round == theirs.size() || !ours[round].is_ok() || !theirs[round].is_ok()) return {};
    ratios.push_back(time_us(which, ours[round].row) / time_us(which, theirs[round].row));
  }
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>((ratios.size() - 1) / 2);
  std::ranges::nth_element(ratios, middle);
  return *middle;
}

/// One for several runs of the same.
Fared middle_run(const Case& which, std::vector<Fared> runs) {
  for (const Fared& run : runs) {
    if (!run.is_ok()) return run;
  }
  double error = 0;
  for (const Fared& run : runs) error = worse(error, run.row.error);
  std::ranges::sort(runs, {}, [&](const Fared& run) { return time_us(which, run.row); });
  Fared middle = runs[(runs.size() - 1) / 2];
  middle.row.error = error;
  return middle;
}

}  // namespace

double time_us(const Case& which, const Row& row) {
  return which.time_is_mean ? row.us_per_tick.mean_us : row.us_per_tick.median_us;
}

bool is_for_peers(const Case& which) { return which.name != "T4m" && which.name != "T4p"; }

Row run_peer(const PeerLibrary& library, const Case& which, Scene scene, const Options& options,
             const PeerSettings& settings, const Between& between) {
  if (options.dt_s) scene.settings.rate_hz = 1 / *options.dt_s;
  const std::unique_ptr<Peer> peer = make_peer(library, scene, settings);
  Row row = watch(which, scene,
                  {[&] { peer->step(); },
                   [&](std::vector<BodyState>& states) {
                     states.clear();
                     for (std::size_t i = 0; i < scene.bodies.size(); ++i)
                       states.push_back(peer->state(i));
                   }},
                  between);
  const Row head = peer_row(library, which, scene, options, settings);
  row.engine = head.engine;
  row.method = head.method;
  row.sub_steps = head.sub_steps;
  return row;
}

Fared try_run(const Case& which, const Scene& scene, const Options& options) {
  return try_all({run_of(which, scene, options)}).front();
}

Fared try_peer(const PeerLibrary& library, const Case& which, const Scene& scene,
               const Options& options, const PeerSettings& settings) {
  return try_all({run_of(library, which, scene, options, settings)}).front();
}

SideBySide compare(const Case& which, const Scene& scene, const Options& options,
                   std::span<const PeerLibrary> libraries, int rounds) {
  std::vector<std::vector<Fared>> runs(1 + libraries.size());
  for (int round = 0; round < rounds; ++round) {
    std::vector<Run> side_by_side;
    std::vector<std::vector<Fared>*> of;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      // What fails once fails for good; do not wait for it again.
      if (!runs[i].empty() && !runs[i].back().is_ok()) continue;
      side_by_side.push_back(i == 0 ? run_of(which, scene, options)
                                    : run_of(libraries[i - 1], which, scene, options, {}));
      of.push_back(&runs[i]);
    }
    std::vector<Fared> fared = try_all(std::move(side_by_side));
    for (std::size_t i = 0; i < of.size(); ++i) of[i]->push_back(std::move(fared[i]));
  }
  SideBySide result{&which, {}};
  for (const std::vector<Fared>& of : runs) {
    result.engines.push_back(middle_run(which, of));
    result.engines.back().ratio = median_ratio(which, runs[0], of);
  }
  return result;
}

}  // namespace cradle::bench
