// Which friction is right, seen in outcomes over many runs of a chaotic scene.
#include <catch2/catch.hpp>
#include <random>
#include <vector>

#include "tests/physics/planar.h"
#include "tests/physics/worlds.h"

namespace cradle {

TEST_CASE("a struck pyramid collapses, as with friction at each point it must") {
  // 210 cubes, 20 in the lowest row, none of them quite in its place; a cube of 2 m and 20 kg hits
  // it at about 10 m/s. With friction at each point of a manifold nearly all collapse, to about
  // 2600 of 14 075 J. Where one limit cut the friction of a manifold's points together, none did:
  // 13 400 J stayed, and the pyramid with a hole.
  constexpr int kBase = 20, kRuns = 15;
  int collapsed = 0;
  for (int run = 0; run < kRuns; ++run) {
    std::mt19937_64 random(static_cast<std::uint64_t>(run) + 1);
    World world(settings());
    add(world, ground());
    std::vector<BodyId> bodies;
    for (int row = 0; row < kBase; ++row) {
      for (int i = 0; i < kBase - row; ++i) {
        const double x = (i - 0.5 * (kBase - row)) * 1.05 + uniform(random, -0.005, 0.005);
        const double y = uniform(random, -0.02, 0.02);
        BodySpec spec = brick({0.5, 0.5, 0.5}, {x, y, row * 1.001 + 0.501});
        spec.q_WB = about_z(uniform(random, -0.015, 0.015));
        bodies.push_back(add(world, spec));
      }
    }
    const auto energy = [&] {
      double sum = 0;
      for (const BodyId body : bodies) {
        const BodyState s = state(world, body);
        sum += kGravity * s.p_WBo.z + 0.5 * norm(s.v_WBcm) * norm(s.v_WBcm);
      }
      return sum;
    };
    steps(world, 240);
    const double before = energy();
    CHECK(before > 14070);
    BodySpec blow = brick({1, 1, 1}, {0, -1.7, 6}, {0, 9.7 + 0.6 * run / (kRuns - 1), 0});
    blow.mass_kg = 20;
    add(world, blow);
    steps(world, 600);
    collapsed += energy() < 10000;
  }
  // 87 of 90 others did: more than half tell the two laws apart, whatever the seeds.
  CHECK(collapsed > kRuns / 2);
}

}  // namespace cradle
