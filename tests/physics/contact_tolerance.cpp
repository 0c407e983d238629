// The error is stated, the sub-steps are found: how far contacts sink in, against what is foretold.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <functional>
#include <string>
#include <utility>

#include "server/dynamics/contact/demands.h"
#include "server/dynamics/contact/islands.h"
#include "server/dynamics/contact/softness.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

/// Bodies that rest on each other, and by how much they should be apart along z.
struct Resting {
  BodyId below, above;
  double distance_m;
};

/// A scene, and what rests on what in it.
struct ToleranceScene {
  std::string name;
  std::function<std::vector<Resting>(World&)> build;
};

BodyId add_ground(World& world) { return add(world, ground()); }

/// From the ground up, each of its half height and mass; at rest.
std::vector<Resting> tower(World& world, const std::vector<std::pair<double, double>>& bricks) {
  std::vector<Resting> contacts;
  BodyId below = add_ground(world);
  double top = 0, half_below = 0;
  for (const auto& [half, mass] : bricks) {
    BodySpec spec = brick({0.5, 0.5, half}, {0, 0, top + half});
    spec.mass_kg = mass;
    const BodyId above = add(world, spec);
    contacts.push_back({below, above, half_below + half});
    top += 2 * half;
    half_below = half;
    below = above;
  }
  return contacts;
}

std::vector<Resting> alone(World& world, Shape shape, double height_m) {
  const BodyId below = add_ground(world);
  BodySpec spec = ball(0.5, {0, 0, height_m});
  spec.shape = std::move(shape);
  return {{below, add(world, spec), height_m}};
}

/// Rows of cubes with gaps, each on two of the row below.
std::vector<Resting> pyramid(World& world, int rows) {
  std::vector<Resting> contacts;
  std::vector<BodyId> below(static_cast<std::size_t>(rows), add_ground(world));
  for (int row = 0; row < rows; ++row) {
    std::vector<BodyId> these;
    for (int i = 0; i < rows - row; ++i) {
      these.push_back(add(world, brick({0.5, 0.5, 0.5}, {1.05 * (i + 0.5 * row), 0, row + 0.5})));
      contacts.push_back({below[static_cast<std::size_t>(i)], these.back(), row == 0 ? 0.5 : 1});
    }
    below = these;
  }
  return contacts;
}

const std::vector<ToleranceScene>& scenes() {
  using Bricks = std::vector<std::pair<double, double>>;
  static const std::vector<ToleranceScene> all{
      {"a cube",
       [](World& w) {
         return tower(w, {{0.5, 1}});
       }},
      {"three cubes",
       [](World& w) {
         return tower(w, Bricks(3, {0.5, 1}));
       }},
      {"ten cubes",
       [](World& w) {
         return tower(w, Bricks(10, {0.5, 1}));
       }},
      {"twenty cubes",
       [](World& w) {
         return tower(w, Bricks(20, {0.5, 1}));
       }},
      {"ten kilogrammes on one",
       [](World& w) {
         return tower(w, {{0.5, 1}, {0.5, 10}});
       }},
      {"a hundred on one",
       [](World& w) {
         return tower(w, {{0.5, 1}, {0.5, 100}});
       }},
      {"a plate on bricks",
       [](World& w) {
         return tower(w, {{0.2, 2}, {0.3, 3}, {0.05, 20}});
       }},
      {"a ball", [](World& w) { return alone(w, Shape::sphere(0.5), 0.5); }},
      {"a cylinder", [](World& w) { return alone(w, Shape::cylinder(0.5, 0.3), 0.3); }},
      {"a pyramid", [](World& w) { return pyramid(w, 6); }},
  };
  return all;
}

struct Sag {
  double expected_m, measured_m;
  int sub_steps;
};

/// All sink in by what soft steps are told to allow; also what lies still.
WorldSettings soft_settings() {
  WorldSettings how = settings();
  how.solver = "soft";
  return how;
}

