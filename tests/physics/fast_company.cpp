// Bodies that move far in a tick, where a second body has a hand in it: what one has stopped,
// turned back or taken along still meets the others. Each was passed once.
#include <catch2/catch.hpp>
#include <numbers>
#include <random>

#include "server/collision/stored_geometry.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

BodySpec fixed_body(const Shape& shape, const Vec3& p_WBo) {
  BodySpec spec;
  spec.kind = BodyKind::fixed;
  spec.shape = shape;
  spec.p_WBo = p_WBo;
  return spec;
}

BodySpec thrown_ball(double radius_m, double density_kgpm3, double restitution, const Vec3& p_WBo,
                     const Vec3& v_WBcm) {
  BodySpec spec;
  spec.shape = Shape::sphere(radius_m);
  spec.density_kgpm3 = density_kgpm3;
  spec.material.restitution = restitution;
  spec.material.friction = 0;
  spec.p_WBo = p_WBo;
  spec.v_WBcm = v_WBcm;
  return spec;
}

}  // namespace

TEST_CASE("a ball that comes to rest on the floor within a tick meets the wall") {
  const double rate_hz = GENERATE(60.0, 240.0);
  const double restitution = GENERATE(0.0, 0.05);
  const bool are_planes = GENERATE(false, true);
  for (const double speed : {10.0, 60.0, 1000.0}) {
    for (const double height : {0.06, 0.3}) {
      for (const double angle : {0.1, 0.26, 1.0}) {
        CAPTURE(rate_hz, restitution, are_planes, speed, height, angle);
        World world(settings(rate_hz));
        BodySpec plane = fixed_body(Shape::half_space(), {2, 0, 0});
        plane.q_WB = {std::sqrt(0.5), 0, -std::sqrt(0.5), 0};  // faces -x
        add(world, are_planes ? fixed_body(Shape::half_space(), {})
                              : fixed_body(Shape::box({10, 10, 0.5}), {0, 0, -0.5}));
        add(world, are_planes ? plane : fixed_body(Shape::box({0.01, 5, 5}), {2.01, 0, 2}));
        const BodyId ball =
            add(world, thrown_ball(0.05, 1000, restitution, {1.9, 0, height},
                                   {speed * std::cos(angle), 0, -speed * std::sin(angle)}));
        for (int tick = 0; tick < 30; ++tick) {
          world.step();
          REQUIRE(state(world, ball).p_WBo.x <= 1.95 + 1e-6);
          REQUIRE(state(world, ball).p_WBo.z >= 0.05 - 1e-3);
        }
      }
    }
  }
}

TEST_CASE("a ball that lies in a groove between two planes within a tick slides along it") {
  // Planes at 45 degrees, in y and z: nothing acts along x.
  World world(settings());
  const double half = std::sqrt(0.5);
  for (const double side : {1.0, -1.0}) {
    BodySpec plane = fixed_body(Shape::half_space(), {});
    plane.q_WB = {std::cos(0.125 * std::numbers::pi), -side * std::sin(0.125 * std::numbers::pi), 0,
                  0};
    add(world, plane);
  }
  const BodyId ball =
      add(world, thrown_ball(0.05, 1000, 0, {0, 0, 0.05 / half + 0.01}, {3, 0, -5}));
  for (int tick = 1; tick <= 4; ++tick) {
    const StepReport report = world.step();
    CHECK(report.impacts_spent == 0);
    const BodyState s = state(world, ball);
    CHECK(s.p_WBo.x == Approx(3.0 * tick / 60).margin(1e-6));
    CHECK(s.p_WBo.z == Approx(0.05 / half).margin(1e-3));
    CHECK(s.p_WBo.y == Approx(0).margin(1e-9));
  }
}

