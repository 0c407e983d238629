// Bodies that lie on each other come to rest and stay there; nothing else is slowed down.
#include <catch2/catch.hpp>

#include "tests/physics/worlds.h"

using namespace cradle;

namespace {

/// Each cube rests on two, as in T3. Returns the cubes, from below.
std::vector<BodyId> add_wall(World& world, int rows) {
  std::vector<BodyId> cubes;
  for (int row = 0; row < rows; ++row) {
    for (int k = 0; k < rows - row; ++k) {
      const double x = 1.05 * (k - 0.5 * (rows - row - 1));
      cubes.push_back(add(world, brick({0.5, 0.5, 0.5}, {x, 0, 0.5 + row})));
    }
  }
  return cubes;
}

std::vector<BodyState> snapshot(const World& world) {
  std::vector<BodyState> states;
  world.snapshot(states);
  return states;
}

double fastest(const World& world) {
  double most = 0;
  for (const BodyState& body : snapshot(world)) {
    most = std::fmax(most, norm(body.v_WBcm) + norm(body.w_WB));
  }
  return most;
}

double farthest(const std::vector<BodyState>& before, const std::vector<BodyState>& after) {
  double most = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    most = std::fmax(most, distance(before[i].p_WBo, after[i].p_WBo));
    const Quat &p = before[i].q_WB, &q = after[i].q_WB;
    most = std::fmax(most, std::hypot(p.w - q.w, norm({p.x - q.x, p.y - q.y, p.z - q.z})));
  }
  return most;
}

/// Nothing else but soft steps brings it to rest.
WorldSettings by_soft_steps() {
  WorldSettings how = settings();
  how.solver = "soft";
  return how;
}

struct Wall {
  World world{by_soft_steps()};
  BodyId floor;
  std::vector<BodyId> cubes;

  Wall() : floor(add(world, ground())), cubes(add_wall(world, 12)) { steps(world, 400); }
};

Wrench push(BodyId body, const Vec3& force_N) {
  Wrench wrench;
  wrench.body = body;
  wrench.duration = WrenchDuration::until_cleared;
  wrench.value = force_N;
  return wrench;
}

}  // namespace

TEST_CASE("a wall at rest stays where it is") {
  Wall wall;
  REQUIRE(fastest(wall.world) == 0);
  const std::vector<BodyState> before = snapshot(wall.world);
  const StepReport report = wall.world.step();
  CHECK(report.residual_mps < 1e-4 * kGravity / 60);  // what is not balanced, in a tick
  CHECK(report.sub_steps_max >= 4);                   // what its loads ask for
  steps(wall.world, 300);
  CHECK(farthest(before, snapshot(wall.world)) == 0);
}

TEST_CASE("a wall at rest gives way to what is new") {
  Wall wall;
  const std::vector<BodyState> before = snapshot(wall.world);
  SECTION("a small force: by what the springs of its contacts give") {
    REQUIRE(wall.world.push(std::array{push(wall.cubes.back(), {0.05, 0, 0})}).result ==
            Result::ok);
    wall.world.step();
    CHECK(fastest(wall.world) > 0);
    CHECK(farthest(before, snapshot(wall.world)) < 0.05 / 3600);  // what it would do to a free cube
    steps(wall.world, 200);
    CHECK(farthest(before, snapshot(wall.world)) < 1e-4);
    CHECK(fastest(wall.world) == 0);
  }
  SECTION("a force beyond friction") {
    REQUIRE(wall.world.push(std::array{push(wall.cubes.back(), {8, 0, 0})}).result == Result::ok);
    steps(wall.world, 30);
    // (8 - mu m g) t^2 / 2m
    CHECK(state(wall.world, wall.cubes.back()).p_WBo.x ==
          Approx(0.5 * (8 - 0.5 * kGravity) * 0.25).epsilon(0.02));
  }
  SECTION("a support that is taken away") {
    REQUIRE(wall.world.despawn(std::array{wall.cubes[0], wall.cubes[1]}).result == Result::ok);
    steps(wall.world, 30);
    CHECK(state(wall.world, wall.cubes[12]).p_WBo.z < 1.4);
  }
  SECTION("gravity that grows: all sinks in by more") {
    REQUIRE(wall.world.set_gravity({0, 0, -2 * kGravity}).result == Result::ok);
    wall.world.step();
    CHECK(fastest(wall.world) > 0);
    steps(wall.world, 400);
    CHECK(fastest(wall.world) == 0);
  }
  SECTION("a cube that is set down a little higher") {
    Motion motion;
    motion.body = wall.cubes.back();
    motion.sets_pose = true;
    motion.p_WBo = state(wall.world, motion.body).p_WBo;
    motion.p_WBo.z += 1e-4;
    REQUIRE(wall.world.set_motion(std::array{motion}).result == Result::ok);
    steps(wall.world, 300);
    CHECK(farthest(before, snapshot(wall.world)) < 1e-4);
    CHECK(fastest(wall.world) == 0);
  }
}

TEST_CASE("a kinematic floor takes along what has come to rest on it") {
  World world(by_soft_steps());
  BodySpec floor = brick({5, 5, 0.5}, {0, 0, -0.5});
  floor.kind = BodyKind::kinematic;
  const BodyId plate = add(world, floor);
  std::vector<BodyId> cubes;
  for (int k = 0; k < 3; ++k) cubes.push_back(add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5 + k})));
  steps(world, 200);
  REQUIRE(fastest(world) == 0);
  Motion motion;
  motion.body = plate;
  motion.sets_velocity = true;
  motion.v_WBcm = {2e-4, 0, 0};
  REQUIRE(world.set_motion(std::array{motion}).result == Result::ok);
  steps(world, 600);
  for (const BodyId cube : cubes) {
    CHECK(state(world, cube).p_WBo.x == Approx(2e-4 * 10).epsilon(1e-3));
  }
}

