#include "tests/bench/ladders.h"

#include <algorithm>

#include "tests/bench/table.h"

namespace cradle::bench {
namespace {

constexpr double kHalfWidth_m = 0.5;

/// The stack's cubes are the bodies after the floor.
Scene stack_of(const Scene& twenty, int cubes) {
  Scene scene = twenty;
  const BodySpec lowest = scene.bodies.at(1);
  scene.bodies.resize(1);
  scene.drags.clear();
  for (int i = 0; i < cubes; ++i) {
    scene.bodies.push_back(lowest);
    scene.bodies.back().p_WBo.z = lowest.p_WBo.z + i;
  }
  return scene;
}

/// The load is the heaviest body.
Scene under(const Scene& heavy, double mass_kg) {
  Scene scene = heavy;
  std::ranges::max_element(scene.bodies, {}, &BodySpec::mass_kg)->mass_kg = mass_kg;
  return scene;
}

std::string rung_line(Format format, const std::vector<std::string>& cells) {
  const std::vector<Column> columns(cells.size(), {"", 13});
  return cells_line(columns, cells, format);
}

}  // namespace

std::vector<Rung> ladder_rungs() {
  std::vector<Rung> rungs;
  const Case& stack = *find_case("A7");
  const Scene twenty = scene_of(stack);
  for (const int cubes : {5, 10, 15, 20, 30, 40}) {
    rungs.push_back({&stack, cubes, stack_of(twenty, cubes)});
  }
  for (const char* name : {"A8a", "A8b"}) {
    const Case& load = *find_case(name);
    const Scene heavy = scene_of(load);
    for (const int mass_kg : {10, 30, 100, 300, 1000, 10'000}) {
      rungs.push_back({&load, mass_kg, under(heavy, mass_kg)});
    }
  }
  return rungs;
}

bool stands(const Row& row) { return row.error < kHalfWidth_m; }

std::string ladders_header(Format format, std::span<const PeerLibrary> libraries) {
  std::vector<std::string> cells{"ladder", "rung"};
  std::vector<std::string> names{"cradle"};
  for (const PeerLibrary& library : libraries) names.emplace_back(library.name);
  for (const std::string& name : names) {
    for (const char* what : {"", "_error", "_pen_m", "_us"}) cells.push_back(name + what);
  }
  return rung_line(format, cells);
}

std::string ladders_line(Format format, const Rung& rung, const SideBySide& result) {
  std::vector<std::string> cells{std::string(rung.which->name), std::to_string(rung.number)};
  for (const Fared& engine : result.engines) {
    const Row& row = engine.row;
    cells.push_back(!engine.is_ok() ? engine.outcome : stands(row) ? "stands" : "falls");
    for (const double value : {row.error, row.penetration_max_m, time_us(*rung.which, row)})
      cells.push_back(text_of(value, format));
  }
  return rung_line(format, cells);
}

}  // namespace cradle::bench