Sag rest(const ToleranceScene& scene, double tolerance_m, const std::string& solver) {
  WorldSettings how = settings();
  how.solver = solver;
  how.contact_tolerance_m = tolerance_m;
  World world(how);
  const std::vector<Resting> contacts = scene.build(world);
  steps(world, 600);
  const StepReport report = world.step();
  double most = 0;
  for (const Resting& c : contacts) {
    const double apart = state(world, c.above).p_WBo.z - state(world, c.below).p_WBo.z;
    most = std::max(most, c.distance_m - apart);
  }
  return {report.sag_expected_m, most, report.sub_steps_max};
}

}  // namespace

TEST_CASE("contacts sink in as far as foretold, and no farther than allowed") {
  const std::string solver = GENERATE("soft", "hybrid", "newton");
  for (const double tolerance : {5e-4, 5e-3, 1e-4}) {
    for (const ToleranceScene& scene : scenes()) {
      const Sag outcome = rest(scene, tolerance, solver);
      INFO(solver << ": " << scene.name << ", " << 1e3 * tolerance << " mm allowed: "
                  << 1e3 * outcome.expected_m << " mm expected, " << 1e3 * outcome.measured_m
                  << " mm measured, " << outcome.sub_steps << " sub-steps");
      CHECK(outcome.measured_m == Approx(outcome.expected_m).epsilon(0.2));
      if (outcome.sub_steps < 64) CHECK(outcome.measured_m <= 1.01 * tolerance);
    }
  }
}

