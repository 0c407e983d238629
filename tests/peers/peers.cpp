// Bullet and ODE themselves: they get the scene as it is, and what they get wrong is seen.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/bench/side_by_side.h"
#include "tests/peers/libraries.h"

using namespace cradle;
using namespace cradle::bench;

namespace {

double error_of(const PeerLibrary& library, const char* which, const PeerSettings& settings = {}) {
  return run_peer(library, *find_case(which), scene_of(*find_case(which)), {}, settings).error;
}

/// Where the scene's bodies are after two seconds.
std::vector<BodyState> after_two_seconds(const PeerLibrary& library, const std::string& text) {
  const Scene scene = parse_scene(text, "scene");
  const auto peer = make_peer(library, scene, {});
  for (int tick = 0; tick < 120; ++tick) peer->step();
  std::vector<BodyState> states;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) states.push_back(peer->state(i));
  return states;
}

const char* const kBodies = R"(
    [[body]]
    shape = "sphere"
    radius_m = 0.5
    position_m = [-4, 0, 0.7]
    [[body]]
    shape = "box"
    half_extents_m = [0.5, 0.4, 0.3]
    position_m = [-2, 0, 0.5]
    [[body]]
    shape = "capsule"
    radius_m = 0.4
    half_length_m = 0.5
    rotation_rad = [0, 1.5707963267948966, 0]
    position_m = [0, 2, 0.6]
    [[body]]
    shape = "cylinder"
    radius_m = 0.5
    half_length_m = 0.4
    position_m = [2, 0, 0.6]
    [[body]]
    shape = "hull"
    points_m = [[-0.5, -0.5, -0.5], [0.5, -0.5, -0.5], [-0.5, 0.5, -0.5], [0.5, 0.5, -0.5],
                [-0.5, -0.5, 0.5], [0.5, -0.5, 0.5], [-0.5, 0.5, 0.5], [0.5, 0.5, 0.5]]
    position_m = [4, 0, 0.7]
    )";

}  // namespace

TEST_CASE("a peer's free fall has the error of its first order, by the check that ours has") {
  for (const PeerLibrary& library : libraries_here()) {
    INFO(library.name);
    // x += v dt after v += g dt leaves out g T dt / 2.
    CHECK(error_of(library, "A1") == Approx(9.81 * 10 / 120).epsilon(0.01));
    CHECK(error_of(library, "A1", {0, 4}) == Approx(9.81 * 10 / 480).epsilon(0.05));
  }
}

TEST_CASE("a peer with twice the gravity shows up") {
  for (PeerLibrary library : libraries_here()) {
    INFO(library.name);
    library.make = library.name == "ode"
                       ? +[](const WorldSettings& world, const PeerSettings& settings) {
                           WorldSettings wrong = world;
                           wrong.gravity_W.z *= 2;
                           return peer_libraries()[1].make(wrong, settings);
                         }
                       : +[](const WorldSettings& world, const PeerSettings& settings) {
                           WorldSettings wrong = world;
                           wrong.gravity_W.z *= 2;
                           return peer_libraries()[0].make(wrong, settings);
                         };
    CHECK(error_of(library, "A1") > 490);
    CHECK(error_of(library, "A4") > 0.3);
  }
}

TEST_CASE("a peer has the scene's masses, inertia, friction and restitution") {
  for (const PeerLibrary& library : libraries_here()) {
    INFO(library.name);
    CHECK(error_of(library, "A4") < 0.02);   // friction
    CHECK(error_of(library, "A5") < 1e-3);   // inertia of a sphere
    CHECK(error_of(library, "A3") < 0.3);    // restitution: the root of it would be 0.6 off
    CHECK(error_of(library, "A6b") < 0.05);  // a turned floor
    CHECK(error_of(library, "A2") < 1);      // inertia as given
    CHECK(error_of(library, "A2") > 0.1);    // Bullet and ODE are known to lose much
    CHECK(error_of(library, "A10") > 100);   // nobody asked for continuous collision
  }
}

TEST_CASE("a peer's iterations are those that it was told") {
  for (const PeerLibrary& library : libraries_here()) {
    INFO(library.name);
    CHECK(error_of(library, "A8b", {library.iterations, 1}) == error_of(library, "A8b"));
    CHECK(error_of(library, "A8b", {3 * library.iterations, 1}) != error_of(library, "A8b"));
  }
}

TEST_CASE("a peer's shapes lie on floors of every kind") {
  const char* const floors[] = {
      "[[body]]\nkind = \"static\"\nshape = \"half_space\"\n",
      "[[body]]\nkind = \"static\"\nshape = \"box\"\nhalf_extents_m = [9, 9, 2]\n"
      "position_m = [0, 0, -2]\n",
      "[[body]]\nkind = \"static\"\nshape = \"mesh\"\n"
      "points_m = [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]]\n"
      "triangles = [[0, 1, 2], [0, 2, 3]]\n"};
  const std::vector<double> heights{0.5, 0.3, 0.4, 0.4, 0.5};
  for (const PeerLibrary& library : libraries_here()) {
    for (const char* floor : floors) {
      INFO(library.name << " on\n" << floor);
      const auto states = after_two_seconds(library, std::string(floor) + kBodies);
      for (std::size_t i = 0; i < heights.size(); ++i) {
        INFO("body " << i);
        // Bullet's hulls are 4 cm larger all round.
        CHECK(states[i + 1].p_WBo.z == Approx(heights[i]).margin(0.045));
        CHECK(std::abs(states[i + 1].v_WBcm.z) < 0.05);
      }
    }
  }
}

TEST_CASE("what a peer has no shape for is refused") {
  for (const PeerLibrary& library : libraries_here()) {
    INFO(library.name);
    const Scene scene =
        parse_scene("[[body]]\nshape = \"ellipsoid\"\nhalf_extents_m = [1, 2, 3]\n", "ellipsoid");
    CHECK_THROWS_AS(make_peer(library, scene, {}), PeerError);
  }
}
