// Bodies whose centre of mass is not their origin, or whose principal axes are not theirs: what one
// says and sees is Bo and B; what flies is Bcm.
#include <catch2/catch.hpp>

#include "tests/physics/solids.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

/// A hammer: a rod along x, a heavy head askew at its end, a knob out of their plane.
GeometryPointer hammer() {
  const Rotation slant(Eigen::AngleAxisd(0.4, Vector(1, 1, 0).normalized()));
  return make_compound({{Shape::capsule(0.05, 0.4),
                         nullptr,
                         {0.4, 0, 0},
                         Rotation(Eigen::AngleAxisd(M_PI / 2, Vector::UnitY())),
                         700},
                        {Shape::box({0.1, 0.2, 0.08}), nullptr, {0.9, 0.05, 0}, slant, 7800},
                        {Shape::cone(0.1, 0.1), nullptr, {0, 0, 0.2}, slant, 2000}})
      .geometry;
}

BodySpec hammer_in(World& world) {
  BodySpec spec;
  spec.shape = Shape::stored(ShapeKind::compound, world.add_geometry(hammer()));
  spec.p_WBo = {1, 2, 3};
  spec.q_WB = {0.5, 0.1, -0.7, 0.2};
  spec.v_WBcm = {3, 4, 5};
  spec.w_WB = {2, -3, 1};
  return spec;
}

Matrix rotation_of(const BodyState& s) { return to_eigen(s.q_WB).toRotationMatrix(); }

/// Of a body with this tensor in B, from its published state alone.
Vector angular_momentum(const BodyState& s, const Matrix& J_B) {
  const Matrix R = rotation_of(s);
  return R * J_B * R.transpose() * to_eigen(s.w_WB);
}

Wrench impulse_at(BodyId body, WrenchPoint kind, const Vec3& point, const Vec3& value) {
  Wrench wrench;
  wrench.body = body;
  wrench.quantity = WrenchQuantity::impulse;
  wrench.point_kind = kind;
  wrench.point = point;
  wrench.value = value;
  return wrench;
}

}  // namespace

TEST_CASE("a hammer thrown with spin: its centre of mass flies the parabola, its origin does not") {
  World world(settings());
  const BodySpec spec = hammer_in(world);
  const BodyId body = add(world, spec);
  const MassDistribution m = mass_distribution(*hammer(), 1);
  REQUIRE(m.p_BoBcm.norm() > 0.5);
  const BodyState start = state(world, body);
  CHECK(distance(start.p_WBo, spec.p_WBo) < 1e-15);
  CHECK(angle(start.q_WB, to_plain(to_eigen(spec.q_WB).normalized())) < 3e-8);
  const Vector from = to_eigen(start.p_WBo) + rotation_of(start) * m.p_BoBcm;
  const Vector L = angular_momentum(start, m.inertia_kgm2());
  const double energy = L.dot(to_eigen(start.w_WB)) / 2;
  double largest_swing = 0;
  for (int tick = 1; tick <= 120; ++tick) {
    world.step();
    const BodyState s = state(world, body);
    const double t = tick / 60.0;
    const Vector now = to_eigen(s.p_WBo) + rotation_of(s) * m.p_BoBcm;
    const Vector parabola = from + t * Vector(3, 4, 5) + t * t / 2 * Vector(0, 0, -kGravity);
    REQUIRE((now - parabola).norm() < 1e-12);
    REQUIRE((to_eigen(s.v_WBcm) - Vector(3, 4, 5 - kGravity * t)).norm() < 1e-12);
    const Vector L_now = angular_momentum(s, m.inertia_kgm2());
    REQUIRE((L_now - L).norm() < 1e-8 * L.norm());
    REQUIRE(std::abs(L_now.dot(to_eigen(s.w_WB)) / 2 / energy - 1) < 1e-8);
    largest_swing = std::max(largest_swing, (to_eigen(s.p_WBo) - parabola).norm());
  }
  CHECK(largest_swing > 0.5);
}

