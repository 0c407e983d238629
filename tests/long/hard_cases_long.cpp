// Hard cases that take long.
#include <catch2/catch.hpp>
#include <vector>

#include "tests/physics/worlds.h"

namespace cradle {

TEST_CASE("P29: a pyramid of base 100 stands for 200 steps") {
  // Box3D's large_pyramid: 5050 cubes side by side. They stand, and drift by less than Box3D's
  // slop, 5 mm: by 2.5 um. It is 0.22 m by soft steps alone.
  constexpr int kBase = 100;
  World world(settings());
  add(world, ground());
  std::vector<BodyId> bodies;
  std::vector<Vec3> begin;
  for (int row = 0; row < kBase; ++row) {
    for (int i = 0; i < kBase - row; ++i) {
      begin.push_back({i + 0.5 * row, 0, row + 0.5});
      bodies.push_back(add(world, brick({0.5, 0.5, 0.5}, begin.back())));
    }
  }
  steps(world, 200);
  double drift = 0, lowest = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Vec3 p = state(world, bodies[i]).p_WBo;
    drift = std::fmax(drift, std::hypot(p.x - begin[i].x, p.y - begin[i].y));
    lowest = std::fmax(lowest, begin[i].z - p.z);
  }
  CAPTURE(drift, lowest);
  CHECK(drift < 1e-5);
  CHECK(lowest < kBase * 0.5e-3);
}

}  // namespace cradle