TEST_CASE("a load asks for sub-steps as its square root, and for more where less is allowed") {
  const auto sub_steps = [](double mass, double tolerance) {
    return rest({"",
                 [mass](World& w) {
                   return tower(w, {{0.5, 1}, {0.5, mass}});
                 }},
                tolerance, "soft")
        .sub_steps;
  };
  // n = dt / (2 pi 0.177) sqrt(a / tolerance), with a = 101 g: 0.0150 s * sqrt(991 / 5e-4) = 21.1
  CHECK(sub_steps(100, 5e-4) == 24);
  CHECK(sub_steps(400, 5e-4) == 48);     // 42.1
  CHECK(sub_steps(100, 2e-3) == 12);     // 10.5
  CHECK(sub_steps(1, 5e-4) == 4);        // 2.9: there are never less
  CHECK(sub_steps(10'000, 5e-4) == 64);  // 211: nor more
}

TEST_CASE("a few heavily loaded contacts of many are preloaded instead") {
  // 60 cubes on a plank, and one that carries 63 times its mass. By sub-steps alone: 0.0150 s *
  // sqrt(64 g / 5e-4) = 16.8, so 20 with a tenth of the load in reserve. A third of that is enough.
  World world(soft_settings());
  add_ground(world);
  BodySpec plank = brick({20, 10, 0.1}, {0, 0, 0.1});
  plank.mass_kg = 1000;
  const BodyId below = add(world, plank);
  for (int i = 0; i < 60; ++i) {
    add(world, brick({0.5, 0.5, 0.5}, {3.0 * (i % 10) - 13, 3.0 * (i / 10) - 8, 0.7}));
  }
  const BodyId cube = add(world, brick({0.5, 0.5, 0.5}, {17, 0, 0.7}));
  BodySpec heavy = brick({0.5, 0.5, 0.5}, {17, 0, 1.7});
  heavy.mass_kg = 63;
  const BodyId above = add(world, heavy);
  steps(world, 600);
  const StepReport report = world.step();
  const double sag = std::max(0.6 - state(world, cube).p_WBo.z + state(world, below).p_WBo.z,
                              1 - state(world, above).p_WBo.z + state(world, cube).p_WBo.z);
  CAPTURE(sag, report.sag_expected_m);
  CHECK(report.islands == 1);
  CHECK(report.sub_steps_max == 7);
  CHECK(sag <= 1.01 * 5e-4);
  CHECK(sag == Approx(report.sag_expected_m).epsilon(0.2));
}

namespace {

/// 132 plates on three balls or bricks each, on a plank on ice, that all move alike: the sub-steps
/// and the deepest sag, m, after five seconds.
std::pair<int, double> sub_steps_and_sag(bool on_balls, double speed) {
  World world(soft_settings());
  BodySpec ice = ground();
  ice.material.friction = 0;
  add(world, ice);
  BodySpec plank = brick({40, 32, 0.1}, {0, 0, 0.1}, {speed, 0, 0});
  plank.mass_kg = 1e5;
  const BodyId below = add(world, plank);
  std::vector<std::pair<BodyId, BodyId>> feet;
  for (int i = 0; i < 132; ++i) {
    const double x = 5.0 * (i % 12) - 28, y = 5.0 * (i / 12) - 25;
    std::vector<BodyId> three;
    for (const auto& [dx, dy] : {std::pair{-1.0, -0.6}, {1.0, -0.6}, {0.0, 1.2}}) {
      const Vec3 at{x + dx, y + dy, 0.7};
      BodySpec foot = on_balls ? ball(0.5, at) : brick({0.5, 0.5, 0.5}, at);
      foot.v_WBcm = {speed, 0, 0};
      three.push_back(add(world, foot));
    }
    BodySpec plate = brick({2, 2, 0.2}, {x, y, 1.4}, {speed, 0, 0});
    plate.mass_kg = i % 5 == 0 ? 3 * 36 : 3;
    const BodyId above = add(world, plate);
    for (const BodyId foot : three) feet.emplace_back(foot, above);
  }
  steps(world, 300);
  const StepReport report = world.step();
  CHECK(report.islands == 1);
  double sag = 0;
  for (const auto& [foot, above] : feet) {
    sag = std::max({sag, 0.6 - state(world, foot).p_WBo.z + state(world, below).p_WBo.z,
                    0.7 - state(world, above).p_WBo.z + state(world, foot).p_WBo.z});
  }
  return {report.sub_steps_max, sag};
}

}  // namespace

TEST_CASE("of many single points that move one in three may be preloaded") {
  // 132 plates: 792 contacts and that of the plank with the ground. 27 plates press each foot by a
  // load of 37 g in sum: 162 contacts. By sub-steps alone 0.0150 s * sqrt(37 g / 5e-4) = 12.8, so
  // 14 with a tenth of the load in reserve; a third of that is enough, as 793 / 8 and (792 - 500) /
  // 4 are excused, 172. Of bricks instead of balls, which may be a tower's, and of what is at rest,
  // 99 are.
  const auto check = [](bool on_balls, double speed, int sub_steps) {
    const auto [taken, sag] = sub_steps_and_sag(on_balls, speed);
    CAPTURE(on_balls, speed, sag);
    CHECK(taken == sub_steps);
    CHECK(sag <= 1.01 * 5e-4);
  };
  check(true, 0.05, 5);
  check(false, 0.05, 14);
  check(true, 0, 14);
}

TEST_CASE("a large heap in turmoil takes three in five of its sub-steps, and sinks in no deeper") {
  // Bricks that slide on a plank without friction, faster than a tick's fall or slower. Each is
  // to sink in by g / omega^2, with omega of four sub-steps, whatever is taken.
  const auto check = [](int bricks, double speed, int sub_steps) {
    CAPTURE(bricks, speed);
    World world(soft_settings());
    add(world, ground());
    BodySpec plank = brick({40, 32, 0.1}, {0, 0, 0.1});
    plank.mass_kg = 1e5;
    plank.material.friction = 0;
    const BodyId below = add(world, plank);
    std::vector<BodyId> above;
    for (int i = 0; i < bricks; ++i) {
      const Vec3 at{1.5 * (i % 26) - 20, 2.0 * (i / 26) - 20, 0.7};
      above.push_back(add(world, brick({0.5, 0.5, 0.5}, at, {speed, 0, 0})));
    }
    steps(world, 150);
    const StepReport report = world.step();
    const double law = give_of(4, 1.0 / 60) * kGravity * (1 + 1.0 / 1e5);
    double least = 1, most = 0;
    for (const BodyId one : above) {
      const double sag = 0.6 - state(world, one).p_WBo.z + state(world, below).p_WBo.z;
      least = std::min(least, sag);
      most = std::max(most, sag);
    }
    CHECK(least == Approx(law).epsilon(0.02));
    CHECK(most == Approx(law).epsilon(0.02));
    CHECK(report.islands == 1);
    CHECK(report.body_sub_steps == sub_steps * (bricks + 1));
    CHECK(report.sub_steps_max == sub_steps);
    REQUIRE(world.sub_step_choices().size() == 1);
    CHECK(world.sub_step_choices().front().sub_steps == sub_steps);
  };
  check(520, 0.2, 3);
  check(520, 0.13, 4);
  check(480, 0.2, 4);
}

TEST_CASE("a large wall that has fallen by 2 cm does not rock, on what moves, either") {
  // With three in five of its sub-steps it rocked for good, by 4 cm/s in the mean: whether it is in
  // turmoil goes by what its cubes move beside each other.
  const double speed = GENERATE(0.0, 0.05, 2.0);
  World world(soft_settings());
  BodySpec platform = brick({40, 5, 0.5}, {0, 0, -0.52}, {speed, 0, 0});
  platform.kind = BodyKind::kinematic;
  add(world, platform);
  std::vector<BodyId> cubes;
  for (int row = 0; row < 30; ++row) {
    for (int k = 0; k < 30 - row; ++k) {
      const double x = 1.02 * (k - 0.5 * (29 - row));
      cubes.push_back(add(world, brick({0.5, 0.5, 0.5}, {x, 0, 0.5 + row}, {speed, 0, 0})));
    }
  }
  steps(world, 400);
  double mean = 0;
  for (const BodyId cube : cubes) {
    mean += norm(state(world, cube).v_WBcm - Vec3{speed, 0, 0}) / static_cast<double>(cubes.size());
  }
  CAPTURE(speed, mean);
  CHECK(mean < 5e-3);
}

TEST_CASE("sub-steps are those that all contacts ask for but the few that may be preloaded") {
  constexpr std::size_t k4 = 0, k20 = 9;
  REQUIRE(kSubSteps[k4] == 4);
  REQUIRE(kSubSteps[k20] == 20);
  // Of 1000 contacts some ask for 20: of all, and of those that are single points.
  const auto sub_steps = [](int asking, int points, int asking_points, int least = 4) {
    Demands demands{}, of_points{};
    demands[k20] = asking;
    demands[k4] = 1000 - asking;
    of_points[k20] = asking_points;
    of_points[k4] = points - asking_points;
    return answer_to(demands, of_points, least).stiff_as;
  };
  CHECK(sub_steps(2, 0, 0) == 4);
  CHECK(sub_steps(3, 0, 0) == 7);  // one in eight
  CHECK(sub_steps(125, 0, 0) == 7);
  CHECK(sub_steps(126, 0, 0) == 20);
  CHECK(sub_steps(126, 503, 503 - 377) == 20);  // so many points beyond 500 that one more may
  CHECK(sub_steps(126, 504, 126) == 7);
  CHECK(sub_steps(225, 900, 225) == 7);  // 125 and 100
  CHECK(sub_steps(226, 900, 226) == 20);
  CHECK(sub_steps(225, 900, 100) == 7);
  CHECK(sub_steps(225, 900, 99) == 20);  // others are not excused instead of points
  CHECK(sub_steps(3, 0, 0, 8) == 8);
}

TEST_CASE("islands that do not touch have sub-steps of their own") {
  WorldSettings how = soft_settings();
  how.contact_tolerance_m = 5e-4;
  World both(how), one(how);
  const auto cube = [](double x, double z, double mass) {
    BodySpec spec = brick({0.5, 0.5, 0.5}, {x, 0, z});
    spec.mass_kg = mass;
    return spec;
  };
  for (World* world : {&both, &one}) {
    add(*world, ground());
    add(*world, cube(0, 0.5, 1));
  }
  add(both, cube(5, 0.5, 1));
  add(both, cube(5, 1.5, 200));
  steps(both, 300);
  steps(one, 300);
  const StepReport report = both.step();
  CHECK(report.islands == 2);
  CHECK(report.sub_steps_max == 32);  // 0.0150 s * sqrt(201 g / 5e-4) = 29.8
  CHECK(one.step().sub_steps_max == 4);
  // The cube that stands alone does not feel what is done for others, to the last bit.
  CHECK(state(both, BodyId{2}).p_WBo.z == state(one, BodyId{2}).p_WBo.z);
}

TEST_CASE("a body's own tolerance is kept where it touches, and the smaller one counts") {
  const auto rest_on = [](double below_m, double above_m, double ground_m) {
    World world(soft_settings());  // 0.5 mm
    BodySpec floor = ground();
    floor.contact_tolerance_m = ground_m;
    add(world, floor);
    BodySpec cube = brick({0.5, 0.5, 0.5}, {0, 0, 0.5});
    cube.contact_tolerance_m = below_m;
    const BodyId below = add(world, cube);
    cube.p_WBo.z = 1.5;
    cube.mass_kg = 100;
    cube.contact_tolerance_m = above_m;
    const BodyId above = add(world, cube);
    add(world, brick({0.5, 0.5, 0.5}, {9, 0, 0.5}));  // another island
    steps(world, 600);
    const StepReport report = world.step();
    const double sag = std::max(0.5 - state(world, below).p_WBo.z,
                                1 - state(world, above).p_WBo.z + state(world, below).p_WBo.z);
    const auto choices = world.sub_step_choices();
    REQUIRE(!choices.empty());
    CHECK(sag == Approx(choices.back().sag_m).epsilon(0.2));
    CHECK(choices.front().sub_steps == 4);  // of the other island
    CHECK(choices.back().sub_steps == report.sub_steps_max);
    return report.sub_steps_max;
  };
  // n = 0.0150 s * sqrt(991 / tolerance), with a tenth of the load in reserve
  CHECK(rest_on(0, 0, 0) == 24);           // 21.1
  CHECK(rest_on(0, 1e-4, 0) == 56);        // 49.5
  CHECK(rest_on(1e-4, 1e-2, 0) == 56);     // the smaller
  CHECK(rest_on(2e-3, 2e-3, 0) == 12);     // 10.5: the ground says nothing
  CHECK(rest_on(2e-3, 0, 0) == 24);        // the upper one has the world's
  CHECK(rest_on(2e-3, 2e-3, 5e-4) == 24);  // now it does
}

TEST_CASE("islands are what touches, and what does not yield joins nobody") {
  Islands islands;
  const std::vector<ColouredPair> pairs{{0, 1}, {4, 1}, {2, -1}, {3, -1}, {5, 6}, {-1, 6}};
  islands.find(pairs, 8);
  CHECK(islands.count() == 5);
  CHECK(islands.of(0) == 0);
  CHECK(islands.of(1) == 0);
  CHECK(islands.of(4) == 0);
  CHECK(islands.of(2) == 1);
  CHECK(islands.of(3) == 2);
  CHECK(islands.of(5) == 3);
  CHECK(islands.of(6) == 3);
  CHECK(islands.of(7) == 4);
  CHECK(std::ranges::equal(islands.sizes(), std::array{3, 1, 1, 2, 1}));
}

}  // namespace cradle
