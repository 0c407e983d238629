// Contacts of large heaps are solved in single precision: to the same bits at every width, and so
// that momentum lasts.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "server/collision/machine_lanes.h"
#include "tests/physics/flock.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

/// Cubes that fly at each other, and on past what they miss; without gravity or ground.
World cloud(int cubes, int lanes = 0) {
  WorldSettings how = settings();
  how.lanes = lanes;
  how.gravity_W = {0, 0, 0};
  World world(how);
  std::mt19937_64 random(11);
  const int side = static_cast<int>(std::ceil(std::cbrt(cubes)));
  for (int i = 0; i < cubes; ++i) {
    const Vec3 at{1.2 * (i % side), 1.2 * (i / side % side), 1.2 * (i / side / side)};
    BodySpec cube = brick({0.5, 0.5, 0.5}, at);
    const double middle = 0.6 * (side - 1);
    cube.v_WBcm = {3 * (middle - at.x), 3 * (middle - at.y), 3 * (middle - at.z)};
    cube.w_WB = {uniform(random, -3, 3), uniform(random, -3, 3), uniform(random, -3, 3)};
    add(world, cube);
  }
  return world;
}

}  // namespace

TEST_CASE("a large heap falls to the same bits at every width") {
  const auto at = [](int lanes) {
    World world = cloud(343, lanes);
    steps(world, 7);
    return world.hash();
  };
  for (const int lanes : machine_lanes()) {
    INFO(lanes << " lanes");
    CHECK(at(lanes) == at(1));
  }
}

TEST_CASE("what is rounded in a large heap leaves its momentum alone") {
  // Newton's third law: what one body gets, another gives, but for the last bit of a float.
  World world = cloud(343);
  const auto sums = [&world] {
    Vector momentum = Vector::Zero();
    double sizes = 0;
    std::vector<BodyState> states;
    world.snapshot(states);
    for (const BodyState& body : states) {
      momentum += to_eigen(body.v_WBcm);  // of 1 kg each
      sizes += to_eigen(body.v_WBcm).norm();
    }
    return std::pair(momentum, sizes);
  };
  const auto [momentum, sizes] = sums();
  steps(world, 60);
  const auto [momentum_now, sizes_now] = sums();
  CAPTURE(sizes, sizes_now);
  CHECK((momentum_now - momentum).norm() < 1e-7 * sizes);
}

}  // namespace cradle
