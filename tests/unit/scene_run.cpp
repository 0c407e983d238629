// A scene in motion: its timed wrenches begin when they should.
#include <array>
#include <catch2/catch.hpp>

#include "server/simulate.h"
#include "tests/unit/scene_helpers.h"

namespace cradle {
namespace {

/// Speed along x of the scene's body number `index`.
double speed_x(const SceneRun& run, std::size_t index) {
  BodyState state;
  REQUIRE(run.world().find(run.id(index), state));
  return state.v_WBcm.x;
}

}  // namespace

TEST_CASE("a scene's wrenches act from their ticks on, as long as they say") {
  SceneRun run(scene_of(R"(
[world]
rate_hz = 10
gravity_mps2 = [0, 0, 0]

[[body]]
kind = "static"

[[body]]
mass_kg = 2
  [[body.wrench]]
  tick = 3
  quantity = "impulse"
  value = [8, 0, 0]

[[body]]
mass_kg = 1
  [[body.wrench]]
  tick = 2
  value = [10, 0, 0]
  duration = "ticks"
  ticks = 2
)"));
  SerialExecutor executor;
  // Closed form: an impulse J adds J/m = 4 m/s in its tick, a force F adds F dt/m = 1 m/s a tick.
  const double expected[5][2] = {{0, 0}, {0, 1}, {4, 2}, {4, 2}, {4, 2}};
  for (int tick = 1; tick <= 5; ++tick) {
    run.step(executor);
    CAPTURE(tick);
    CHECK(run.world().tick() == tick);
    CHECK(speed_x(run, 1) == Approx(expected[tick - 1][0]).margin(1e-12));
    CHECK(speed_x(run, 2) == Approx(expected[tick - 1][1]).margin(1e-12));
  }
}

TEST_CASE("a scene's bodies have consecutive ids from 1 on, in the scene's order") {
  const SceneRun run(scene_of("[[body]]\nname = 'a'\nmass_kg = 1\n[[body]]\nkind = 'static'\n"));
  CHECK(run.id(0).value == 1);
  CHECK(run.id(1).value == 2);
  CHECK(run.world().body_count() == 2);
  BodyState state;
  REQUIRE(run.world().find(run.id(1), state));
  CHECK(state.kind == BodyKind::fixed);
}

TEST_CASE("a scene made by hand that the world refuses is refused with the body's number") {
  Scene scene;
  scene.name = "by hand";
  scene.bodies.resize(2);
  scene.bodies[0].mass_kg = 1;
  CHECK_THROWS_WITH(SceneRun(scene), "by hand: body number 1: bad_mass");

  scene.bodies[1].kind = BodyKind::fixed;
  TimedWrench timed;
  timed.body = 1;
  timed.wrench.value = {1, 0, 0};
  scene.wrenches.push_back(timed);
  SceneRun run(scene);
  SerialExecutor executor;
  run.step(executor);
  CHECK(run.wrenches_left_out() == 1);  // a static body takes none
}

TEST_CASE("a scene goes on without the wrenches of a body that a client has removed") {
  Scene scene;
  scene.bodies.resize(1);
  scene.bodies[0].mass_kg = 1;
  TimedWrench timed;
  timed.tick = 2;
  timed.wrench.value = {1, 0, 0};
  scene.wrenches.push_back(timed);
  SceneRun run(scene);
  SerialExecutor executor;
  run.step(executor);
  REQUIRE(run.world().despawn(std::array{run.id(0)}).result == Result::ok);
  REQUIRE_NOTHROW(run.step(executor));
  CHECK(run.wrenches_left_out() == 1);
}

TEST_CASE("a wrench on a body in quarantine is left out, and the rest of the scene goes on") {
  // 1e18 N on 1e-9 kg is far beyond every speed limit: the world quarantines the body.
  SceneRun run(scene_of(R"(
[world]
gravity_mps2 = [0, 0, 0]

[[body]]
mass_kg = 1e-9
  [[body.wrench]]
  value = [1e18, 0, 0]
  [[body.wrench]]
  tick = 2
  value = [1, 0, 0]

[[body]]
mass_kg = 1
  [[body.wrench]]
  tick = 2
  quantity = "impulse"
  value = [3, 0, 0]
)"));
  SerialExecutor executor;
  run.step(executor);
  CHECK(run.world().quarantined_count() == 1);
  REQUIRE_NOTHROW(run.step(executor));
  CHECK(run.wrenches_left_out() == 1);
  CHECK(speed_x(run, 1) == Approx(3));
}

}  // namespace cradle
