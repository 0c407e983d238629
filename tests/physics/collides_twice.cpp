// Ticks that are taken in two halves, each with contacts of its own, while contacts close fast.
#include <catch2/catch.hpp>

#include "tests/physics/terrains.h"

namespace cradle {
namespace {

WorldSettings twice(double rate_hz = 60) {
  WorldSettings how = settings(rate_hz);
  how.collides_twice = true;
  how.balance_every = 1;
  how.balance_flight = true;
  return how;
}

constexpr double kFall_mps = 8;

/// Bricks that fall side by side and on each other.
std::vector<BodyId> let_fall(World& world) {
  add(world, ground());
  constexpr double kGap_m = 0.1;  // less than they fall in a tick
  std::vector<BodyId> bricks;
  for (int k = 0; k < 12; ++k) {
    BodySpec spec =
        brick({0.4, 0.3, 0.2},
              {0.9 * (k % 3) + 0.05 * k, 0.03 * k, 0.2 + kGap_m + 0.45 * (k / 3) + 0.02 * (k % 3)},
              {0.1 * k, 0, -kFall_mps});
    spec.w_WB = {k == 0 ? 0 : 0.3, k == 0 ? 0 : 0.2 * (k % 4), 0.1};
    spec.material.friction = 0.4;
    spec.material.restitution = 0.2;
    bricks.push_back(add(world, spec));
  }
  return bricks;
}

/// A platform that moves, balls that bounce on terrain, a shot at a wall, and a spring.
std::vector<BodyId> add_others(World& world, const std::vector<BodyId>& bricks) {
  std::vector<BodyId> others;
  BodySpec platform = brick({0.5, 0.5, 0.1}, {3.2, 0, 0.3}, {-2, 0, 0.5});
  platform.kind = BodyKind::kinematic;
  others.push_back(add(world, platform));
  add_surface(
      world,
      make_height_field(3, 3, 2, 2, std::vector<double>{0.2, 0.1, 0.3, 0, 0.2, 0.1, 0.3, 0, 0.1})
          .geometry,
      {20, 0, 0});
  for (int k = 0; k < 6; ++k) {
    BodySpec spec = ball(0.1, {20 + 0.3 * (k - 2.5), 0.05 * k, 0.5 + 0.15 * k}, {0, 0, -10});
    spec.material.restitution = 0.9;
    others.push_back(add(world, spec));
  }
  add(world, brick({0.01, 1, 1}, {-20, 0, 3}));
  for (int k = 0; k < 20; ++k) {  // one after the other
    others.push_back(add(world, ball(0.02, {-25 - 5.0 * k, 0, 3}, {300, 0, 0})));
  }
  Spring spring{bricks[9], bricks[10], {0.1, 0, 0}, {0, 0.1, 0}, 200, 5, 0.3};
  REQUIRE(world.add_springs(std::array{spring}).result == Result::ok);
  return others;
}

Wrench wrench(BodyId body, WrenchQuantity quantity, WrenchDuration duration, const Vec3& value) {
  Wrench w;
  w.body = body;
  w.quantity = quantity;
  w.duration = duration;
  w.value = value;
  return w;
}

/// A force that turns with a body, and a blow.
void push(World& world, const std::vector<BodyId>& bricks) {
  Wrench turning =
      wrench(bricks[4], WrenchQuantity::force, WrenchDuration::until_cleared, {3, 2, 1});
  turning.frame = WrenchFrame::body;
  const Wrench blow =
      wrench(bricks[7], WrenchQuantity::impulse, WrenchDuration::this_tick, {0.5, 0, 0.5});
  REQUIRE(world.push(std::array{turning, blow}).result == Result::ok);
}

/// A torque for so many ticks, and drag.
void turn(World& world, const std::vector<BodyId>& bricks, int ticks) {
  Wrench torque = wrench(bricks[5], WrenchQuantity::torque, WrenchDuration::ticks, {0, 0, 2});
  torque.ticks = ticks;
  REQUIRE(world.push(std::array{torque}).result == Result::ok);
  REQUIRE(world.set_drag(bricks[8], {0.5, 0.1, 0.01}).result == Result::ok);
}

}  // namespace

TEST_CASE("a tick in two halves is two ticks of half the length") {
  World world(twice()), finer(settings(120));
  std::vector<BodyId> bodies = let_fall(world);
  let_fall(finer);
  for (World* one : {&world, &finer}) {
    const std::vector<BodyId> others = add_others(*one, bodies);
    if (one == &finer) bodies.insert(bodies.end(), others.begin(), others.end());
  }
  push(world, bodies);
  push(finer, bodies);
  CHECK(world.step().parts == 2);
  steps(finer, 2);
  turn(world, bodies, 2);
  turn(finer, bodies, 4);
  int ticks = 1, impacts = 0, stopped = 0;
  for (StepReport report; (report = world.step()).parts == 2 && ticks < 20;) {
    ++ticks;
    impacts += report.impacts;
    stopped += report.stopped_at_impact;
    steps(finer, 2);
    CAPTURE(ticks);
    CHECK(world.wrench_count() == finer.wrench_count());
    for (const BodyId body : bodies) {
      CAPTURE(body.value);
      CHECK(state(world, body) == state(finer, body));
    }
  }
  CHECK(ticks > 15);
  CHECK(impacts > 0);
  CHECK(stopped > 0);
}

TEST_CASE("a tick in two halves is so in the plane, too") {
  WorldSettings how = twice();
  how.is_planar = true;
  how.gravity_W = {0, -kGravity, 0};
  WorldSettings fine = how;
  fine.collides_twice = false;
  fine.rate_hz = 120;
  World world(how), finer(fine);
  std::vector<BodyId> bodies;
  for (World* one : {&world, &finer}) {
    BodySpec floor = ground();
    floor.q_WB = {std::sqrt(0.5), -std::sqrt(0.5), 0, 0};
    bodies = {add(*one, floor)};
    for (int k = 0; k < 9; ++k) {
      BodySpec spec = brick({0.4, 0.2, 0.5}, {0.9 * (k % 3) + 0.1 * k, 0.3 + 0.6 * (k / 3), 0},
                            {0.1 * k, -8, 0});
      spec.w_WB = {0, 0, 0.2 * k};
      bodies.push_back(add(*one, spec));
    }
  }
  int ticks = 0;
  while (world.step().parts == 2 && ticks < 12) {
    ++ticks;
    steps(finer, 2);
    CAPTURE(ticks);
    for (const BodyId body : bodies) CHECK(state(world, body) == state(finer, body));
  }
  CHECK(ticks > 4);
}

TEST_CASE("the balance of a tick in two halves is that of both") {
  World world(twice());
  push(world, let_fall(world));
  int halves = 0;
  for (int tick = 0; tick < 40; ++tick) {
    const double before_J = world.totals().kinetic_energy_J;
    const StepReport report = world.step();
    CAPTURE(tick, report.parts);
    halves += report.parts - 1;
    CHECK(report.balance.kinetic_J ==
          Approx(world.totals().kinetic_energy_J - before_J).margin(1e-9));
  }
  CHECK(halves > 5);
}

TEST_CASE("what falls in on itself turns into itself by half as much") {
  double once_m = 0, twice_m = 0, mean_once_m = 0, mean_twice_m = 0;
  for (const bool is_twice : {false, true}) {
    WorldSettings how = settings();
    how.collides_twice = is_twice;
    World world(how);
    add(world, ground());
    for (int k = 0; k < 216; ++k) {
      BodySpec spec =
          brick({0.5, 0.5, 0.5}, {1.6 * (k % 6), 1.6 * (k / 6 % 6), 1 + 1.9 * (k / 36)});
      spec.q_WB = {std::cos(0.3 * k), std::sin(0.3 * k), 0, 0};
      add(world, spec);
    }
    double& most_m = is_twice ? twice_m : once_m;
    double& mean_m = is_twice ? mean_twice_m : mean_once_m;
    int halves = 0;
    for (int tick = 0; tick < 240; ++tick) {
      const StepReport report = world.step();
      halves += report.parts - 1;
      most_m = std::fmax(most_m, report.penetration_max_m);
      mean_m += report.penetration_max_m / 240;
    }
    CHECK(halves >= (is_twice ? 60 : 0));
    CHECK(halves <= (is_twice ? 239 : 0));
  }
  CAPTURE(once_m, twice_m, mean_once_m, mean_twice_m);
  CHECK(twice_m < 0.7 * once_m);
  CHECK(mean_twice_m < 0.6 * mean_once_m);
}

TEST_CASE("what lies or rolls is looked at once in a tick") {
  World world(twice());
  add(world, ground());
  for (int k = 0; k < 5; ++k) add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5 + k}));
  add(world, ball(0.5, {5, 0, 0.5}, {3, 0, 0}));
  world.step();  // the ball had no contact before
  for (int tick = 1; tick < 60; ++tick) CHECK(world.step().parts == 1);
}

TEST_CASE("sleepers stay as they are where something else strikes fast") {
  WorldSettings how = twice();
  how.is_sleeping = true;
  World world(how);
  add(world, ground());
  BodyId top;
  for (int k = 0; k < 5; ++k) top = add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5 + k}));
  add(world, brick({0.5, 0.5, 0.5}, {50, 0, 20}));  // for two seconds
  steps(world, 60);
  const BodyState asleep = state(world, top);
  int halves = 0;
  for (int tick = 60; tick < 130; ++tick) {
    const StepReport report = world.step();
    halves += report.parts - 1;
    CHECK(report.sleeping == 5);
    CHECK(report.pairs <= 1);  // of the one that falls and the ground
    CHECK(report.bodies_in_contact <= 1);
    CHECK(state(world, top) == asleep);
  }
  CHECK(halves > 0);
}

}  // namespace cradle