TEST_CASE("a force at Bo turns a body whose centre of mass is elsewhere") {
  // (Bo - Bcm) x F. At Bcm, and at the point of the body where Bcm is, the same force turns
  // nothing.
  World world(weightless());
  BodySpec spec = hammer_in(world);
  spec.v_WBcm = spec.w_WB = {};
  const MassDistribution m = mass_distribution(*hammer(), 1);
  const Matrix R = to_eigen(spec.q_WB).normalized().toRotationMatrix();
  const Vector F(3, -2, 5);
  const auto w_after = [&](WrenchPoint kind, const Vec3& point, bool in_body = false) {
    const BodyId id = add(world, spec);
    Wrench wrench = impulse_at(id, kind, point, to_plain(F));
    if (in_body) {
      wrench.frame = WrenchFrame::body;
      wrench.value = to_plain(Vector(R.transpose() * F));
    }
    REQUIRE(world.push(std::array{wrench}).result == Result::ok);
    world.step();
    const BodyState s = state(world, wrench.body);
    REQUIRE(world.despawn(std::array{id}).result == Result::ok);  // out of the way
    CHECK((to_eigen(s.v_WBcm) - F / m.mass_kg).norm() < 1e-14);
    // The gyroscopic term changes w within the tick, but not the angular momentum.
    return angular_momentum(s, m.inertia_kgm2());
  };
  const Vector arm = -(R * m.p_BoBcm);
  for (const bool in_body : {false, true}) {
    CHECK((w_after(WrenchPoint::body_point, {}, in_body) - arm.cross(F)).norm() < 1e-11);
    CHECK((w_after(WrenchPoint::world_point, spec.p_WBo, in_body) - arm.cross(F)).norm() < 1e-11);
    CHECK(w_after(WrenchPoint::centre_of_mass, {}, in_body).norm() < 1e-13);
    CHECK(w_after(WrenchPoint::body_point, to_plain(m.p_BoBcm), in_body).norm() < 1e-13);
  }
}

TEST_CASE("a torque meets the whole tensor, products and all") {
  const Matrix R = turn(0.8, {1, 2, -1});
  const Matrix J = R * Vector(3, 2, 1.5).asDiagonal() * R.transpose();
  World world(weightless(6000));
  BodySpec spec;
  spec.mass_kg = 2;
  spec.inertia_kgm2 = to_plain(Vector(J.diagonal()));
  spec.inertia_products_kgm2 = {J(0, 1), J(0, 2), J(1, 2)};
  spec.q_WB = {0.3, 0.4, 0.5, -0.6};
  Wrench twist;
  twist.body = add(world, spec);
  twist.quantity = WrenchQuantity::angular_impulse;
  twist.value = {0.1, -0.2, 0.3};
  REQUIRE(world.push(std::array{twist}).result == Result::ok);
  world.step();
  const BodyState s = state(world, twist.body);
  const Matrix Q = rotation_of(s);
  const Vector w = Q * J.inverse() * Q.transpose() * to_eigen(twist.value);
  CHECK((to_eigen(s.w_WB) - w).norm() < 1e-14);
}

TEST_CASE("a body with products of inertia moves as the same body told in its principal axes") {
  const Matrix R = turn(0.8, {1, 2, -1});
  const Matrix J = R * Vector(3, 2, 1.5).asDiagonal() * R.transpose();
  World world(settings());
  BodySpec askew;
  askew.mass_kg = 2;
  askew.inertia_kgm2 = to_plain(Vector(J.diagonal()));
  askew.inertia_products_kgm2 = {J(0, 1), J(0, 2), J(1, 2)};
  askew.sets_centre_of_mass = true;
  askew.p_BoBcm = {0.5, -1, 2};
  askew.w_WB = {1, 2, 3};
  BodySpec straight;
  straight.mass_kg = 2;
  straight.inertia_kgm2 = {3, 2, 1.5};
  straight.p_WBo = askew.p_BoBcm;
  straight.q_WB = to_plain(Rotation(R));
  straight.w_WB = askew.w_WB;
  const BodyId a = add(world, askew), b = add(world, straight);
  steps(world, 300);
  const BodyState A = state(world, a), B = state(world, b);
  const Vector centre = to_eigen(A.p_WBo) + rotation_of(A) * to_eigen(askew.p_BoBcm);
  CHECK((centre - to_eigen(B.p_WBo)).norm() < 1e-12);
  CHECK((rotation_of(A) * R - rotation_of(B)).norm() < 1e-11);
  CHECK(distance(A.w_WB, B.w_WB) < 1e-11);
}

