// How the materials of two bodies combine: seen in what slides and what bounces.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/physics/worlds.h"

namespace cradle {
namespace {

constexpr CombineRule kRules[] = {CombineRule::by_default,     CombineRule::average,
                                  CombineRule::geometric_mean, CombineRule::minimum,
                                  CombineRule::multiply,       CombineRule::maximum};

/// By words, as documented: the later rule counts; none of both is `other`.
double expected(CombineRule a, CombineRule b, CombineRule other, double x, double y) {
  CombineRule rule = std::find(std::begin(kRules), std::end(kRules), a) >
                             std::find(std::begin(kRules), std::end(kRules), b)
                         ? a
                         : b;
  if (rule == CombineRule::by_default) rule = other;
  if (rule == CombineRule::average) return (x + y) / 2;
  if (rule == CombineRule::geometric_mean) return std::sqrt(x * y);
  if (rule == CombineRule::multiply) return x * y;
  return rule == CombineRule::minimum ? std::min(x, y) : std::max(x, y);
}

}  // namespace

TEST_CASE("a block is slowed by the friction that the stronger of two rules gives") {
  // 0.2 and 0.8: 0.5, 0.4, 0.2, 0.16 or 0.8 times g.
  for (const CombineRule a : kRules) {
    for (const CombineRule b : kRules) {
      CAPTURE(static_cast<int>(a), static_cast<int>(b));
      World world(settings());
      BodySpec floor = ground(0.2);
      floor.material.friction_rule = a;
      add(world, floor);
      BodySpec block = brick({0.5, 0.5, 0.1}, {0, 0, 0.1}, {10, 0, 0});
      block.material.friction = 0.8;
      block.material.friction_rule = b;
      const BodyId body = add(world, block);
      steps(world, 60);
      const double mu = expected(a, b, CombineRule::geometric_mean, 0.2, 0.8);
      CHECK(10 - state(world, body).v_WBcm.x == Approx(mu * kGravity).epsilon(1e-4));
    }
  }
}

TEST_CASE("a ball rises to what the restitution by the stronger of two rules gives") {
  // 0.4 and 0.9: 0.65, 0.6, 0.4, 0.36 or 0.9; from 1 m to e^2, at e times the time of the fall.
  for (const CombineRule a : kRules) {
    for (const CombineRule b : kRules) {
      CAPTURE(static_cast<int>(a), static_cast<int>(b));
      World world(settings(600));
      BodySpec floor = ground();
      floor.material.restitution = 0.4;
      floor.material.restitution_rule = a;
      add(world, floor);
      BodySpec falling = ball(0.1, {0, 0, 1.1});
      falling.material.restitution = 0.9;
      falling.material.restitution_rule = b;
      const BodyId body = add(world, falling);
      const double e = expected(a, b, CombineRule::maximum, 0.4, 0.9);
      steps(world, static_cast<int>(600 * std::sqrt(2 / kGravity) * (1 + e)));
      double top = 0;
      for (int tick = 0; tick < 5; ++tick) {
        top = std::fmax(top, state(world, body).p_WBo.z - 0.1);
        world.step();
      }
      CHECK(top == Approx(e * e).epsilon(1e-4));
    }
  }
}

TEST_CASE("of two materials' rolling and torsional friction the larger counts") {
  for (const auto& [of_ground, of_ball] : {std::pair{0.0, 0.02}, {0.02, 0.0}, {0.01, 0.02}}) {
    CAPTURE(of_ground, of_ball);
    World world(settings());
    BodySpec floor = ground();
    floor.material.rolling_friction_m = of_ground;
    floor.material.torsional_friction_m = of_ground / 2;
    floor.material.friction_rule = CombineRule::minimum;  // is of friction alone
    add(world, floor);
    BodySpec rolling = ball(0.5, {0, 0, 0.5}, {1, 0, 0});
    rolling.w_WB = {0, 2, 3};
    rolling.material.rolling_friction_m = of_ball;
    rolling.material.torsional_friction_m = of_ball / 2;
    const BodyId body = add(world, rolling);
    steps(world, 12);
    const BodyState s = state(world, body);
    CHECK(1 - s.v_WBcm.x == Approx(0.2 * 0.02 * kGravity / 0.7).epsilon(2e-3));
    CHECK(3 - s.w_WB.z == Approx(0.2 * 0.01 * kGravity / 0.1).epsilon(2e-3));
  }
}

}  // namespace cradle
