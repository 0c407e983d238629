// Lattices: order, places and random numbers, against tests/scenes/README.md.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "tests/unit/scene_helpers.h"

namespace cradle {
namespace {

std::vector<BodySpec> bodies_of_lattice(const std::string& lines,
                                        const std::string& body = "mass_kg = 1\n") {
  return scene_of("[[lattice]]\n" + lines + "\n[[lattice.body]]\n" + body).bodies;
}

}  // namespace

TEST_CASE("a lattice goes layer by layer, row by row, x fastest") {
  const auto bodies =
      bodies_of_lattice("count = [2, 3, 4]\npitch_m = [1, 10, 100]\norigin_m = [0.5, 0.25, -8]");
  REQUIRE(bodies.size() == 24);
  std::size_t n = 0;
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 2; ++i) {
        CHECK(bodies[n++].p_WBo == Vec3{0.5 + i, 0.25 + 10 * j, -8 + 100.0 * k});
      }
    }
  }
}

TEST_CASE("a tapered lattice loses bodies with each layer and stays centred") {
  const auto wall = bodies_of_lattice("count = [3, 1, 3]\npitch_m = [2, 1, 1]\ntaper = [1, 0]");
  const std::vector<Vec3> expected = {{0, 0, 0}, {2, 0, 0}, {4, 0, 0},
                                      {1, 0, 1}, {3, 0, 1}, {2, 0, 2}};  // by hand
  REQUIRE(wall.size() == expected.size());
  for (std::size_t i = 0; i < wall.size(); ++i) CHECK(wall[i].p_WBo == expected[i]);

  const auto pyramid = bodies_of_lattice("count = [5, 3, 2]\npitch_m = [1, 1, 1]\ntaper = [2, 1]");
  REQUIRE(pyramid.size() == 15 + 6);
  CHECK(pyramid[15].p_WBo == Vec3{1, 0.5, 1});
  CHECK(pyramid[20].p_WBo == Vec3{3, 1.5, 1});

  CHECK(bodies_of_lattice("count = [2, 1, 1]\npitch_m = [1, 1, 1]\ntaper = [1, 0]").size() == 2);
}

TEST_CASE("the bodies of a lattice are taken in turn, each relative to its lattice point") {
  const Scene scene = scene_of(R"(
[[body]]
mass_kg = 9

[[lattice]]
count = [5, 1, 1]
pitch_m = [10, 1, 1]
  [[lattice.body]]
  mass_kg = 1
  position_m = [1, 2, 3]
  velocity_mps = [4, 5, 6]
  [[lattice.body]]
  shape = "sphere"
  radius_m = 1
    [[lattice.body.wrench]]
    value = [7, 0, 0]
)");
  REQUIRE(scene.bodies.size() == 6);
  CHECK(scene.bodies[0].mass_kg == 9);
  for (const std::size_t i : {1U, 3U, 5U}) {
    CHECK(scene.bodies[i].p_WBo == Vec3{10.0 * static_cast<double>(i - 1) + 1, 2, 3});
    CHECK(scene.bodies[i].v_WBcm == Vec3{4, 5, 6});
    CHECK(scene.bodies[i].q_WB == Quat{});
  }
  for (const std::size_t i : {2U, 4U}) CHECK(scene.bodies[i].shape == Shape::sphere(1));
  REQUIRE(scene.wrenches.size() == 2);
  CHECK(scene.wrenches[0].body == 2);
  CHECK(scene.wrenches[1].body == 4);
}

TEST_CASE("the random numbers of a lattice are the documented ones in the documented order") {
  const auto bodies = bodies_of_lattice(
      "count = [3, 2, 2]\npitch_m = [10, 10, 10]\nseed = 42\njitter_m = [1, 0.5, 0]\n"
      "random_orientation = true\nvelocity_jitter_mps = [1, 2, 3]\n"
      "angular_velocity_jitter_radps = [4, 5, 6]",
      "mass_kg = 1\nvelocity_mps = [100, 0, 0]\nangular_velocity_radps = [0, 50, 0]\n");
  REQUIRE(bodies.size() == 12);

  // Written from the document, not from the code.
  std::mt19937_64 engine(42);
  const auto u = [&] { return 2 * (static_cast<double>(engine() >> 11) / 9007199254740992.0) - 1; };
  int rejected = 0;
  for (std::size_t n = 0; n < bodies.size(); ++n) {
    CAPTURE(n);
    const BodySpec& body = bodies[n];
    const double x = 10.0 * static_cast<double>(n % 3) + 1 * u();
    const double y = 10.0 * static_cast<double>(n / 3 % 2) + 0.5 * u();
    const double z = 10.0 * static_cast<double>(n / 6) + 0 * u();
    CHECK(body.p_WBo == Vec3{x, y, z});
    double w = 0, a = 0, b = 0, c = 0, squared = 2;
    for (; squared > 1; ++rejected) {
      w = u(), a = u(), b = u(), c = u();
      squared = w * w + a * a + b * b + c * c;
    }
    --rejected;
    const double norm = std::sqrt(squared);
    CHECK(body.q_WB == Quat{w / norm, a / norm, b / norm, c / norm});
    const double vx = 100 + u(), vy = 2 * u(), vz = 3 * u();
    CHECK(body.v_WBcm == Vec3{vx, vy, vz});
    const double wx = 4 * u(), wy = 50 + 5 * u(), wz = 6 * u();
    CHECK(body.w_WB == Vec3{wx, wy, wz});
  }
  CHECK(rejected > 0);  // or the test would not see whether points outside the ball are rejected
}

TEST_CASE("a random key that is absent draws nothing, and another seed gives other numbers") {
  const std::string grid = "count = [2, 1, 1]\npitch_m = [10, 10, 10]\n";
  const auto one = bodies_of_lattice(grid + "velocity_jitter_mps = [1, 1, 1]");
  const auto other = bodies_of_lattice(grid + "jitter_m = [1, 1, 1]\nseed = 1");
  for (const std::size_t n : {0U, 1U}) {
    // The default seed is 1, and both use the first six numbers.
    CHECK(Vec3{10.0 * static_cast<double>(n) + one[n].v_WBcm.x, one[n].v_WBcm.y, one[n].v_WBcm.z} ==
          other[n].p_WBo);
  }
  const auto third = bodies_of_lattice(grid + "jitter_m = [1, 1, 1]\nseed = 2");
  CHECK(third[0].p_WBo != other[0].p_WBo);
}

}  // namespace cradle