TEST_CASE("a pose that is set is the pose that is seen, of Bo and B") {
  World world(weightless());
  const BodyId body = add(world, hammer_in(world));
  Motion motion;
  motion.body = body;
  motion.sets_pose = motion.sets_velocity = true;
  motion.p_WBo = {-4, 5, 6};
  motion.q_WB = {0, 0, 3, 4};
  REQUIRE(world.set_motion(std::array{motion}).result == Result::ok);
  const BodyState s = state(world, body);
  CHECK(distance(s.p_WBo, {-4, 5, 6}) < 1e-15);
  CHECK(angle(s.q_WB, {0, 0, 0.6, 0.8}) < 3e-8);
  steps(world, 10);
  CHECK(distance(state(world, body).p_WBo, {-4, 5, 6}) < 1e-15);
}

TEST_CASE("shapes collide where B has them, not where the centre of mass is") {
  // A cube loaded at one side rests flat on the ground; loaded near an edge and half over a ledge
  // it stays, or falls, as the load is over the ledge or not.
  World world(settings());
  add(world, ground());
  BodySpec cube = brick({0.5, 0.5, 0.5}, {0, 0, 0.5});
  cube.sets_centre_of_mass = true;
  cube.p_BoBcm = {0.3, -0.2, 0.1};
  const BodyId loaded = add(world, cube);
  BodySpec ledge = brick({1, 1, 0.5}, {10, 0, 0.5});
  ledge.kind = BodyKind::fixed;
  add(world, ledge);
  cube.p_WBo = {11.1, 0, 1.5};  // its origin is beyond the ledge, which ends at x = 11
  cube.p_BoBcm = {-0.3, 0, 0};
  const BodyId stays = add(world, cube);
  cube.p_WBo = {10.9, 1.2, 1.5};  // its origin is over the ledge in x, but the load is not in y
  cube.p_BoBcm = {0, 0.3, 0};
  cube.p_WBo = {10, 0.9, 1.5};
  const BodyId falls = add(world, cube);
  steps(world, 120);
  CHECK(distance(state(world, loaded).p_WBo, {0, 0, 0.5}) < 2e-3);
  CHECK(angle(state(world, loaded).q_WB, {1, 0, 0, 0}) < 2e-3);
  CHECK(distance(state(world, stays).p_WBo, {11.1, 0, 1.5}) < 2e-3);
  CHECK(state(world, falls).p_WBo.z < 1.2);
}

TEST_CASE("a body in contact turns by its own tensor, not by one along the axes of its shape") {
  // A ball looks the same in every frame: told in its principal axes or with products of inertia,
  // it must bounce and roll alike.
  const Matrix R = turn(1.1, {1, 2, -1});
  const Matrix J = R * Vector(0.05, 0.08, 0.1).asDiagonal() * R.transpose();
  const auto end = [](const BodySpec& spec) {
    World world(settings());
    add(world, ground());
    const BodyId body = add(world, spec);
    steps(world, 90);
    CHECK(state(world, body).in_contact);
    return state(world, body);
  };
  BodySpec straight = ball(0.5, {0, 0, 0.8}, {2, 1, 0});
  straight.w_WB = {1, -2, 3};
  straight.material.restitution = 0.3;
  BodySpec askew = straight;
  straight.inertia_kgm2 = {0.05, 0.08, 0.1};
  straight.q_WB = to_plain(Rotation(R));
  askew.inertia_kgm2 = to_plain(Vector(J.diagonal()));
  askew.inertia_products_kgm2 = {J(0, 1), J(0, 2), J(1, 2)};
  const BodyState a = end(straight), b = end(askew);
  CHECK(distance(a.p_WBo, b.p_WBo) < 1e-9);
  CHECK(distance(a.w_WB, b.w_WB) < 1e-8);
}