TEST_CASE("what rolls on rolls on") {
  World world(by_soft_steps());
  add(world, ground());
  constexpr double kSpeed = 2e-3, kRadius = 0.25;
  const auto roller = [&](const Vec3& p_WBo) {
    BodySpec spec = ball(kRadius, p_WBo, {kSpeed, 0, 0});
    spec.shape = Shape::cylinder(kRadius, 1);
    spec.q_WB = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};
    spec.w_WB = {0, kSpeed / kRadius, 0};
    return add(world, spec);
  };
  const BodyId one = roller({-1, 0, kRadius}), alone = roller({0, 5, kRadius});
  roller({1, 0, kRadius});
  const BodyId plank =
      add(world, brick({2, 0.5, 0.1}, {0, 0, 2 * kRadius + 0.1}, {2 * kSpeed, 0, 0}));
  steps(world, 660);
  // The plank moves on its rollers, and rolls downhill by what the more loaded one sinks in.
  CHECK(state(world, plank).v_WBcm.x > 2 * kSpeed);
  CHECK(state(world, plank).v_WBcm.x < 1.05 * 2 * kSpeed);
  CHECK(state(world, one).v_WBcm.x == Approx(kSpeed).epsilon(0.05));
  CHECK(state(world, alone).v_WBcm.x == Approx(kSpeed).epsilon(1e-3));
  CHECK(state(world, alone).p_WBo.x == Approx(kSpeed * 11).epsilon(1e-3));
}

TEST_CASE("what slides on slides on") {
  World world(by_soft_steps());
  add(world, ground(0));
  BodySpec slider = brick({0.5, 0.5, 0.5}, {0, 0, 0.5}, {2e-3, 0, 0});
  slider.material.friction = 0;
  const BodyId body = add(world, slider);
  steps(world, 600);
  CHECK(state(world, body).p_WBo.x == Approx(0.02).epsilon(1e-6));
}

TEST_CASE("however little pushes what is free to move, it moves") {
  World world(by_soft_steps());
  add(world, ground(0));
  BodySpec slider = brick({0.5, 0.5, 0.5}, {0, 0, 0.5});
  slider.material.friction = 0;
  const BodyId body = add(world, slider);
  steps(world, 100);
  REQUIRE(fastest(world) == 0);
  constexpr double kForce = 5e-4;  // N; what is left unbalanced at rest may be twice as much
  REQUIRE(world.push(std::array{push(body, {kForce, 0, 0})}).result == Result::ok);
  steps(world, 300);
  CHECK(state(world, body).p_WBo.x == Approx(0.5 * kForce * 25).epsilon(0.01));
  REQUIRE(world.clear_wrenches(std::array{body}).result == Result::ok);
  const double v = state(world, body).v_WBcm.x;
  steps(world, 300);
  CHECK(state(world, body).v_WBcm.x == Approx(v).epsilon(1e-9));
}

TEST_CASE("what swings farther than the tolerance is left alone") {
  // With the number of sub-steps fixed, the tolerance says nothing but when sway may end.
  std::vector<BodyState> ends[2];
  for (const double tolerance_m : {1e-6, 5e-4}) {
    WorldSettings how = settings();
    how.sub_steps = 8;
    how.contact_tolerance_m = tolerance_m;
    World world(how);
    add(world, ground());
    BodySpec rocker = ball(0.3, {0, 0, 0.31});
    rocker.shape = Shape::ellipsoid({0.5, 0.5, 0.3});
    rocker.q_WB = {std::cos(0.05), 0, std::sin(0.05), 0};
    add(world, rocker);
    steps(world, 240);
    ends[tolerance_m < 1e-5 ? 0 : 1] = snapshot(world);
  }
  CHECK(farthest(ends[0], ends[1]) == 0);
  CHECK(norm(ends[1].back().w_WB) > 0);
}

TEST_CASE("what swings less than the tolerance comes to rest, also what had been at rest before") {
  // A tower whose top is pushed sways to and fro, by less each time. From one turn to the next it
  // goes twice the amplitude; the first time that this is within the tolerance it is stopped half
  // way. If the sway were measured since the tower had been at rest, it would go on to 0.14 mm.
  World world(by_soft_steps());
  add(world, ground());
  BodyId top;
  for (int k = 0; k < 10; ++k) top = add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5 + k}));
  steps(world, 120);
  REQUIRE(fastest(world) == 0);
  Motion motion;
  motion.body = top;
  motion.sets_velocity = true;
  motion.v_WBcm = {0.4, 0, 0};
  motion.w_WB = {0, 0.4, 0};
  REQUIRE(world.set_motion(std::array{motion}).result == Result::ok);
  std::array<double, 3> x = {0, 0, 0};  // of the top, m, in the last three ticks
  double turn_m = 0, swing_m = 1;
  int since_turn = 0, ticks = 0;
  for (; ticks < 700 && (ticks < 3 || fastest(world) > 0); ++ticks, ++since_turn) {
    world.step();
    x = {x[1], x[2], state(world, top).p_WBo.x};
    if ((x[1] - x[0]) * (x[2] - x[1]) >= 0) continue;
    if (since_turn >= 19) swing_m = std::abs(x[1] - turn_m);
    turn_m = x[1];
    since_turn = 0;
  }
  CHECK(fastest(world) == 0);
  CHECK(swing_m > 2 * world.settings().contact_tolerance_m);
  CHECK(swing_m < 1.4 * 2 * world.settings().contact_tolerance_m);
}
