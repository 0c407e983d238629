// Contacts in a planar world, beside the same in space.
#include <catch2/catch.hpp>

#include "server/collision/planar_pairs.h"
#include "server/dynamics/contact/contact_constraint.h"
#include "server/world/plane.h"
#include "tests/physics/planar.h"

namespace cradle {
namespace {

const Vec3 kDown{0, -kGravity, 0};

struct Twins {
  World planar{planar_settings(kDown)}, spatial{settings(60, kDown)};
  BodyId add(const BodySpec& spec) {
    cradle::add(spatial, spec);
    return cradle::add(planar, spec);
  }
  void step(int count) {
    steps(planar, count);
    steps(spatial, count);
  }
  /// m, rad, m/s, rad/s: the largest.
  double difference(BodyId body) const {
    const BodyState a = state(planar, body), b = state(spatial, body);
    return std::fmax(std::fmax(distance(a.p_WBo, b.p_WBo), turn_between(a.q_WB, b.q_WB)),
                     std::fmax(distance(a.v_WBcm, b.v_WBcm), distance(a.w_WB, b.w_WB)));
  }
};

Pose pose(double x, double y, double angle_rad = 0) {
  return {{x, y, 0}, to_eigen(about_z(angle_rad)).toRotationMatrix()};
}

}  // namespace

// A point that is ahead of touching is led to a separation of zero, where the sign of a rounding
// decides between two formulas of the solver (soft_step.cpp). So impacts agree to 1e-9 only where
// the two worlds round alike; those of one sphere with the ground do.
TEST_CASE("P42: spheres that slide and roll on a slope move as in space, to 1e-9") {
  Twins twins;
  twins.add(level(0, 0.1, 0.4));
  std::vector<BodyId> balls;
  for (int i = 0; i < 6; ++i) {
    const double x = 6.0 * i;
    BodySpec spec =
        disc(0.3, {x - 0.2999 * std::sin(0.1), x * std::tan(0.1) + 0.2999 * std::cos(0.1), 0});
    const double v = i % 2 == 0 ? 2 : -2;
    spec.v_WBcm = {v * std::cos(0.1), v * std::sin(0.1), 0};
    spec.material.friction = 0.4;
    spec.w_WB.z = 3.0 * i;
    balls.push_back(twins.add(spec));
  }
  std::int64_t contacts = 0;
  for (int tick = 0; tick < 60; ++tick) {
    contacts += twins.planar.step().contacts;
    twins.spatial.step();
    for (const BodyId one : balls) REQUIRE(twins.difference(one) < 1e-9);
  }
  CHECK(contacts > 300);
}

TEST_CASE("P42: a sphere bounces as in space, to 1e-9") {
  Twins twins;
  twins.add(level(0));
  BodySpec spec = disc(0.25, {0, 1.25, 0}, {0.3, 0, 0});
  spec.material.restitution = 0.8;
  spec.w_WB.z = 5;
  const BodyId body = twins.add(spec);
  for (int tick = 0; tick < 240; ++tick) {
    twins.step(1);
    REQUIRE(twins.difference(body) < 1e-9);
  }
}

TEST_CASE("P13 in the plane: a disc slides until it rolls as in space") {
  Twins twins;
  twins.add(level(0, 0, 0.2));
  // Not touching by rounding alone, which decides how the first sub-step begins.
  BodySpec spec = disc(0.5, {0, 0.4999, 0}, {2, 0, 0});
  spec.material.friction = 0.2;
  const BodyId body = twins.add(spec);
  twins.step(60);
  CHECK(state(twins.planar, body).v_WBcm.x == Approx(4.0 / 3).epsilon(1e-4));
  CHECK(twins.difference(body) < 1e-9);
}

TEST_CASE("P14 in the plane: a box slides to a stop") {
  Twins twins;
  twins.add(level(0));
  const BodyId body = twins.add(brick({0.25, 0.25, 0.25}, {0, 0.25, 0}, {5, 0, 0}));
  twins.step(120);
  const double v0 = 5;
  CHECK(state(twins.planar, body).p_WBo.x == Approx(v0 * v0 / (2 * 0.5 * kGravity)).epsilon(1e-4));
  // Two points against four, which Gauss-Seidel meets one by one.
  CHECK(twins.difference(body) < 1e-4);
  // A contact gives way by F / (m omega^2) with the mass that its points move: of a cube in space
  // four have a quarter each, in the plane two have 2/5.
  const double omega = 2 * std::acos(-1.0) * 0.177 * 240;
  const double sag = kGravity / (omega * omega);
  CHECK(0.25 - state(twins.spatial, body).p_WBo.y == Approx(sag).epsilon(0.02));
  CHECK(0.25 - state(twins.planar, body).p_WBo.y == Approx(sag / 0.8).epsilon(0.02));
}

TEST_CASE("in the plane a stack of ten boxes stands on two points each") {
  World world(planar_settings(kDown));
  add(world, level(0));
  std::vector<BodyId> boxes;
  for (int i = 0; i < 10; ++i) boxes.push_back(add(world, brick({0.5, 0.5, 0.1}, {0, 0.5 + i, 0})));
  const StepReport report = world.step();
  CHECK(report.contacts == 20);  // two a box
  steps(world, 600);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const BodyState s = state(world, boxes[i]);
    CHECK(std::abs(s.p_WBo.x) < 0.02);  // as "a stack of ten cubes stands"
    CHECK(std::abs(s.p_WBo.y - (0.5 + static_cast<double>(i))) < 0.02);
    CHECK(norm(s.v_WBcm) < 1e-3);
    CHECK(turn_between(s.q_WB, {}) < 1e-3);
    CHECK(is_in_plane(s));
  }
}