TEST_CASE("a ball that is turned back meets a ball that flies") {
  // Between a ball and a box, at rest: it comes back from the box within the tick.
  const double rate_hz = GENERATE(60.0, 240.0);
  for (const double restitution : {0.16, 0.5, 1.0}) {
    for (const double speed : {60.0, 200.0, 540.0}) {
      CAPTURE(rate_hz, restitution, speed);
      World world(weightless(rate_hz));
      const BodyId first = add(world, thrown_ball(0.05, 1000, 0, {}, {}));
      const BodyId fast =
          add(world, thrown_ball(0.014, 80, restitution, {0.3, 0, 0}, {speed, 0, 0}));
      BodySpec box = brick({0.03, 0.03, 0.03}, {0.44, 0, 0});
      box.mass_kg = 1.7;
      const BodyId last = add(world, box);
      for (int tick = 0; tick < 12; ++tick) {
        world.step();
        const double x = state(world, fast).p_WBo.x;
        REQUIRE(x > state(world, first).p_WBo.x);
        REQUIRE(x < state(world, last).p_WBo.x);
      }
    }
  }
}

TEST_CASE("a thin rod whose centre of mass is beside its axis stays on its side of a wall") {
  std::mt19937_64 engine(5);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine);
  };
  for (int trial = 0; trial < 120; ++trial) {
    CAPTURE(trial);
    World world(settings());
    add(world, fixed_body(Shape::box({50, 50, 0.005}), {0, 0, -0.005}));
    BodySpec rod;
    rod.shape = Shape::cylinder(uniform(0.005, 0.01), uniform(0.2, 0.4));
    const Rotation q = Rotation(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    rod.q_WB = to_plain(q.normalized());
    rod.p_WBo = {0, 0, 0.6};
    rod.v_WBcm = {uniform(-40, 40), uniform(-40, 40), -uniform(5, 80)};
    rod.w_WB = {uniform(-200, 200), uniform(-200, 200), uniform(-200, 200)};
    rod.sets_centre_of_mass = true;
    rod.p_BoBcm = {uniform(-0.02, 0.02), 0, uniform(-0.02, 0.02)};
    const BodyId id = add(world, rod);
    for (int tick = 0; tick < 60; ++tick) {
      world.step();
      REQUIRE(state(world, id).p_WBo.z > -1e-3);
    }
  }
}

TEST_CASE("a wall that moves fast takes along what another body has stopped in its way") {
  for (const double speed : {100.0, 400.0}) {
    for (const double against : {0.0, 50.0, 300.0}) {
      CAPTURE(speed, against);
      World world(weightless());
      BodySpec wall = brick({0.005, 3, 3}, {-1, 0, 0}, {speed, 0, 0});
      wall.kind = BodyKind::kinematic;
      const BodyId moving = add(world, wall);
      const BodyId near = add(world, brick({0.1, 0.1, 0.1}, {1, 0, 0}));
      const BodyId far = add(world, brick({0.1, 0.1, 0.1}, {1.5, 0, 0}, {-against, 0, 0}));
      for (int tick = 0; tick < 10; ++tick) {
        world.step();
        const double x = state(world, moving).p_WBo.x;
        REQUIRE(state(world, near).p_WBo.x > x);
        REQUIRE(state(world, far).p_WBo.x > x);
      }
    }
  }
}

TEST_CASE("what is stopped where it has no speed left has a speed that is a number") {
  // Balls of the fuzzer at one tick a second: one at rest against a wall is struck from behind.
  const double radius = 4.625;
  WorldSettings slow = settings(limits::kRateMin_hz, {5.875, 5.875, 5.875});
  slow.sub_steps = 4;
  World world(slow);
  BodySpec wall = fixed_body(Shape::sphere(radius), {radius, radius, radius});
  wall.kind = BodyKind::kinematic;
  add(world, wall);
  const auto dynamic = [&](double at) {
    BodySpec spec = thrown_ball(radius, 1000, 0, {at, at, at}, {});
    spec.mass_kg = radius;
    spec.material.friction = 0.5;
    return add(world, spec);
  };
  const BodyId resting = dynamic(-6);
  for (int tick = 0; tick < 44; ++tick) world.step();
  CHECK(state(world, resting).v_WBcm == Vec3{});
  dynamic(radius);
  dynamic(-6);
  world.step();
  CHECK(std::isfinite(state(world, resting).v_WBcm.x));
  CHECK(world.quarantined_count() == 0);
}

}  // namespace cradle
