// Scheme, drag and springs of a scene: what is read, and what is refused.
#include <catch2/catch.hpp>

#include "server/simulate.h"
#include "tests/unit/scene_helpers.h"

namespace cradle {
namespace {

const std::string kTwo =
    "[[body]]\nname = 'a'\nmass_kg = 1\n[[body]]\nname = 'b'\nkind = 'static'\n";

}  // namespace

TEST_CASE("a scene's scheme, drag and springs reach the world") {
  const Scene scene = scene_of(R"(
[world]
scheme = "rk4"
gravity_mps2 = [0, 0, 0]
[[body]]
name = "a"
mass_kg = 1
linear_drag_kgps = 0.5
quadratic_drag_kgpm = 0.25
angular_drag_kgm2ps = 0.125
[[body]]
name = "b"
mass_kg = 1
position_m = [3, 0, 0]
[[spring]]
body_a = "b"
body_b = "a"
point_a_m = [1, 2, 3]
point_b_m = [4, 5, 6]
stiffness_npm = 7
damping_nspm = 8
rest_length_m = 9
[[spring]]
body_a = "a"
[[lattice]]
count = [2, 1, 1]
pitch_m = [1, 1, 1]
[[lattice.body]]
mass_kg = 1
[[lattice.body]]
mass_kg = 1
linear_drag_kgps = 2
)");
  CHECK(scene.settings.scheme == "rk4");
  REQUIRE(scene.drags.size() == 4);
  CHECK(scene.drags[0] == Drag{0.5, 0.25, 0.125});
  CHECK(scene.drags[1] == Drag{});
  CHECK(scene.drags[3] == Drag{2, 0, 0});
  REQUIRE(scene.springs.size() == 2);
  CHECK(scene.springs[0].a == 1);
  CHECK(scene.springs[0].b == 0);
  CHECK(scene.springs[0].spring == Spring{{}, {}, {1, 2, 3}, {4, 5, 6}, 7, 8, 9});
  CHECK(!scene.springs[1].b);
  const SceneRun run(scene);
  CHECK(run.world().settings().scheme == "rk4");
  CHECK(run.world().spring_count() == 2);
}

TEST_CASE("springs and drag that cannot be are refused with their line") {
  using Catch::Matchers::StartsWith;
  const auto refusal = [](const std::string& text) { return scene_refusal(kTwo + text); };
  CHECK_THAT(refusal("linear_drag_kgps = 1"), StartsWith("x.toml:4: only a dynamic body has drag"));
  CHECK_THAT(scene_refusal("[[body]]\nmass_kg = 1\nangular_drag_kgm2ps = -1"),
             StartsWith("x.toml:3: angular_drag_kgm2ps: out of range"));
  CHECK_THAT(refusal("[[spring]]\nbody_a = 'c'"),
             StartsWith("x.toml:8: body_a: no [[body]] has the name \"c\""));
  CHECK_THAT(refusal("[[spring]]\nbody_a = ''"), StartsWith("x.toml:8: body_a: no [[body]]"));
  CHECK_THAT(refusal("[[spring]]\nbody_a = 'b'"), StartsWith("x.toml:7: needs a dynamic body"));
  CHECK_THAT(refusal("[[spring]]\nbody_a = 'a'\nbody_b = 'a'"),
             StartsWith("x.toml:9: body_b: is body_a"));
  CHECK_THAT(refusal("[[spring]]\nstiffness_npm = 1"), StartsWith("x.toml:7: body_a: is missing"));
  CHECK_THAT(refusal("[[spring]]\nbody_a = 'a'\nstiffness_npm = 1e19"),
             StartsWith("x.toml:9: stiffness_npm: out of range"));
  CHECK_THAT(refusal("[[spring]]\nbody_a = 'a'\ndamping_nspm = nan"),
             StartsWith("x.toml:9: damping_nspm: must be finite"));
  CHECK_THAT(refusal("[[spring]]\nbody_a = 'a'\npoint_b_m = [1e9, 0, 0]"),
             StartsWith("x.toml:9: point_b_m: out of range"));
  CHECK_THAT(scene_refusal("[world]\nscheme = 'euler'"),
             StartsWith("x.toml:2: scheme: \"euler\" is none of exact, explicit_euler"));
}

}  // namespace cradle