TEST_CASE("bodies whose frames are the same are stored as they are given, to the last bit") {
  World world(weightless());
  const Quat q = to_plain(to_eigen(Quat{0.1, 0.7, -0.3, 0.2}).normalized());
  for (const Shape& shape :
       {Shape::sphere(0.3), Shape::box({0.1, 0.2, 0.3}), Shape::none(), Shape::capsule(0.1, 0.2),
        Shape::cylinder(0.1, 0.2), Shape::ellipsoid({0.1, 0.2, 0.3})}) {
    BodySpec spec;
    spec.shape = shape;
    spec.mass_kg = 1;
    spec.p_WBo = {0.1, 1.0 / 3, 1e5};
    spec.q_WB = q;
    const BodyState s = state(world, add(world, spec));
    CHECK(s.p_WBo == spec.p_WBo);
    CHECK(distance({s.q_WB.x, s.q_WB.y, s.q_WB.z}, {q.x, q.y, q.z}) < 3e-16);
  }
}

TEST_CASE("events tell where the centre of mass is") {
  World world(settings());
  BodySpec cone = ball(1, {});
  cone.shape = Shape::cone(0.3, 0.4);
  add(world, cone);
  CHECK(world.take_events().at(0).p_BoBcm == Vec3{0, 0, -0.2});
  CHECK(world.describe({}, 1).at(0).p_BoBcm == Vec3{0, 0, -0.2});
}

TEST_CASE("stored geometry is named by number and kind, and a wrong name is refused") {
  World world(settings());
  Surface open = box_surface({1, 1, 1});
  open.triangles.pop_back();
  const auto closed_mesh = world.add_geometry(mesh_of(box_surface({1, 1, 1})).geometry);
  const auto open_mesh = world.add_geometry(mesh_of(open).geometry);
  CHECK(closed_mesh == 1);
  CHECK(open_mesh == 2);
  const auto result = [&world](ShapeKind kind, std::int64_t number, BodyKind body_kind) {
    BodySpec spec;
    spec.kind = body_kind;
    spec.shape = Shape::stored(kind, number);
    const Outcome outcome = world.spawn(std::array{ball(0.5, {}), spec});
    CHECK(outcome.item == (outcome.result == Result::ok ? 0 : 1));
    return outcome.result;
  };
  CHECK(result(ShapeKind::mesh, 1, BodyKind::dynamic) == Result::ok);
  CHECK(result(ShapeKind::mesh, 2, BodyKind::dynamic) == Result::bad_shape);
  CHECK(result(ShapeKind::mesh, 2, BodyKind::fixed) == Result::ok);
  CHECK(result(ShapeKind::mesh, 3, BodyKind::fixed) == Result::bad_shape);
  CHECK(result(ShapeKind::hull, 1, BodyKind::dynamic) == Result::bad_shape);
  CHECK(world.not_colliding_count() == 0);
  BodyState s;
  REQUIRE(world.find({2}, s));
}

TEST_CASE("the hash covers stored geometry, down to a part of a part") {
  const auto hash = [](const GeometryPointer& geometry) {
    World world(settings());
    world.add_geometry(geometry);
    return world.hash();
  };
  const auto two = [](double size, double density) {
    const GeometryPointer hull = make_hull(octahedron_surface(size).vertices).geometry;
    return make_compound({{Shape::sphere(1), nullptr, Vector::Zero(), Rotation::Identity(), 1000},
                          {{ShapeKind::hull, {}}, hull, {}, Rotation::Identity(), density}})
        .geometry;
  };
  CHECK(hash(two(1, 1000)) == hash(two(1, 1000)));
  CHECK(hash(two(1, 1000)) != hash(two(1, 1001)));
  CHECK(hash(two(1, 1000)) != hash(two(1.001, 1000)));
  CHECK(hash(hammer()) != hash(two(1, 1000)));
  const Surface s = box_surface({1, 1, 1}), other = box_surface({1, 1, 1 + 1e-15});
  CHECK(hash(mesh_of(s).geometry) != hash(mesh_of(other).geometry));
  CHECK(hash(mesh_of(s).geometry) != hash(make_hull(s.vertices).geometry));
}

}  // namespace cradle