TEST_CASE(
    "in the plane friction pushes along the surface alone, and a torque turns about z alone") {
  // A box that lands on a corner: in space it may roll any way, here it tips about z.
  World world(planar_settings(kDown));
  add(world, level(0));
  BodySpec spec = brick({0.5, 0.3, 0.2}, {0, 1, 0}, {1, 0, 0});
  spec.q_WB = about_z(0.3);
  const BodyId body = add(world, spec);
  for (int tick = 0; tick < 300; ++tick) {
    world.step();
    REQUIRE(is_in_plane(state(world, body)));
  }
  CHECK(state(world, body).p_WBo.y == Approx(0.3).margin(1e-3));
  CHECK(norm(state(world, body).v_WBcm) < 1e-3);
}

TEST_CASE("a kinematic slope and kinematic boxes carry bodies in the plane") {
  World world(planar_settings(kDown));
  BodySpec lift = level(0);
  lift.kind = BodyKind::kinematic;
  lift.v_WBcm = {0, 0.5, 0};
  lift.w_WB = {0, 0, 0.01};
  const BodyId ramp = add(world, lift);
  const BodyId body = add(world, brick({0.5, 0.5, 0.5}, {0, 0.5, 0}));
  steps(world, 120);
  CHECK(is_in_plane(state(world, body)));
  CHECK(state(world, body).p_WBo.y == Approx(1.5).margin(0.01));
  const Rotation turned = to_eigen(state(world, ramp).q_WB);
  CHECK(turned._transformVector(Vector::UnitZ()).x() == Approx(-std::sin(0.02)).epsilon(1e-9));
}

