// The broad phase inside a world: which one does not matter, and crowds are told.
#include <catch2/catch.hpp>

#include "server/collision/broad_phase.h"
#include "server/trace.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

World world_by(const std::string& broad_phase) {
  WorldSettings chosen = settings();
  chosen.broad_phase = broad_phase;
  return World(chosen);
}

/// Bodies fall on a heap; every few ticks some are removed, others come, one is thrown far.
void live(World& world, int tick) {
  const auto spread = [&](int k) { return 0.37 * ((tick * 7 + k * 3) % 11) - 2; };
  if (tick == 0) {
    add(world, ground());
    for (int k = 0; k < 80; ++k)
      add(world, brick({0.3, 0.2, 0.4}, {spread(k), spread(2 * k), 1.0 + 0.3 * k}));
    return;
  }
  if (tick % 5 == 0) add(world, ball(0.3, {spread(0), spread(1), 6}, {0, 0, -3}));
  if (tick % 7 == 0) world.despawn(std::array{BodyId{2 + tick / 7}});
  if (tick % 11 == 0) add(world, ball(0.2, {spread(3), 0, 4}, {200, 0, 5}));
}

}  // namespace

TEST_CASE("a world goes the same way whichever broad phase finds its pairs") {
  World ours = world_by("kept"), theirs = world_by("fcl");
  for (int tick = 0; tick < 240; ++tick) {
    CAPTURE(tick);
    live(ours, tick);
    live(theirs, tick);
    const StepReport report = ours.step();
    CHECK(theirs.step().pairs_by == "fcl");
    CHECK(report.pairs_by != "fcl");
    CHECK(report.crowded == 0);
    REQUIRE(ours.hash() == theirs.hash());
  }
}

TEST_CASE(
    "too many bodies in one place are told by step and summary, and keep a floor under them") {
  for (const std::string& name : broad_phase_names()) {
    CAPTURE(name);
    World world = world_by(name);
    add(world, ground());
    for (int k = 0; k < 600; ++k) add(world, ball(0.5, {0, 0, 0.5}));
    Summary summary;
    summary.last_step = world.step();
    summary.crowded_max = summary.last_step.crowded;
    CHECK(summary.last_step.crowded == 601);  // the floor has too many, too
    CHECK(summary.last_step.pairs_by == "crowd");
    const std::string json = to_json(summary);
    CHECK_THAT(json, Catch::Matchers::Contains("\"crowded_max\": 601"));
    CHECK_THAT(json, Catch::Matchers::Contains("\"pairs_by\": \"crowd\""));
    std::vector<BodyState> states;
    world.snapshot(states);
    for (const BodyState& state : states) CHECK(state.in_contact);
  }
}

}  // namespace cradle
