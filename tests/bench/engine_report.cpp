#include "tests/bench/engine_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>

#include "tests/bench/plot.h"

namespace cradle::bench {
namespace {

constexpr std::array<double, 4> kErrors{1e-2, 1e-3, 1e-4, 1e-6};
// The edges of a diagram.
constexpr double kLeast = 1e-12, kMost = 1e2;

constexpr std::initializer_list<int> kSubSteps{4, 8, 16, 32, 64};
constexpr std::initializer_list<int> kTolerances_um{5000, 500, 50, 5};
constexpr std::initializer_list<int> kIterations{10, 20, 50, 100, 300};
constexpr std::initializer_list<int> kStepsATick{1, 2, 4, 8, 16};
/// Of methods that have nothing else to be told. Beyond that a wall takes an hour by some.
constexpr std::initializer_list<int> kStepsOfMethods{1, 2, 4};

template <class Run>
EngineCurve curve(const Case& which, std::string engine, std::string unit,
                  std::initializer_list<int> settings, int settings_max, Run run) {
  EngineCurve made{std::move(engine), std::move(unit), {}};
  for (const int setting : settings) {
    if (setting > settings_max) continue;
    const Fared fared = run(setting);
    made.points.push_back({setting, time_us(which, fared.row), fared.row.error, fared.outcome});
  }
  return made;
}

double shown(double error) { return std::isnan(error) ? kMost : std::clamp(error, kLeast, kMost); }

std::string script(const Case& which, std::span<const EngineCurve> curves) {
  const std::string name(which.name);
  std::string text =
      "set encoding utf8\n"
      "set terminal svg size 720,420 font 'sans,12' background 'white'\n"
      "set output '" +
      name +
      ".svg'\nset logscale xy\nset format '10^{%T}'\nset grid\nset key outside right top\nset "
      "colorsequence podo\n" +
      formatted("set yrange [%g:%g]\n", kLeast, kMost) + "set title '" + name + ": " +
      std::string(which.about) +
      " (upper edge: that or more, or nan)'\nset ylabel 'error: " + std::string(which.error_kind) +
      "'\nset xlabel 'us a tick'\nplot \\\n";
  for (std::size_t i = 0; i < curves.size(); ++i) {
    text += "  '" + name + ".dat' index " + std::to_string(i) +
            " using 2:4 with linespoints title '" + curves[i].engine + ", " + curves[i].unit + "'" +
            (i + 1 < curves.size() ? ", \\\n" : "\n");
  }
  return text;
}

/// The cheapest that is good enough, of all curves of the engine.
std::string cheapest_cell(std::span<const EngineCurve> curves, const std::string& engine,
                          double error) {
  const EngineCurve* best = nullptr;
  const EnginePoint* point = nullptr;
  for (const EngineCurve& one : curves) {
    if (one.engine != engine) continue;
    for (const EnginePoint& candidate : one.points) {
      if (!(candidate.error <= error) || (point != nullptr && candidate.us >= point->us)) continue;
      best = &one;
      point = &candidate;
    }
  }
  if (point == nullptr) return " none |";
  return " " + std::to_string(point->setting) + " " + best->unit +
         formatted(point->us < 10 ? ": %.1f µs |" : ": %.0f µs |", point->us);
}

}  // namespace

std::vector<const Case*> engine_cases() {
  return {find_case("T3"),  find_case("A4"),  find_case("A7"),
          find_case("A8a"), find_case("A8b"), find_case("S3")};
}

namespace {

/// What is sought by sub-steps: of "hybrid", by those of what does not rest.
void add_stepped(const Case& which, const Scene& scene, const std::string& method, int settings_max,
                 std::vector<EngineCurve>& curves) {
  Options options;
  options.method = method;
  curves.push_back(
      curve(which, "cradle " + method, "sub-steps", kSubSteps, settings_max, [&](int setting) {
        options.sub_steps = setting;
        return try_run(which, scene, options);
      }));
  options.sub_steps.reset();
  curves.push_back(curve(which, "cradle " + method, "µm of tolerance", kTolerances_um, settings_max,
                         [&](int setting) {
                           Scene stated = scene;
                           stated.settings.sub_steps = 0;
                           stated.settings.contact_tolerance_m = 1e-6 * setting;
                           return try_run(which, stated, options);
                         }));
}

/// Of one step a tick: with shorter ticks.
void add_single(const Case& which, const Scene& scene, const std::string& method, int settings_max,
                std::vector<EngineCurve>& curves) {
  const double dt_s = 1 / scene.settings.rate_hz;
  curves.push_back(curve(which, "cradle " + method, "steps a tick", kStepsOfMethods, settings_max,
                         [&](int setting) {
                           Options options;
                           options.method = method;
                           options.dt_s = dt_s / setting;
                           Fared fared = try_run(which, scene, options);
                           fared.row.us_per_tick.mean_us *= setting;
                           fared.row.us_per_tick.median_us *= setting;
                           return fared;
                         }));
}

}  // namespace

std::vector<EngineCurve> sweep_engines(const Case& which, std::span<const PeerLibrary> libraries,
                                       int settings_max) {
  const Scene scene = scene_of(which);
  std::vector<EngineCurve> curves;
  for (const char* method : {"hybrid", "soft"}) {
    add_stepped(which, scene, method, settings_max, curves);
  }
  for (const char* method : {"newton", "accurate", "lcp", "impulse", "penalty"}) {
    add_single(which, scene, method, settings_max, curves);
  }
  for (const PeerLibrary& library : libraries) {
    const std::string name(library.name);
    curves.push_back(curve(which, name, "iterations", kIterations, settings_max, [&](int setting) {
      return try_peer(library, which, scene, {}, {setting, 1});
    }));
    curves.push_back(
        curve(which, name, "steps a tick", kStepsATick, settings_max, [&](int setting) {
          return try_peer(library, which, scene, {}, {0, setting});
        }));
  }
  std::erase_if(curves, [](const EngineCurve& one) { return one.points.empty(); });
  return curves;
}

std::string data_text(std::span<const EngineCurve> curves) {
  std::string text;
  for (const EngineCurve& one : curves) {
    text += (text.empty() ? "# " : "\n\n# ") + one.engine + ": " + one.unit + " us error shown\n";
    for (const EnginePoint& p : one.points) {
      const double error = std::isfinite(p.error) ? p.error : std::nan("");
      if (p.outcome != "ok") text += "# " + std::to_string(p.setting) + " " + p.outcome + "\n";
      text += formatted("%d %.4g %.6g %.6g\n", p.setting, std::abs(p.us), std::abs(error),
                        shown(p.error));
    }
  }
  return text;
}

std::string engine_table_head() {
  std::string head = "| case, kind of error | engine |", line = "\n|---|---|";
  for (const double error : kErrors) {
    head += formatted(" %.0e |", error);
    line += "---|";
  }
  return head + line + '\n';
}

std::string engine_table_lines(const Case& which, std::span<const EngineCurve> curves) {
  std::string text;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const std::string& engine = curves[i].engine;
    if (i > 0 && curves[i - 1].engine == engine) continue;  // both of its curves are in one line
    text += "| " + std::string(which.name) + " " + std::string(which.error_kind) + " | " + engine +
            " |";
    for (const double error : kErrors) text += cheapest_cell(curves, engine, error);
    text += '\n';
  }
  return text;
}

void write_engine_report(const std::string& folder_name, std::span<const PeerLibrary> libraries,
                         int settings_max, const std::vector<const Case*>& cases) {
  const std::filesystem::path folder(folder_name);
  std::filesystem::create_directories(folder);
  std::string table = engine_table_head();
  for (const Case* which : cases) {
    const std::vector<EngineCurve> curves = sweep_engines(*which, libraries, settings_max);
    const std::string name(which->name);
    write_file(folder / (name + ".dat"), data_text(curves));
    write_file(folder / (name + ".gp"), script(*which, curves));
    table += engine_table_lines(*which, curves);
  }
  write_file(folder / "engines.md", table);
  for (const Case* which : cases) plot(folder, std::string(which->name));
}

}  // namespace cradle::bench
