// The scenes of the benchmark's table are those of its description.
#include <catch2/catch.hpp>
#include <map>

#include "tests/bench/cases.h"
#include "tests/bench/run.h"

using namespace cradle;
using namespace cradle::bench;

TEST_CASE("the scenes of the table have the bodies that they should have") {
  // Dynamic bodies a scene: as its description says (cradle_bench --list).
  const std::map<std::string, std::size_t> expected{
      {"T1", 10'000},   {"T2", 2000}, {"T3", 465},  {"T4", 100'000}, {"T4m", 1'000'000},
      {"T4p", 100'000}, {"T5", 3000}, {"A1", 1},    {"A2", 1},       {"A3", 1},
      {"A3e", 1},       {"A4", 1},    {"A5", 1},    {"A5t", 1},      {"A6a", 1},
      {"A6b", 1},       {"A7", 20},   {"A8a", 2},   {"A8b", 11},     {"A9", 5},
      {"A9b", 5},       {"A10", 1},   {"A11", 216}, {"A12", 2},      {"S1", 26},
      {"S1t", 26},      {"S2", 49},   {"S3", 216},  {"S4", 216},     {"P29", 5050}};
  CHECK(cases().size() == expected.size());
  for (const Case& one : cases()) {
    INFO(one.name);
    CHECK(dynamic_bodies(scene_of(one)).size() == expected.at(std::string(one.name)));
  }
}

TEST_CASE("no scene but that of the overlap begins with one") {
  for (const Case& one : cases()) {
    INFO(one.name);
    const Scene scene = scene_of(one);
    std::vector<BodyState> states;
    for (const BodySpec& body : scene.bodies) {
      BodyState& state = states.emplace_back();
      state.p_WBo = body.p_WBo;
      state.q_WB = body.q_WB;
    }
    const double overlap_m = PenetrationCheck(scene).look(states).max_m;
    CHECK(overlap_m == Approx(one.name == "A12" ? 0.5 : 0).margin(1e-13));
  }
}
