// What scene files say, and how wrong ones are refused. Keys and limits: tests/scenes/README.md.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "tests/unit/scene_helpers.h"

namespace cradle {
namespace {

/// The body of a scene that has one, of these lines.
BodySpec body_of(const std::string& lines) {
  const Scene scene = scene_of("[[body]]\n" + lines);
  REQUIRE(scene.bodies.size() == 1);
  return scene.bodies[0];
}

/// The wrench of a scene that has one, of these lines.
TimedWrench wrench_of(const std::string& lines) {
  const Scene scene = scene_of("[[body]]\nmass_kg = 1\n[[body.wrench]]\n" + lines);
  REQUIRE(scene.wrenches.size() == 1);
  return scene.wrenches[0];
}

/// Twice a quaternion's half angle about z, in the range of atan2.
double angle_about_z(const Quat& q) { return 2 * std::atan2(q.z, q.w); }

}  // namespace

TEST_CASE("an empty scene is a world of default settings without bodies") {
  const Scene scene = scene_of("");
  CHECK(scene.bodies.empty());
  CHECK(scene.wrenches.empty());
  CHECK(scene.settings.rate_hz == WorldSettings().rate_hz);
  CHECK(scene.settings.solver == WorldSettings().solver);
  CHECK(scene.name == "x.toml");
}

TEST_CASE("the settings of the world are read") {
  const Scene scene = scene_of(
      "[world]\nrate_hz = 240.5\nsub_steps = 7\ngravity_mps2 = [1, 2.5, -3]\nsolver = 'soft'\n"
      "broad_phase = 'fcl'\n");
  CHECK(scene.settings.rate_hz == 240.5);
  CHECK(scene.settings.sub_steps == 7);
  CHECK(scene.settings.gravity_W == Vec3{1, 2.5, -3});
  CHECK(scene.settings.solver == "soft");
  CHECK(scene.settings.broad_phase == "fcl");
  for (const std::string solver : {"newton", "accurate", "hybrid", "lcp", "impulse", "penalty"}) {
    CHECK(scene_of("[world]\nsolver = '" + solver + "'\n").settings.solver == solver);
  }
}

TEST_CASE("every key of a body is read") {
  BodySpec expected;
  expected.name = "crate";
  expected.shape = Shape::box({1, 2, 3});
  expected.mass_kg = 4;
  expected.inertia_kgm2 = {5, 6, 7};
  expected.material = {0.25, 0.75, 0.01, 0.02, CombineRule::minimum, CombineRule::average};
  expected.p_WBo = {8, 9, 10};
  expected.q_WB = {0.5, -0.5, 0.5, -0.5};
  expected.v_WBcm = {11, 12, 13};
  expected.w_WB = {14, 15, 16};
  CHECK(body_of(R"(
name = "crate"
kind = "dynamic"
shape = "box"
half_extents_m = [1, 2, 3]
mass_kg = 4
inertia_kgm2 = [5, 6, 7]
friction = 0.25
restitution = 0.75
rolling_friction_m = 0.01
torsional_friction_m = 0.02
friction_rule = "minimum"
restitution_rule = "average"
position_m = [8, 9, 10]
orientation_wxyz = [0.5, -0.5, 0.5, -0.5]
velocity_mps = [11, 12, 13]
angular_velocity_radps = [14, 15, 16]
)") == expected);
}

TEST_CASE("every shape and every kind of body has its word") {
  CHECK(body_of("mass_kg = 1").shape == Shape::none());
  CHECK(body_of("mass_kg = 1\nshape = 'none'").shape == Shape::none());
  CHECK(body_of("shape = 'sphere'\nradius_m = 2").shape == Shape::sphere(2));
  CHECK(body_of("shape = 'box'\nhalf_extents_m = [1, 2, 3]").shape == Shape::box({1, 2, 3}));
  CHECK(body_of("kind = 'static'\nshape = 'half_space'").shape == Shape::half_space());
  CHECK(body_of("kind = 'static'").kind == BodyKind::fixed);
  CHECK(body_of("kind = 'kinematic'").kind == BodyKind::kinematic);
  CHECK(body_of("kind = 'dynamic'\nmass_kg = 1").kind == BodyKind::dynamic);
}

TEST_CASE("a density stands instead of a mass") {
  const BodySpec body = body_of("shape = 'sphere'\nradius_m = 1\ndensity_kgpm3 = 7800");
  CHECK(body.mass_kg == 0);
  CHECK(body.density_kgpm3 == 7800);
}

TEST_CASE("a rotation vector becomes the quaternion of its axis and angle") {
  // Independent of the series: sine and cosine of libm.
  for (const double angle : {0.0, 1e-9, 0.1, 1.0, 1.5707963267948966, 3.1, 6.2831853071795862}) {
    CAPTURE(angle);
    char line[80];
    std::snprintf(line, sizeof line, "mass_kg = 1\nrotation_rad = [0, 0, %.17g]", angle);
    const Quat q = body_of(line).q_WB;
    CHECK(q.w == Approx(std::cos(angle / 2)).margin(1e-14));
    CHECK(q.z == Approx(std::sin(angle / 2)).margin(1e-14));
    CHECK(q.x == 0);
    CHECK(q.y == 0);
  }
  const Quat q = body_of("mass_kg = 1\nrotation_rad = [2, -1, 2]").q_WB;  // length 3
  CHECK(q.w == Approx(std::cos(1.5)).margin(1e-14));
  CHECK(q.x == Approx(std::sin(1.5) * 2 / 3).margin(1e-14));
  CHECK(q.y == Approx(std::sin(1.5) * -1 / 3).margin(1e-14));
  CHECK(q.z == Approx(std::sin(1.5) * 2 / 3).margin(1e-14));
  CHECK(angle_about_z(body_of("mass_kg = 1\nrotation_rad = [0, 0, -1]").q_WB) == Approx(-1));
}

TEST_CASE("every key of a wrench is read, and every word it can have") {
  const TimedWrench timed = wrench_of(
      "tick = 5\nquantity = 'impulse'\nframe = 'body'\npoint = 'world_point'\n"
      "point_m = [1, 2, 3]\nvalue = [4, 5, 6]\nduration = 'ticks'\nticks = 7");
  Wrench expected;
  expected.quantity = WrenchQuantity::impulse;
  expected.frame = WrenchFrame::body;
  expected.point_kind = WrenchPoint::world_point;
  expected.point = {1, 2, 3};
  expected.value = {4, 5, 6};
  expected.duration = WrenchDuration::ticks;
  expected.ticks = 7;
  CHECK(timed.tick == 5);
  CHECK(timed.wrench == expected);

  const auto quantity = [](const std::string& word) {
    return wrench_of("value = [1, 0, 0]\nquantity = '" + word + "'").wrench.quantity;
  };
  CHECK(quantity("force") == WrenchQuantity::force);
  CHECK(quantity("torque") == WrenchQuantity::torque);
  CHECK(quantity("angular_impulse") == WrenchQuantity::angular_impulse);
  CHECK(quantity("acceleration") == WrenchQuantity::acceleration);
  CHECK(wrench_of("value = [1, 0, 0]\nframe = 'world'").wrench.frame == WrenchFrame::world);
  CHECK(wrench_of("value = [1, 0, 0]\npoint = 'body_point'").wrench.point_kind ==
        WrenchPoint::body_point);
  CHECK(wrench_of("value = [1, 0, 0]\nduration = 'until_cleared'").wrench.duration ==
        WrenchDuration::until_cleared);
}

TEST_CASE("wrenches come in the order of their ticks and know their bodies") {
  const Scene scene = scene_of(R"(
[[body]]
kind = "static"
[[body]]
mass_kg = 1
[[body.wrench]]
tick = 9
value = [1, 0, 0]
[[body.wrench]]
tick = 2
value = [2, 0, 0]
[[body]]
mass_kg = 1
[[body.wrench]]
tick = 2
value = [3, 0, 0]
)");
  REQUIRE(scene.wrenches.size() == 3);
  CHECK(scene.wrenches[0].wrench.value.x == 2);
  CHECK(scene.wrenches[0].body == 1);
  CHECK(scene.wrenches[1].wrench.value.x == 3);  // of equal ticks: the order of the file
  CHECK(scene.wrenches[1].body == 2);
  CHECK(scene.wrenches[2].tick == 9);
}

TEST_CASE("a wrong scene is refused with file, line and reason") {
  struct Case {
    std::string text;
    std::string refusal;  // begins like this
  };
  const std::string sphere = "[[body]]\nshape = 'sphere'\nradius_m = 1\n";    // lines 1 to 3
  const std::string point = "[[body]]\nmass_kg = 1\n";                        // lines 1 and 2
  const std::string pushed = point + "[[body.wrench]]\nvalue = [1, 0, 0]\n";  // lines 1 to 4
  const std::string cubes = "[[lattice]]\ncount = [2, 2, 2]\npitch_m = [1, 1, 1]\n";  // 1 to 3
  const std::string cube = "[[lattice.body]]\nmass_kg = 1\n";
  const Case cases[] = {
      // syntax
      {"[world]\nrate_hz = = 1", "x.toml:2: "},
      {"[world\n", "x.toml:1: "},
      {"[world]\nrate_hz = 1\nrate_hz = 2", "x.toml:3: "},
      // unknown keys, and the nearest there is
      {"[world]\n\nrate = 1", "x.toml:3: unknown key 'rate'; did you mean 'rate_hz'?"},
      {"[word]\n", "x.toml:1: unknown key 'word'; did you mean 'world'?"},
      {sphere + "masskg = 1", "x.toml:4: unknown key 'masskg'; did you mean 'mass_kg'?"},
      {"[[body]]\nshape = 'sphere'\nradius = 1",
       "x.toml:3: unknown key 'radius'; did you mean 'radius_m'?"},
      {sphere + "colour = 'red'", "x.toml:4: unknown key 'colour'; known here: name, kind, "},
      {point + "restitton = 1", "x.toml:3: unknown key 'restitton'; did you mean 'restitution'?"},
      {pushed + "valeu = 1", "x.toml:5: unknown key 'valeu'; did you mean 'value'?"},
      {cubes + "counts = 1\n" + cube, "x.toml:4: unknown key 'counts'; did you mean 'count'?"},
      {point + "b_ = 1\na_ = 1", "x.toml:3: unknown key 'b_'"},  // the first in the file
      // wrong types
      {"world = 3", "x.toml:1: world: must be a table, [world], not of type integer"},
      {"[body]\nmass_kg = 1", "x.toml:1: body: must be tables, [[body]], not of type table"},
      {"body = [1]", "x.toml:1: body: must be tables, [[body]], not of type integer"},
      {"[world]\nrate_hz = '60'", "x.toml:2: rate_hz: must be a number, not of type string"},
      {"[world]\nrate_hz = true", "x.toml:2: rate_hz: must be a number, not of type boolean"},
      {"[world]\nrate_hz = 9007199254740993", "x.toml:2: rate_hz: must be a number"},
      {"[world]\nsub_steps = 4.0",
       "x.toml:2: sub_steps: must be an integer, not of type floating-point"},
      {"[world]\nsub_steps = 4294967300", "x.toml:2: sub_steps: out of range"},
      {"[world]\ngravity_mps2 = -9.81", "x.toml:2: gravity_mps2: must be 3 numbers, not of type"},
      {"[world]\ngravity_mps2 = [0,\n0]", "x.toml:2: gravity_mps2: must be 3 numbers"},
      {"[world]\ngravity_mps2 = [0, 0, 0, 0]", "x.toml:2: gravity_mps2: must be 3 numbers"},
      {"[world]\ngravity_mps2 = [0,\n0,\n'x']", "x.toml:4: gravity_mps2: must be numbers, not"},
      {sphere + "name = 5", "x.toml:4: name: must be a string, not of type integer"},
      {cubes + "random_orientation = 1\n" + cube,
       "x.toml:4: random_orientation: must be true or false, not of type integer"},
      {"[[lattice]]\ncount = [1, 2, 3.5]", "x.toml:2: count: must be integers, not of type float"},
      // settings
      {"[world]\nrate_hz = 0.5", "x.toml:2: rate_hz: out of range"},
      {"[world]\nrate_hz = 10001", "x.toml:2: rate_hz: out of range"},
      {"[world]\nrate_hz = nan", "x.toml:2: rate_hz: out of range"},
      {"[world]\nsub_steps = 0", "x.toml:2: sub_steps: out of range"},
      {"[world]\nsub_steps = 65", "x.toml:2: sub_steps: out of range"},
      {"[world]\ngravity_mps2 = [0, 0, 1e5]", "x.toml:2: gravity_mps2: out of range"},
      {"[world]\ngravity_mps2 = [0, 0, inf]", "x.toml:2: gravity_mps2: must be finite"},
      {"[world]\nsolver = 'magic'", "x.toml:2: solver: \"magic\" is none of hybrid"},
      // bodies
      {"[[body]]\nkind = 'solid'",
       "x.toml:2: kind: \"solid\" is none of static, kinematic, dynamic"},
      {"[[body]]\nmass_kg = 1\nfriction_rule = 'default'",
       "x.toml:3: friction_rule: \"default\" is none of average, geometric_mean, minimum"},
      {"[[body]]\nmass_kg = 1\nrestitution_rule = 'most'",
       "x.toml:3: restitution_rule: \"most\" is none of average, geometric_mean, minimum"},
      {"[[body]]\nshape = 'ball'", "x.toml:2: shape: \"ball\" is none of none, sphere, box"},
      {"[[body]]\n\nshape = 'sphere'", "x.toml:3: shape: needs radius_m"},
      {"[[body]]\nshape = 'box'", "x.toml:2: shape: needs half_extents_m"},
      {sphere + "half_extents_m = [1, 1, 1]", "x.toml:4: half_extents_m: this shape has none"},
      {point + "radius_m = 1", "x.toml:3: radius_m: this shape has none"},
      {"[[body]]\nshape = 'sphere'\nradius_m = 0", "x.toml:3: radius_m: sizes must be positive"},
      {"[[body]]\nshape = 'sphere'\nradius_m = 1e7", "x.toml:3: radius_m: out of range"},
      {"[[body]]\nshape = 'box'\nhalf_extents_m = [1, -1, 1]", "x.toml:3: half_extents_m: sizes"},
      {"[[body]]\nshape = 'half_space'\nmass_kg = 1", "x.toml:2: shape: "},
      {sphere + "mass_kg = 1\ndensity_kgpm3 = 1", "x.toml:5: density_kgpm3: mass_kg is given, too"},
      {"[[body]]\n", "x.toml:1: mass_kg: a dynamic body needs a mass above 0 (body 1)"},
      {sphere + "mass_kg = 0", "x.toml:4: mass_kg: must be above 0 (body 1)"},
      {sphere + "mass_kg = -1", "x.toml:4: mass_kg: must be above 0 (body 1)"},
      {sphere + "mass_kg = 1e16", "x.toml:4: mass_kg: out of range"},
      {sphere + "density_kgpm3 = 0", "x.toml:4: density_kgpm3: must be above 0 (body 1)"},
      {sphere + "density_kgpm3 = 1e20", "x.toml:4: density_kgpm3: out of range"},
      {point + "inertia_kgm2 = [1, 1, 3]",
       "x.toml:3: inertia_kgm2: no rigid body has these moments"},
      {point + "inertia_kgm2 = [1, 1, nan]", "x.toml:3: inertia_kgm2: must be finite"},
      {point + "name = 'top'\ninertia_kgm2 = [1, 1, 3]",
       "x.toml:4: inertia_kgm2: no rigid body has these moments: the principal ones must be above "
       "0, "
       "and none larger than the sum of the others (body \"top\")"},
      {point + "inertia_kgm2 = [-1, 1, 1]", "x.toml:3: inertia_kgm2: no rigid body"},
      {point + "inertia_kgm2 = [1, 1, 1]\ninertia_products_kgm2 = [0.9, 0, 0]",
       "x.toml:4: inertia_products_kgm2: no rigid body has these moments"},
      {point + "inertia_products_kgm2 = [0.1, 0, 0]",
       "x.toml:3: inertia_products_kgm2: needs inertia_kgm2"},
      {point + "inertia_kgm2 = [1, 1, 1]\ninertia_products_kgm2 = [nan, 0, 0]",
       "x.toml:3: inertia_kgm2: must be finite"},
      {point + "centre_of_mass_m = [0, 0, 1e7]", "x.toml:3: centre_of_mass_m: out of range"},
      {point + "friction = -0.1", "x.toml:3: friction: out of range"},
      {point + "restitution = 1.1", "x.toml:3: restitution: out of range"},
      {point + "rolling_friction_m = -1e-9", "x.toml:3: rolling_friction_m: out of range"},
      {point + "torsional_friction_m = 1.1e6", "x.toml:3: torsional_friction_m: out of range"},
      {point + "position_m = [0, 0, 1e9]", "x.toml:3: position_m: out of range"},
      {point + "position_m = [0, 0, nan]", "x.toml:3: position_m: must be finite"},
      {point + "orientation_wxyz = [0, 0, 0, 0]", "x.toml:3: orientation_wxyz: a quaternion"},
      {point + "rotation_rad = [0, 0, 6.4]", "x.toml:3: rotation_rad: must be one turn at most"},
      {point + "rotation_rad = [0, nan, 0]", "x.toml:3: rotation_rad: must be one turn at most"},
      {point + "rotation_rad = [0, 0, 1]\norientation_wxyz = [1, 0, 0, 0]",
       "x.toml:3: rotation_rad: orientation_wxyz is given, too"},
      {point + "velocity_mps = [1e7, 0, 0]", "x.toml:3: velocity_mps: out of range"},
      {point + "angular_velocity_radps = [1e6, 0, 0]",
       "x.toml:3: angular_velocity_radps: out of range"},
      {point + "name = '12345678901234567890123456789012'", "x.toml:3: name: must be UTF-8"},
      {point + "name = \"a\\nb\"", "x.toml:3: name: must be UTF-8 without control characters"},
      {point + "name = 'a'\n" + point + "name = 'a'",
       "x.toml:6: name: \"a\" is the name of another body already"},
      // wrenches
      {point + "[[body.wrench]]\n", "x.toml:3: value: is missing"},
      {pushed + "tick = 0", "x.toml:5: tick: out of range"},
      {pushed + "quantity = 'power'", "x.toml:5: quantity: \"power\" is none of force, torque"},
      {pushed + "frame = 'moon'", "x.toml:5: frame: \"moon\" is none of world, body"},
      {pushed + "point = 'edge'", "x.toml:5: point: \"edge\" is none of centre_of_mass"},
      {pushed + "duration = 'long'", "x.toml:5: duration: \"long\" is none of this_tick, ticks"},
      {pushed + "point_m = [1, 0, 0]", "x.toml:5: point_m: contradicts the keys before it"},
      {pushed + "quantity = 'torque'\npoint = 'body_point'",
       "x.toml:6: point: contradicts the keys before it"},
      {pushed + "ticks = 3", "x.toml:5: ticks: contradicts the keys before it"},
      {pushed + "duration = 'ticks'", "x.toml:5: duration: contradicts the keys before it"},
      {pushed + "duration = 'ticks'\nticks = 0", "x.toml:6: ticks: contradicts the keys"},
      {pushed + "duration = 'ticks'\nticks = 9007199254740992", "x.toml:6: ticks: out of range"},
      {point + "[[body.wrench]]\nvalue = [1e19, 0, 0]", "x.toml:4: value: out of range"},
      {"[[body]]\nkind = 'static'\n[[body.wrench]]\nvalue = [1, 0, 0]",
       "x.toml:3: only a dynamic body can be pushed"},
      // lattices
      {"[[lattice]]\npitch_m = [1, 1, 1]\n" + cube, "x.toml:1: count: is missing"},
      {"[[lattice]]\ncount = [1, 1, 1]\n" + cube, "x.toml:1: pitch_m: is missing"},
      {cubes, "x.toml:1: needs a [[lattice.body]]"},
      {"[[lattice]]\ncount = [1, 0, 1]", "x.toml:2: count: out of range"},
      {"[[lattice]]\ncount = [1000, 1000, 2]", "x.toml:2: count: too many bodies"},
      {"[[lattice]]\ncount = [4294967296, 4294967296, 4294967296]", "x.toml:2: count: too many"},
      {cubes + "taper = [2, 0]\n" + cube, "x.toml:4: taper: must leave a body in the highest"},
      {"[[lattice]]\ncount = [4, 1, 3]\npitch_m = [1, 1, 1]\ntaper = [2, 0]\n" + cube,
       "x.toml:4: taper: must leave a body in the highest"},
      {cubes + "taper = [0, -1]\n" + cube, "x.toml:4: taper: must leave a body in the highest"},
      {"[[lattice]]\ncount = [4, 1, 3]\npitch_m = [1, 1, 1]\ntaper = [9223372036854775807, 0]\n" +
           cube,
       "x.toml:4: taper: must leave a body in the highest"},
      {cubes + "seed = -1\n" + cube, "x.toml:4: seed: out of range"},
      {cubes + cube + "name = 'n'", "x.toml:6: name: bodies of a lattice have none"},
      {cubes + cube + "friction = -1", "x.toml:6: friction: out of range"},
      {"\n[[lattice]]\ncount = [1, 1, 3]\npitch_m = [0, 0, 6e7]\n" + cube,
       "x.toml:2: its body number 2: out of range"},
      {cubes + "jitter_m = [nan, 0, 0]\n" + cube, "x.toml:1: its body number 0: must be finite"},
  };
  for (const Case& c : cases) {
    CAPTURE(c.text);
    CHECK_THAT(scene_refusal(c.text), Catch::Matchers::StartsWith(c.refusal));
  }
}

TEST_CASE("a body that would be one too many is refused") {
  const std::string many = R"(
[[lattice]]
count = [1000, 1000, 1]
pitch_m = [1, 1, 1]
  [[lattice.body]]
  kind = "static"
)";
  CHECK(scene_refusal(many) == "");
  CHECK_THAT(scene_refusal("[[body]]\nkind = 'static'\n" + many),
             Catch::Matchers::StartsWith("x.toml:4: too many bodies"));
}

TEST_CASE("a scene file that is not there, or is a folder, is reported as such") {
  CHECK_THROWS_AS(load_scene(CRADLE_SCENE_DIR "/no-such-scene.toml"),
                  std::filesystem::filesystem_error);
  CHECK_THROWS_AS(load_scene(CRADLE_SCENE_DIR), std::filesystem::filesystem_error);
}

TEST_CASE("every scene of the folder is one that a world accepts") {
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(CRADLE_SCENE_DIR)) {
    if (entry.path().extension() != ".toml") continue;
    CAPTURE(entry.path().filename().string());
    CHECK_NOTHROW(load_scene(entry.path().string()));
    ++scenes;
  }
  CHECK(scenes >= 5);  // those this file and simulate.cpp name
}

}  // namespace cradle