TEST_CASE("the rows of a contact in the plane know its freedoms alone") {
  // A corner 0.5 m aside of and 0.3 m below the centre: in space the tangent along z, which turns
  // the box with an arm of 0.58 m, would make friction work in smaller steps.
  MassProperties mass;
  REQUIRE(mass_properties(brick({0.5, 0.3, 0.2}, {}), nullptr, mass) == Result::ok);
  const MassProperties flat_mass = planar(mass);
  const double J = (0.5 * 0.5 + 0.3 * 0.3) / 3;
  CHECK(flat_mass.inertia_kgm2.z() == Approx(J).epsilon(1e-14));

  std::vector<Vector> x{Vector::Zero(), {0, 0.3, 0}}, still(2, Vector::Zero());
  std::vector<Rotation> q(2, Rotation::Identity());
  const std::vector<double> inverse_mass{0, flat_mass.inverse_mass};
  const std::vector<Matrix> inverse_inertia{
      Matrix::Zero(), rotated_diagonal(Matrix::Identity(), flat_mass.inverse_inertia)};
  const BodyArrays bodies{x, q, still, still, inverse_mass, {}, {}, {}, {}};
  Manifold manifold;
  manifold.normal_W = Vector::UnitY();
  manifold.count = 1;
  manifold.points[0].p_W = {0.5, 0, 0};
  manifold.points[0].separation = 0;
  ContactConstraint c = make_constraint(manifold, 0, 1, bodies, inverse_inertia);
  find_effective_masses(c);
  CHECK(c.K_normals[0] == Approx(1 + 0.25 / J).epsilon(1e-14));
  CHECK(c.K_tangents[0] == Approx(1 + 0.09 / J).epsilon(1e-14));

  // Its room used again, nothing is left of where another has rested.
  c.set_rest(c.points[0], {1e-3, 2});
  set_constraint(c, manifold, 0, 1, bodies, inverse_inertia);
  CHECK_FALSE(c.has_rested);
  CHECK(c.rest(c.points[0]).is_none());
}

TEST_CASE("boxes thinner than they overlap part in the plane") {
  const Shape plate = Shape::box({0.5, 0.5, 0.01});
  const Manifold m = collide_in_plane(plate, pose(0, 0), plate, pose(0.6, 0.1), 0.02);
  REQUIRE(m.count == 2);
  CHECK(m.normal_W == Vector(1, 0, 0));
  CHECK(m.points[0].separation == Approx(-0.4));
  CHECK(m.points[0].p_W.z() == 0);
  CHECK(m.points[1].p_W.z() == 0);
  CHECK((m.points[0].p_W - m.points[1].p_W).norm() == Approx(0.9));
}

TEST_CASE("contacts in the plane have two points at most, and none of them twice") {
  std::mt19937_64 random(5);
  int two = 0;
  for (int i = 0; i < 20'000; ++i) {
    const auto shape = [&] {
      if (random() % 4 == 0) return Shape::sphere(uniform(random, 0.1, 1));
      return Shape::box({uniform(random, 0.1, 1), uniform(random, 0.1, 1), 0.3});
    };
    const auto anywhere = [&] {
      const double x = uniform(random, -1, 1), y = uniform(random, -1, 1);
      return pose(x, y, uniform(random, -3, 3));
    };
    const Shape a = shape(), b = shape();
    const Pose X_a = anywhere(), X_b = anywhere();
    const Manifold m = collide_in_plane(a, X_a, b, X_b, 0.02);
    REQUIRE(m.count <= 2);
    if (m.count == 0) continue;
    REQUIRE(m.normal_W.z() == 0);
    REQUIRE(m.normal_W.norm() == Approx(1).epsilon(1e-14));
    for (int k = 0; k < m.count; ++k) {
      REQUIRE(m.points[static_cast<std::size_t>(k)].p_W.z() == 0);
    }
    two += m.count == 2 ? 1 : 0;
    if (m.count < 2) continue;
    REQUIRE((m.points[0].p_W - m.points[1].p_W).norm() > 1e-6);
    REQUIRE(m.points[0].feature != m.points[1].feature);
  }
  CHECK(two > 1000);
}

TEST_CASE("two spheres with one centre part in the plane") {
  const Manifold m =
      collide_in_plane(Shape::sphere(0.5), pose(0, 0), Shape::sphere(0.5), pose(0, 0), 0.02);
  CHECK(m.count == 1);
  CHECK(m.normal_W == Vector(0, 1, 0));
}

}  // namespace cradle
