#include "tests/bench/growth.h"

#include <malloc.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <optional>

#include "server/large_pages.h"
#include "server/scene_lattice.h"
#include "server/simulate.h"
#include "tests/bench/cases.h"
#include "tests/bench/plot.h"
#include "tests/bench/run.h"
#include "tests/bench/table.h"

namespace cradle::bench {
namespace {

/// The case's scene with other dynamic bodies; all of its bodies that are not stay.
Scene emptied(const char* name) {
  Scene scene = scene_of(*find_case(name));
  std::erase_if(scene.bodies, [](const BodySpec& b) { return b.kind == BodyKind::dynamic; });
  scene.drags.clear();
  return scene;
}

BodySpec first_dynamic(const char* name) {
  const Scene scene = scene_of(*find_case(name));
  return *std::ranges::find(scene.bodies, BodyKind::dynamic, &BodySpec::kind);
}

/// Walls keep their thickness, and go with the room: `half` from its middle to each side; 0: as it
/// was.
void move_walls(Scene& scene, const Vec3& half) {
  const std::array<double, 3> halves{half.x, half.y, half.z};
  for (BodySpec& wall : scene.bodies) {
    const std::array<double*, 3> place{&wall.p_WBo.x, &wall.p_WBo.y, &wall.p_WBo.z};
    const std::size_t across = wall.p_WBo.x != 0 ? 0 : wall.p_WBo.y != 0 ? 1 : 2;
    auto& extents = wall.shape.parameters;
    const double thickness_m = extents[across];
    for (std::size_t k = 0; k < 3; ++k) {
      if (halves[k] == 0) continue;
      if (k == across) {
        *place[k] = std::copysign(halves[k] + thickness_m, *place[k]);
      } else {
        extents[k] = halves[k] + 2 * thickness_m;
      }
    }
  }
}

void fill(Scene& scene, const Lattice& lattice, std::size_t number) {
  std::vector<BodySpec> bodies = bodies_of(lattice);
  bodies.resize(number);
  scene.bodies.insert(scene.bodies.end(), bodies.begin(), bodies.end());
}

/// A room of 37.4 m for 10 000, the cubic lattice in it as wide as fits.
Scene gas(int number) {
  constexpr double kSide_m = 37.4, kNumber = 10'000;
  Scene scene = emptied("T1");
  const double side_m = kSide_m * std::cbrt(number / kNumber);
  const auto points = static_cast<std::int64_t>(std::ceil(std::cbrt(number) - 1e-9));
  const double pitch_m = side_m / static_cast<double>(points);
  const double first_m = 0.5 * (pitch_m - side_m);
  move_walls(scene, {side_m / 2, side_m / 2, side_m / 2});
  Lattice lattice;
  lattice.count = {points, points, points};
  lattice.pitch_m = {pitch_m, pitch_m, pitch_m};
  lattice.origin_m = {first_m, first_m, first_m};
  lattice.velocity_jitter_mps = Vec3{5, 5, 5};
  lattice.bodies = {first_dynamic("T1")};
  lattice.bodies.front().v_WBcm = {};
  lattice.bodies.front().p_WBo = {};
  fill(scene, lattice, static_cast<std::size_t>(number));
  return scene;
}

/// Twenty layers, in a pit 3 m wide for each cube of a row.
Scene pile(int number) {
  constexpr int kLayers = 20;
  constexpr double kPitch_m = 1.8, kRoom_m = 3;
  Scene scene = emptied("T2");
  const int layer = number / kLayers;
  int rows = static_cast<int>(std::sqrt(layer));
  while (layer % rows != 0) --rows;
  const int columns = layer / rows;
  move_walls(scene, {kRoom_m * columns / 2, kRoom_m * rows / 2, 0});
  Lattice lattice;
  lattice.count = {columns, rows, kLayers};
  lattice.pitch_m = {kPitch_m, kPitch_m, kPitch_m};
  lattice.origin_m = {-0.5 * kPitch_m * (columns - 1), -0.5 * kPitch_m * (rows - 1), 1.2};
  lattice.jitter_m = Vec3{0.02, 0.02, 0};
  lattice.random_orientation = true;
  lattice.bodies = {first_dynamic("T2")};
  lattice.bodies.front().p_WBo = {};
  lattice.bodies.front().q_WB = {};
  fill(scene, lattice, static_cast<std::size_t>(number));
  return scene;
}

/// The bodies of the case again and again: none of them meets any.
Scene free_bodies(int number) {
  Scene scene = scene_of(*find_case("T4"));
  const std::size_t period = scene.bodies.size();
  const auto wanted = static_cast<std::size_t>(number);
  scene.bodies.reserve(wanted);
  for (std::size_t i = period; i < wanted; ++i) scene.bodies.push_back(scene.bodies[i - period]);
  scene.bodies.resize(wanted);
  return scene;
}

constexpr int kFrom = 4000;
std::vector<int> doubled(int first, int last) {
  std::vector<int> numbers;
  for (int n = first; n <= last; n *= 2) numbers.push_back(n);
  return numbers;
}

double heap_bytes() {
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

constexpr Column kGrowthColumns[] = {
    {"scene", 10},         {"bodies", 8},         {"us_per_tick", 11},       {"median", 8},
    {"ns_per_body", 11},   {"work_per_body", 13}, {"contacts_per_body", 17}, {"bytes_per_body", 14},
    {"work_exponent", 13}, {"time_exponent", 13}};

}  // namespace

std::span<const GrowthCase> growth_cases() {
  static const std::array kCases{
      GrowthCase{"growth:T1", doubled(1000, 64'000), kFrom, 60, 120, gas,
                 "a gas of elastic spheres, 0.19 a cubic metre"},
      GrowthCase{"growth:T2", doubled(1000, 64'000), kFrom, 0, 300, pile,
                 "cubes dropped into a pit, twenty layers", 18'000},
      GrowthCase{"growth:T4",
                 {10'000, 100'000, 1'000'000},
                 kFrom,
                 10,
                 30,
                 free_bodies,
                 "bodies in free rotation"},
  };
  return kCases;
}

std::int64_t work_of(const StepReport& report, int bodies) {
  return report.pair_work + report.pairs + report.contacts + report.impacts +
         (bodies - report.bodies_in_contact) + report.body_sub_steps;
}

GrowthRow run(const GrowthCase& which, int number) {
  GrowthRow row;
  row.name = which.name;
  row.bodies = number;
  const Scene scene = which.scene(number);
  const double before = heap_bytes();
  double copy = 0;
  std::optional<SceneRun> running;
  {
    const Scene other = scene;  // a run keeps one
    copy = heap_bytes() - before;
  }
  running.emplace(scene);
  take_memory(static_cast<std::size_t>(number) * which.bytes_to_come);
  SerialExecutor here;
  std::vector<double> us;
  for (int tick = 0; tick < which.warm_up + which.ticks; ++tick) {
    const Stopwatch stopwatch;
    const StepReport report = running->step(here);
    if (tick < which.warm_up) continue;
    us.push_back(stopwatch.elapsed_us());
    row.work += static_cast<double>(work_of(report, number)) / which.ticks;
    row.contacts += static_cast<double>(report.contacts) / which.ticks;
  }
  row.bytes = heap_bytes() - before - copy;
  row.us_per_tick = summarise(std::move(us));
  return row;
}

double exponent(std::span<const double> x, std::span<const double> y) {
  const auto n = static_cast<double>(x.size());
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double a = std::log(x[i]), b = std::log(y[i]);
    sx += a, sy += b, sxx += a * a, sxy += a * b;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

std::string growth_header(Format format) { return names_line(kGrowthColumns, format); }

std::string growth_line(Format format, const GrowthCase& which, std::span<const GrowthRow> rows) {
  const GrowthRow& row = rows.back();
  const auto of = [&](int from, auto value) -> std::optional<double> {
    std::vector<double> x, y;
    for (const GrowthRow& one : rows) {
      if (one.bodies < from) continue;
      x.push_back(one.bodies);
      y.push_back(value(one));
    }
    if (x.size() < 2) return std::nullopt;
    return exponent(x, y);
  };
  const auto text = [&](const auto& value) { return text_of(value, format); };
  const double bodies = row.bodies;
  return cells_line(
      kGrowthColumns,
      {row.name, std::to_string(row.bodies), text(row.us_per_tick.mean_us),
       text(row.us_per_tick.median_us), text(1e3 * row.us_per_tick.mean_us / bodies),
       text(row.work / bodies), text(row.contacts / bodies), text(row.bytes / bodies),
       text(of(0, [](const GrowthRow& r) { return r.work; })),
       text(of(which.from, [](const GrowthRow& r) { return r.us_per_tick.mean_us; }))},
      format);
}

void write_growth_report(const std::string& folder, int most) {
  const std::filesystem::path path(folder);
  std::filesystem::create_directories(path);
  std::string csv = growth_header(Format::csv), data;
  std::string script =
      "set encoding utf8\n"
      "set terminal svg size 720,420 font 'sans,12' background 'white'\n"
      "set output 'growth.svg'\nset logscale xy\nset format '10^{%T}'\nset grid\n"
      "set key outside right top\nset title 'Time of a tick by number of bodies; dotted: "
      "in proportion'\nset xlabel 'bodies'\nset ylabel 'us a tick'\nplot \\\n";
  int block = 0;
  for (const GrowthCase& one : growth_cases()) {
    std::vector<GrowthRow> rows;
    for (const int number : one.numbers) {
      if (number > most) continue;
      rows.push_back(run(one, number));
      csv += growth_line(Format::csv, one, rows);
      data +=
          formatted("%d %.6g %.6g\n", number, rows.back().us_per_tick.mean_us, rows.back().work);
    }
    if (rows.empty()) continue;
    data += "\n\n";
    const std::string name(one.name.substr(one.name.find(':') + 1));
    script += formatted("%s'growth.dat' index %d using 1:2 with linespoints lc %d title '%s', \\\n",
                        block > 0 ? ", \\\n" : "", block, block + 1, name.c_str());
    script += formatted("x >= %d && x <= %d ? %.6g * x : 1/0 lc %d dt 3 notitle",
                        rows.front().bodies, rows.back().bodies,
                        rows.front().us_per_tick.mean_us / rows.front().bodies, block + 1);
    ++block;
  }
  write_file(path / "growth.csv", csv);
  write_file(path / "growth.dat", data);
  write_file(path / "growth.gp", script);
  plot(path, "growth");
}

}  // namespace cradle::bench
