// The benchmark's accounts of energy and momentum against sums by hand.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "server/dynamics/mass_distribution.h"
#include "tests/bench/conservation.h"
#include "tests/bench/masses.h"

using namespace cradle;
using namespace cradle::bench;

namespace {

/// A box of half extents 1, 2, 3 m and 3 kg at (1, 0, 2), turned a quarter about z.
Scene turned_box() {
  BodySpec body;
  body.shape = Shape::box({1, 2, 3});
  body.mass_kg = 3;
  body.p_WBo = {1, 0, 2};
  body.q_WB = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
  body.v_WBcm = {0, 4, 0};
  body.w_WB = {1, 0, 0};
  Scene scene;
  scene.settings.gravity_W = {0, 0, -10};
  scene.bodies = {body};
  return scene;
}

}  // namespace

TEST_CASE("a turned box has the energy and momentum that its moments give") {
  // About its own y axis, which lies along x now (or against it), the box has
  // m/3 (1^2 + 3^2) = 10 kg m^2.
  const Budget sum = budget_at_start(turned_box());
  CHECK(sum.translational_J == Approx(24));  // 3 * 4^2 / 2
  CHECK(sum.rotational_J == Approx(5));      // 10 * 1^2 / 2
  CHECK(sum.potential_J == Approx(60));      // 3 * 10 * 2
  CHECK(sum.momentum_Ns.isApprox(Vector{0, 12, 0}));
  // (1, 0, 2) x (0, 12, 0) = (-24, 0, 12), and 10 of its own spin.
  CHECK(sum.angular_momentum_Nms.isApprox(Vector{-14, 0, 12}));
}

TEST_CASE("a body without mass gets it from its density") {
  Scene scene = turned_box();
  scene.bodies[0].mass_kg = 0;
  scene.bodies[0].density_kgpm3 = 0.5;  // of 48 m^3
  CHECK(budget_at_start(scene).translational_J == Approx(192));
  scene.bodies[0].shape = Shape::sphere(1);  // 4/3 pi m^3; J = 2/5 m r^2
  CHECK(budget_at_start(scene).translational_J == Approx(16.7551608));
  CHECK(budget_at_start(scene).rotational_J == Approx(0.41887902));
}

TEST_CASE("masses of all shapes are those that the daemon finds by other means") {
  const Scene scene = parse_scene(R"(
[[body]]
shape = "capsule"
radius_m = 0.3
half_length_m = 0.7
[[body]]
shape = "cylinder"
radius_m = 0.3
half_length_m = 0.7
[[body]]
shape = "cone"
radius_m = 0.3
half_length_m = 0.7
[[body]]
shape = "ellipsoid"
half_extents_m = [0.2, 0.3, 0.4]
mass_kg = 3
[[body]]
shape = "hull"
points_m = [[0, 0, -0.3], [1, 0, 0.5], [-1, 1, 0.5], [-1, -1, 0.5]]
[[body]]
shape = "mesh"
points_m = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
[[body]]
shape = "compound"
[[body.part]]
shape = "cone"
radius_m = 0.2
half_length_m = 0.3
position_m = [0, 0.1, -0.9]
density_kgpm3 = 10
[[body.part]]
shape = "box"
half_extents_m = [0.2, 0.3, 0.1]
position_m = [0.1, 0, 0.95]
orientation_wxyz = [0.8, 0.6, 0, 0]
)",
                                  "test");
  REQUIRE(scene.bodies.size() == 7);
  for (const BodySpec& body : scene.bodies) {
    CAPTURE(word_of(body.shape.kind));
    const BodyMass ours = mass_of(scene, body);
    MassDistribution theirs = mass_distribution(body.shape, body.density_kgpm3);
    if (is_stored(body.shape.kind)) {
      const double density = body.shape.kind == ShapeKind::compound ? 1 : body.density_kgpm3;
      const auto number = static_cast<std::size_t>(body.shape.parameters[0]);
      theirs = mass_distribution(*scene.geometries[number - 1], density);
    }
    CHECK(ours.mass_kg == Approx(body.mass_kg > 0 ? body.mass_kg : theirs.mass_kg));
    CHECK((ours.p_BoBcm - theirs.p_BoBcm).norm() < 1e-12);
    CHECK((ours.J_kgm2 / ours.mass_kg - theirs.G).norm() < 1e-12);
  }
}

TEST_CASE("the potential energy of a cone is that of its centre of mass") {
  BodySpec cone;
  cone.shape = Shape::cone(0.5, 2);
  cone.mass_kg = 2;
  cone.p_WBo = {0, 0, 5};
  cone.q_WB = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};
  Scene scene;
  scene.settings.gravity_W = {0, 10, 0};
  scene.bodies = {cone};
  CHECK(budget_at_start(scene).potential_J == Approx(-20));  // a quarter turn about x: 1 m along y
}

TEST_CASE("drift of energy is its largest gain, or its last loss") {
  const Scene scene = turned_box();
  const auto after = [&](std::vector<double> changes) {
    Drift drift(scene);
    for (const double change : changes) {
      Budget now = budget_at_start(scene);
      now.potential_J += change * 89;  // of the 89 J above
      drift.tick(now);
    }
    return *drift.energy();
  };
  CHECK(after({-0.1, -0.3, -0.2}) == Approx(-0.2));
  CHECK(after({-0.1, 0.3, 0.2, -0.5}) == Approx(0.3));
  CHECK(after({1e-14, -0.5}) == Approx(-0.5));  // a gain of rounding is none
  CHECK(std::isnan(after({std::numeric_limits<double>::quiet_NaN(), -0.5})));
}

TEST_CASE("drift of momentum is held against the sum of its parts, where nothing pushes") {
  Scene scene = turned_box();
  CHECK_FALSE(Drift(scene).momentum());  // gravity does
  scene.settings.gravity_W = {};
  scene.bodies.push_back(scene.bodies[0]);
  scene.bodies[1].v_WBcm = {0, -4, 0};  // the sum is zero, that of the magnitudes 24 N s
  Drift drift(scene);
  Budget now = budget_at_start(scene);
  now.momentum_Ns.x() += 2.4;
  drift.tick(now);
  drift.tick(budget_at_start(scene));
  CHECK(*drift.momentum() == Approx(0.1));
  scene.bodies[1].kind = BodyKind::fixed;
  CHECK_FALSE(Drift(scene).momentum());
}

TEST_CASE("a scene without energy at its start has no relative drift of it") {
  Scene scene = turned_box();
  scene.settings.gravity_W = scene.bodies[0].v_WBcm = scene.bodies[0].w_WB = {};
  CHECK_FALSE(Drift(scene).energy());
}
