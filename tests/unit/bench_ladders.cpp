// The ladders of the benchmark: their scenes, and when a rung stands.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/bench/ladders.h"

using namespace cradle;
using namespace cradle::bench;

TEST_CASE("every rung has the cubes and the load that it says, one on the other") {
  const std::vector<Rung> rungs = ladder_rungs();
  REQUIRE(rungs.size() == 18);
  for (const Rung& rung : rungs) {
    INFO(rung.which->name << " " << rung.number);
    const bool is_stack = rung.which->name == "A7";
    std::vector<std::size_t> cubes = dynamic_bodies(rung.scene);
    std::ranges::sort(cubes, {}, [&](std::size_t i) { return rung.scene.bodies[i].p_WBo.z; });
    CHECK(static_cast<int>(cubes.size()) == (is_stack                    ? rung.number
                                             : rung.which->name == "A8a" ? 2
                                                                         : 11));
    for (std::size_t i = 0; i < cubes.size(); ++i) {
      const BodySpec& cube = rung.scene.bodies[cubes[i]];
      CHECK(cube.p_WBo.z == 0.5 + static_cast<double>(i));
      const bool is_load = !is_stack && i + 1 == cubes.size();
      CHECK(cube.mass_kg == (is_load ? rung.number : 1));
    }
  }
  // Those of the table's own number are the scenes of the table.
  const Case& stack = *find_case("A7");
  CHECK(rungs[3].scene.bodies == scene_of(stack).bodies);
}

TEST_CASE("a rung is a line with each engine's verdict, and what has no number does not stand") {
  Row row;
  row.error = 0.1;
  CHECK(stands(row));
  row.error = 0.6;
  CHECK_FALSE(stands(row));
  row.error = std::nan("");
  CHECK_FALSE(stands(row));

  const Rung rung = ladder_rungs().front();
  const SideBySide result = compare(*rung.which, rung.scene, {}, {}, 1);
  const std::string text = ladders_line(Format::csv, rung, result);
  CHECK(text.find("A7,5,stands,") == 0);
  CHECK(std::ranges::count(text, ',') == std::ranges::count(ladders_header(Format::csv, {}), ','));
}
