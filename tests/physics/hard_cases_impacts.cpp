// Hard cases of impacts, at default settings.
#include <catch2/catch.hpp>
#include <vector>

#include "tests/physics/worlds.h"

namespace cradle {

TEST_CASE("P28: five spheres fall on each other and stay in line") {
  // Chrono's stacking test: r = 1 m, dropped from 5 + 2.5 i, e = 0.3, mu = 0.3, 10 s: nothing goes
  // aside or turns, within 1e-6.
  World world(settings());
  BodySpec floor = ground(0.3);
  floor.material.restitution = 0.3;
  add(world, floor);
  std::vector<BodyId> spheres;
  for (int i = 0; i < 5; ++i) {
    BodySpec spec = ball(1, {0, 0, 5 + 2.5 * i});
    spec.material = {0.3, 0.3};
    spheres.push_back(add(world, spec));
  }
  steps(world, 600);
  for (int i = 0; i < 5; ++i) {
    const BodyState s = state(world, spheres[static_cast<std::size_t>(i)]);
    CAPTURE(i);
    CHECK(std::hypot(s.p_WBo.x, s.p_WBo.y) < 1e-6);
    CHECK(angle(s.q_WB, {}) < 1e-6);
    CHECK(norm(s.w_WB) < 1e-6);
    CHECK(s.p_WBo.z == Approx(1 + 2.0 * i).margin(0.5e-3 * (i + 1)));  // the tolerance a contact
    CHECK(norm(s.v_WBcm) < 1e-3);
  }
}

TEST_CASE("P37: boxes that fly 2 m a tick hit each other") {
  // Jolt's MotionQualityLinearCastTests: boxes of 1 m, 2 m apart, +-120 m/s, 60 Hz: with e = 1 they
  // bounce back, with e = 0 they stop where they touch. Jolt's slop is 2 cm; ours is 0.5 mm.
  for (const double e : {0.0, 1.0}) {
    World world(weightless());
    BodySpec left = brick({0.5, 0.5, 0.5}, {-1, 0, 0}, {120, 0, 0});
    BodySpec right = brick({0.5, 0.5, 0.5}, {1, 0, 0}, {-120, 0, 0});
    left.material = right.material = {0, e};
    const BodyId a = add(world, left), b = add(world, right);
    int tick = 0;
    while (tick < 3) {
      world.step();
      ++tick;
      CAPTURE(e, tick);
      const BodyState sa = state(world, a), sb = state(world, b);
      CHECK(distance(sa.v_WBcm, {-120 * e, 0, 0}) < 1e-3);
      CHECK(distance(sb.v_WBcm, {120 * e, 0, 0}) < 1e-3);
      // They touch after 0.5 m, and go back for what is left of the time.
      const double way = tick * 2 - 0.5;
      const double x = 0.5 + e * way;
      CHECK(sb.p_WBo.x == Approx(x).margin(0.5e-3));
      CHECK(sa.p_WBo.x == Approx(-x).margin(0.5e-3));
      CHECK(norm(sa.w_WB) + norm(sb.w_WB) < 1e-6);
    }
  }
}

}  // namespace cradle
