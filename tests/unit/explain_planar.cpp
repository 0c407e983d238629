// What bodies of planar worlds do without, against the full model.
#include <catch2/catch.hpp>

#include "server/explain.h"
#include "tests/physics/planar.h"

namespace cradle {

TEST_CASE("what a planar world does without keeps within its bound, over 200 random scenes") {
  std::mt19937_64 random(9);
  SerialExecutor here;
  double seen_rad = 0, bound_rad = 0;
  std::int64_t planar = 0;
  for (int number = 0; number < 200; ++number) {
    CAPTURE(number);
    Scene scene;
    scene.settings = planar_settings({0, -9.81, 0});
    for (std::size_t i = 0; i < 4; ++i) {
      scene.bodies.push_back(random_planar_body(random));
      if (random() % 2 == 0) scene.wrenches.push_back({1, i, random_planar_wrench(random, {})});
    }
    SceneRun lean(scene);
    scene.settings.is_full = true;
    SceneRun full(scene);
    Explanation explanation(lean);
    const auto ticks = 1 + random() % 60;
    for (std::uint64_t tick = 0; tick < ticks; ++tick) {
      explanation.step(here);
      full.step(here);
    }
    planar += explanation.savings()[static_cast<std::size_t>(Omission::third_dimension)].bodies;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      Explanation::Bound bound;
      if (!explanation.bound(i, bound)) continue;
      const BodyState a = state(lean.world(), lean.id(i)), b = state(full.world(), full.id(i));
      const double seen = turn_between(a.q_WB, b.q_WB);
      CAPTURE(i, 1e15 * seen, 1e15 * bound.angle_rad);
      REQUIRE(seen <= bound.angle_rad);
      REQUIRE(distance(a.p_WBo, b.p_WBo) <= bound.distance_m);
      seen_rad = std::fmax(seen_rad, seen);
      bound_rad = std::fmax(bound_rad, bound.angle_rad);
    }
  }
  CAPTURE(1e15 * seen_rad, 1e15 * bound_rad);
  CHECK(bound_rad <= 100 * seen_rad);
  CHECK(planar > 400);
}

}  // namespace cradle
