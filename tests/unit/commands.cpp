// What each command does to a world and to the run of time, and what refuses it.
#include "server/commands.h"

#include <cradle/limits.h>
#include <cradle/version.h>

#include <catch2/catch.hpp>
#include <limits>

#include "tests/physics/worlds.h"

namespace cradle {
namespace {

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

/// A weightless world, ten ticks a second, and how time runs in it.
struct CommandScene {
  explicit CommandScene(const WorldSettings& s = weightless(10)) : world(s) {}

  World world;
  RunState run;
  Permissions permissions;

  Outcome apply(const CommandBody& body) {
    return cradle::apply({{7, ++sequence, 9, 0}, body}, world, run, permissions);
  }
  Result result(const CommandBody& body) { return apply(body).result; }
  BodyState state(BodyId body) const { return cradle::state(world, body); }

  /// Steps as long as time runs, at most `most` ticks; how many.
  int run_on(int most) {
    int done = 0;
    for (; done < most && run.is_stepping(world.tick()); ++done) world.step();
    return done;
  }

  std::int64_t sequence = 0;
};

Wrench force(BodyId body, const Vec3& value) {
  Wrench wrench;
  wrench.body = body;
  wrench.value = value;
  return wrench;
}

}  // namespace

TEST_CASE("spawning makes the bodies, with consecutive ids from the receipt's on") {
  CommandScene scene;
  CHECK(scene.apply(Spawn{{ball(1, {})}}) == Outcome{Result::ok, {1}, 0});
  CHECK(scene.apply(Spawn{{ball(1, {5, 0, 0}), ball(1, {9, 0, 0})}}) ==
        Outcome{Result::ok, {2}, 0});
  CHECK(scene.world.body_count() == 3);
  CHECK(scene.state({3}).p_WBo == Vec3{9, 0, 0});
}

TEST_CASE("despawning removes the bodies, whose ids are not used again") {
  CommandScene scene;
  scene.apply(Spawn{{ball(1, {}), ball(1, {5, 0, 0})}});
  CHECK(scene.result(Despawn{{{2}}}) == Result::ok);
  CHECK(scene.world.body_count() == 1);
  CHECK(scene.apply(Spawn{{ball(1, {7, 0, 0})}}).body == BodyId{3});
  CHECK(scene.apply(Despawn{{{1}, {2}}}) == Outcome{Result::unknown_body, {}, 1});
  CHECK(scene.world.body_count() == 2);
}

TEST_CASE("pushing accelerates the body until its wrenches are cleared") {
  CommandScene scene;
  const BodyId body = scene.apply(Spawn{{ball(1, {})}}).body;  // 1 kg
  Wrench lasting = force(body, {2, 0, 0});
  lasting.duration = WrenchDuration::until_cleared;
  CHECK(scene.result(Push{{lasting}}) == Result::ok);
  CHECK(scene.world.wrench_count() == 1);
  steps(scene.world, 10);
  CHECK(scene.state(body).v_WBcm.x == Approx(2.0));  // F t / m = 2 N * 1 s / 1 kg
  CHECK(scene.result(ClearWrenches{{body}}) == Result::ok);
  CHECK(scene.world.wrench_count() == 0);
  steps(scene.world, 10);
  CHECK(scene.state(body).v_WBcm.x == Approx(2.0));
}

TEST_CASE("a motion sets pose, velocity or both") {
  CommandScene scene;
  const BodyId body = scene.apply(Spawn{{ball(1, {1, 0, 0}, {0, 1, 0})}}).body;
  const Motion pose{body, true, false, {0, 0, 9}, {0, 1, 0, 0}, {7, 7, 7}, {7, 7, 7}};
  CHECK(scene.result(SetMotion{{pose}}) == Result::ok);
  CHECK(scene.state(body).p_WBo == Vec3{0, 0, 9});
  CHECK(scene.state(body).q_WB == Quat{0, 1, 0, 0});
  CHECK(scene.state(body).v_WBcm == Vec3{0, 1, 0});
  const Motion velocity{body, false, true, {7, 7, 7}, {1, 0, 0, 0}, {0, 0, 3}, {0, 2, 0}};
  CHECK(scene.result(SetMotion{{velocity}}) == Result::ok);
  CHECK(scene.state(body).p_WBo == Vec3{0, 0, 9});
  CHECK(scene.state(body).v_WBcm == Vec3{0, 0, 3});
  CHECK(scene.state(body).w_WB == Vec3{0, 2, 0});
}

TEST_CASE("gravity and hello are answered with ok, gravity changes") {
  CommandScene scene;
  CHECK(scene.result(Hello{kProtocolVersion, "me"}) == Result::ok);
  CHECK(scene.result(SetGravity{{0, 0, -1.62}}) == Result::ok);
  CHECK(scene.world.gravity_W() == Vec3{0, 0, -1.62});
}

TEST_CASE("a refused command says why and changes nothing, a batch with one fault included") {
  WorldSettings settings = weightless();
  settings.bodies_max = 4;
  settings.wrenches_max = 2;
  CommandScene scene(settings);
  BodySpec named = ball(1, {});
  named.name = "only one";
  const BodyId fixed = scene.apply(Spawn{{ground()}}).body;
  const BodyId body = scene.apply(Spawn{{named}}).body;
  Wrench held = force(body, {1, 0, 0});
  held.duration = WrenchDuration::until_cleared;
  REQUIRE(scene.result(Push{{held}}) == Result::ok);

  const BodyId none{99};
  const BodySpec fine = ball(1, {5, 5, 5});
  BodySpec sad = fine, namesake = fine, heavy = fine;
  sad.p_WBo.y = kNotANumber;
  namesake.name = "only one";
  heavy.mass_kg = 0;
  heavy.density_kgpm3 = 1e15;  // each number is within its limits, their product is not
  const Wrench good = force(body, {1, 0, 0});
  Wrench torque_at_point = good;
  torque_at_point.quantity = WrenchQuantity::torque;
  torque_at_point.point_kind = WrenchPoint::world_point;
  const Motion still{body, false, true, {}, {}, {}, {}};
  Motion mad = still;
  mad.w_WB.x = kNotANumber;

  const struct {
    CommandBody command;
    Outcome expected;
  } refusals[] = {
      {Hello{kProtocolVersion + 1, ""}, {Result::bad_version, {}, 0}},
      {Spawn{}, {Result::malformed, {}, 0}},
      {Spawn{{fine, sad}}, {Result::not_finite, {}, 1}},
      {Spawn{{fine, heavy}}, {Result::out_of_range, {}, 1}},
      {Spawn{{fine, namesake}}, {Result::duplicate_name, {}, 1}},
      {Spawn{{fine, fine, fine}}, {Result::over_quota, {}, 0}},
      {Despawn{}, {Result::malformed, {}, 0}},
      {Despawn{{body, none}}, {Result::unknown_body, {}, 1}},
      {Push{}, {Result::malformed, {}, 0}},
      {Push{{good, force(body, {kNotANumber, 0, 0})}}, {Result::not_finite, {}, 1}},
      {Push{{good, torque_at_point}}, {Result::bad_wrench, {}, 1}},
      {Push{{force(none, {1, 0, 0})}}, {Result::unknown_body, {}, 0}},
      {Push{{force(fixed, {1, 0, 0})}}, {Result::wrong_kind, {}, 0}},
      {Push{{good, good}}, {Result::over_quota, {}, 0}},
      {ClearWrenches{{body, none}}, {Result::unknown_body, {}, 1}},
      {SetMotion{{still, mad}}, {Result::not_finite, {}, 1}},
      {SetMotion{{still, Motion{none, true, false, {}, {}, {}, {}}}},
       {Result::unknown_body, {}, 1}},
      {SetMotion{{Motion{fixed, false, true, {}, {}, {}, {}}}}, {Result::wrong_kind, {}, 0}},
      {SetGravity{{0, 0, kNotANumber}}, {Result::not_finite, {}, 0}},
      {SetGravity{{0, 0, -1e9}}, {Result::out_of_range, {}, 0}},
      {Control{ControlAction::step, 1}, {Result::not_allowed, {}, 0}},
      {Control{ControlAction::shutdown, 0}, {Result::not_allowed, {}, 0}},
      {Control{ControlAction::pause, 1}, {Result::malformed, {}, 0}},
  };
  scene.world.take_events();
  const auto hash = scene.world.hash();
  for (std::size_t i = 0; i < std::size(refusals); ++i) {
    CAPTURE(i, to_string(refusals[i].expected.result));
    CHECK(scene.apply(refusals[i].command) == refusals[i].expected);
    CHECK(scene.world.hash() == hash);
    CHECK(scene.world.take_events().empty());
    CHECK((!scene.run.paused && !scene.run.shutdown && scene.run.pending.empty()));
  }
}

TEST_CASE("pause stops time, resume lets it run, doing so twice is no fault") {
  CommandScene scene;
  CHECK(scene.run_on(5) == 5);
  for (int i = 0; i < 2; ++i) {
    CHECK(scene.result(Control{ControlAction::pause, 0}) == Result::ok);
    CHECK(scene.run_on(5) == 0);
  }
  for (int i = 0; i < 2; ++i) {
    CHECK(scene.result(Control{ControlAction::resume, 0}) == Result::ok);
    CHECK(scene.run_on(5) == 5);
  }
}

TEST_CASE("step commands are for a world that stands still, queued, and follow each other") {
  for (const bool lockstep : {false, true}) {
    CAPTURE(lockstep);
    CommandScene scene;
    scene.world.step();
    scene.run.lockstep = lockstep;
    if (!lockstep) {
      CHECK(scene.result(Control{ControlAction::step, 1}) == Result::not_allowed);
      scene.apply(Control{ControlAction::pause, 0});
    }
    CHECK(scene.run_on(5) == 0);
    CHECK(scene.result(Control{ControlAction::step, 3}) == Result::queued);
    const CommandHeader first{7, scene.sequence, 9, 0};
    CHECK(scene.result(Control{ControlAction::step, 2}) == Result::queued);
    REQUIRE(scene.run.pending.size() == 2);
    CHECK(scene.run.pending[0].header == first);
    CHECK(scene.run.pending[0].until == 1 + 3);
    CHECK(scene.run.pending[1].until == 1 + 3 + 2);
    CHECK(scene.run_on(100) == 5);
    scene.run.pending.clear();  // as the daemon does when it has answered them
    CHECK(scene.result(Control{ControlAction::step, 1}) == Result::queued);
    CHECK(scene.run_on(100) == 1);
  }
}

TEST_CASE("as many step commands can wait as a client may queue commands") {
  CommandScene scene;
  scene.run.paused = true;
  const Control step{ControlAction::step, 1};
  for (int i = 0; i < limits::kQueuedCommands; ++i) REQUIRE(scene.result(step) == Result::queued);
  CHECK(scene.result(step) == Result::over_quota);
  CHECK(scene.run.pending.size() == limits::kQueuedCommands);
}

TEST_CASE("what the configuration forbids is not allowed, and nothing else is") {
  CommandScene scene;
  const auto result = [&scene](ControlAction action, bool control, bool shutdown) {
    scene.run = {};
    scene.run.lockstep = true;
    scene.permissions = {control, shutdown};
    return scene.result(Control{action, action == ControlAction::step ? 1 : 0});
  };
  for (const auto action : {ControlAction::pause, ControlAction::resume}) {
    CHECK(result(action, true, false) == Result::ok);
    CHECK(result(action, false, true) == Result::not_allowed);
  }
  CHECK(result(ControlAction::step, true, false) == Result::queued);
  CHECK(result(ControlAction::step, false, true) == Result::not_allowed);
  CHECK(scene.run.pending.empty());
  CHECK(result(ControlAction::shutdown, true, false) == Result::not_allowed);
  CHECK(!scene.run.shutdown);
  CHECK(result(ControlAction::shutdown, false, true) == Result::ok);
  CHECK(scene.run.shutdown);
  scene.permissions = {false, false};
  CHECK(scene.result(Spawn{{ball(1, {})}}) == Result::ok);
}

}  // namespace cradle
