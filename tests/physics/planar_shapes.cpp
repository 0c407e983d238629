// Shapes of the plane in motion, against closed forms.
#include <catch2/catch.hpp>
#include <numbers>

#include "server/dynamics/planar_mass.h"
#include "tests/physics/planar.h"

namespace cradle {
namespace {

const Vec3 kAlongMinusY{0, -kGravity, 0};

BodySpec body_of(const Shape& shape, const Vec3& p_WBo, double angle_rad = 0) {
  BodySpec spec;
  spec.shape = shape;
  spec.p_WBo = p_WBo;
  spec.q_WB = about_z(angle_rad);
  return spec;
}

/// About its centroid.
Shape regular_triangle(double height_m) {
  const double h = height_m, half = h / std::sqrt(3.0);
  return Shape::polygon({-half, -h / 3}, {half, -h / 3}, {0, 2 * h / 3});
}

GeometryPointer regular_polygon(int corners, double radius_m) {
  std::vector<Vec2> p;
  for (int k = 0; k < corners; ++k) {
    const double t = 2 * std::numbers::pi * (k + 0.5) / corners - std::numbers::pi / 2;
    p.push_back({radius_m * std::cos(t), radius_m * std::sin(t)});
  }
  return make_polygon(p).geometry;
}

Event event_of(World& world, BodyId body) { return world.describe({body.value - 1}, 1).at(0); }

double moment(World& world, BodyId body) {
  Wrench twist;
  twist.body = body;
  twist.quantity = WrenchQuantity::angular_impulse;
  twist.value = {0, 0, 1};
  const double before = state(world, body).w_WB.z;
  REQUIRE(world.push(std::array{twist}).result == Result::ok);
  world.step();
  return 1 / (state(world, body).w_WB.z - before);
}

}  // namespace

TEST_CASE("in the plane bodies weigh what a slice of 1 m does, and turn with its moment about z") {
  World world(planar_settings({}));
  using std::numbers::pi;
  const BodyId disc = add(world, body_of(Shape::sphere(0.5), {0, 0, 0}));
  CHECK(event_of(world, disc).mass_kg == Approx(1000 * pi / 4).epsilon(1e-14));
  CHECK(moment(world, disc) == Approx(1000 * pi / 4 * 0.125).epsilon(1e-12));

  const BodyId plate = add(world, body_of(Shape::box({0.5, 0.25, 0.1}), {9, 0, 0}));
  CHECK(event_of(world, plate).mass_kg == Approx(1000 * 0.1).epsilon(1e-14));
  CHECK(moment(world, plate) == Approx(100 * (1 + 0.25) / 12).epsilon(1e-12));

  const BodyId capsule = add(world, body_of(Shape::capsule(0.2, 0.5), {0, 9, 0}));
  const PlanarMass flat_capsule = planar_capsule(0.2, 0.5, 1000);
  CHECK(event_of(world, capsule).mass_kg == Approx(flat_capsule.mass_kg).epsilon(1e-14));
  CHECK(moment(world, capsule) == Approx(flat_capsule.inertia_kgm2).epsilon(1e-12));

  // The triangle (0, 0), (3, 0), (0, 3) has its centre at (1, 1) and J = m (9 + 9) / 18.
  BodySpec wedge = body_of(Shape::polygon({0, 0}, {3, 0}, {0, 3}), {9, 9, 0});
  wedge.density_kgpm3 = 2;
  const BodyId triangle = add(world, wedge);
  CHECK(event_of(world, triangle).mass_kg == Approx(9).epsilon(1e-14));
  CHECK(distance(event_of(world, triangle).p_BoBcm, {1, 1, 0}) < 1e-14);
  CHECK(moment(world, triangle) == Approx(9).epsilon(1e-12));
}

TEST_CASE("P13 in the plane: a disc slides until it rolls at two thirds of its speed") {
  World world(planar_settings(kAlongMinusY));
  add(world, level(0, 0, 0.2));
  BodySpec spec = ball(0.5, {0, 0.4999, 0}, {2, 0, 0});
  spec.material.friction = 0.2;
  const BodyId body = add(world, spec);
  steps(world, 60);  // it rolls after v0 / (3 mu g) = 0.34 s
  CHECK(state(world, body).v_WBcm.x == Approx(4.0 / 3).epsilon(1e-4));
  CHECK(state(world, body).w_WB.z == Approx(-8.0 / 3).epsilon(1e-3));
}

TEST_CASE("in the plane a disc rolls down a slope with two thirds of the slope's gravity") {
  World world(planar_settings(kAlongMinusY));
  const double slope = 0.3;
  add(world, level(0, slope, 0.5));
  BodySpec spec = ball(0.5, {0.5 * -std::sin(slope), 0.5 * std::cos(slope), 0});
  spec.material.friction = 0.5;
  const BodyId body = add(world, spec);
  steps(world, 20);
  const double v0 = norm(state(world, body).v_WBcm);
  steps(world, 60);
  CHECK(norm(state(world, body).v_WBcm) - v0 ==
        Approx(2.0 / 3 * kGravity * std::sin(slope)).epsilon(1e-3));
}

TEST_CASE("in the plane polygons and capsules rest below the friction angle and slide above it") {
  const double mu = 0.5;
  for (const double slope : {0.4, 0.55}) {  // the friction angle is 0.4636
    CAPTURE(slope);
    World world(planar_settings(kAlongMinusY));
    add(world, level(0, slope, mu));
    const GeometryPointer hexagon = regular_polygon(6, 0.5);
    const Shape many = Shape::stored(ShapeKind::hull, world.add_geometry(hexagon));
    // Low above the ground, so that none tips over.
    const std::pair<Shape, double> shapes[] = {
        {regular_triangle(0.9), 0.3},
        {Shape::polygon({-0.6, -0.2}, {0.6, -0.2}, {0.3, 0.2}, {-0.4, 0.2}), 0.2},
        {Shape::capsule(0.1, 0.5), 0.1},
        {many, 0.5 * std::cos(std::numbers::pi / 6)}};
    std::vector<BodyId> bodies;
    for (const auto& [shape, height] : shapes) {
      const double along = 4.0 * static_cast<double>(bodies.size()), up = height - 1e-4;
      BodySpec spec = body_of(shape,
                              {along * std::cos(slope) - up * std::sin(slope),
                               along * std::sin(slope) + up * std::cos(slope), 0},
                              slope);
      spec.material.friction = mu;
      bodies.push_back(add(world, spec));
    }
    steps(world, 30);
    std::vector<double> before;
    for (const BodyId body : bodies) before.push_back(norm(state(world, body).v_WBcm));
    steps(world, 60);
    const double gain = kGravity * (std::sin(slope) - mu * std::cos(slope));
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      CAPTURE(k);
      const BodyState s = state(world, bodies[k]);
      CHECK(is_in_plane(s));
      CHECK(turn_between(s.q_WB, about_z(slope)) < 1e-3);
      if (gain < 0) CHECK(norm(s.v_WBcm) < 1e-9);
      if (gain > 0) CHECK(norm(s.v_WBcm) - before[k] == Approx(gain).epsilon(1e-3));
    }
  }
}

TEST_CASE("in the plane a triangle that stands on its tip falls, one on its side stands") {
  World world(planar_settings(kAlongMinusY));
  add(world, level(0));
  const BodyId stands = add(world, body_of(regular_triangle(0.9), {0, 0.3, 0}));
  const BodyId falls =
      add(world, body_of(regular_triangle(0.9), {5, 0.6, 0}, std::numbers::pi + 1e-3));
  steps(world, 300);
  CHECK(turn_between(state(world, stands).q_WB, {}) < 1e-6);
  CHECK(state(world, falls).p_WBo.y == Approx(0.3).margin(2e-3));
  CHECK(norm(state(world, falls).v_WBcm) < 1e-3);
}

TEST_CASE("in the plane capsules, discs and polygons pile up and come to rest") {
  World world(planar_settings(kAlongMinusY));
  add(world, level(0));
  BodySpec wall = body_of(Shape::box({0.2, 4, 1}), {-2, 4, 0});
  wall.kind = BodyKind::fixed;
  add(world, wall);
  wall.p_WBo.x = 2;
  add(world, wall);
  const Shape many = Shape::stored(ShapeKind::hull, world.add_geometry(regular_polygon(7, 0.25)));
  const Shape shapes[] = {Shape::sphere(0.2), Shape::capsule(0.12, 0.2), regular_triangle(0.45),
                          many, Shape::box({0.2, 0.25, 0.5})};
  std::vector<BodyId> bodies;
  for (int i = 0; i < 40; ++i) {
    const double x = -1.2 + 0.8 * (i % 4), y = 0.5 + 0.7 * (i / 4);
    bodies.push_back(add(world, body_of(shapes[i % 5], {x, y, 0}, 0.7 * i)));
  }
  StepReport report;
  for (int tick = 0; tick < 900; ++tick) report = world.step();
  CHECK(report.contacts > 60);
  CHECK(report.penetration_max_m < 0.02);
  for (const BodyId body : bodies) {
    const BodyState s = state(world, body);
    CHECK(is_in_plane(s));
    CHECK(std::abs(s.p_WBo.x) < 2);
    CHECK(s.p_WBo.y > 0);
    CHECK(norm(s.v_WBcm) < 0.05);
  }
}

TEST_CASE("planar worlds refuse shapes of space, and worlds of space polygons") {
  World plane(planar_settings({})), space(weightless());
  const auto spawned = [](World& world, const BodySpec& spec) {
    return world.spawn(std::array{spec}).result;
  };
  for (const Shape& shape :
       {Shape::cylinder(1, 1), Shape::cone(1, 1), Shape::ellipsoid({1, 1, 1})}) {
    for (const BodyKind kind : {BodyKind::dynamic, BodyKind::fixed}) {
      BodySpec spec = body_of(shape, {});
      spec.kind = kind;
      CHECK(spawned(plane, spec) == Result::out_of_plane);
      CHECK(spawned(space, spec) == Result::ok);
    }
  }
  BodySpec spec = body_of(regular_triangle(1), {});
  CHECK(spawned(plane, spec) == Result::ok);
  CHECK(spawned(space, spec) == Result::bad_shape);
  spec.kind = BodyKind::fixed;
  CHECK(spawned(space, spec) == Result::bad_shape);

  const GeometryPointer hexagon = regular_polygon(6, 0.5);
  const GeometryPointer cube =
      make_hull(std::vector<Vector>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}).geometry;
  spec.shape = Shape::stored(ShapeKind::hull, plane.add_geometry(hexagon));
  CHECK(spawned(plane, spec) == Result::ok);
  spec.shape = Shape::stored(ShapeKind::hull, space.add_geometry(hexagon));
  CHECK(spawned(space, spec) == Result::bad_shape);
  spec.shape = Shape::stored(ShapeKind::hull, plane.add_geometry(cube));
  CHECK(spawned(plane, spec) == Result::out_of_plane);

  const auto compound = [&](const Shape& shape, const GeometryPointer& geometry, const Vector& p,
                            const Rotation& q) {
    return make_compound({{Shape::sphere(0.3), nullptr, Vector::Zero(), Rotation::Identity(), 1000},
                          {shape, geometry, p, q, 1000}})
        .geometry;
  };
  const auto with = [&](World& world, const GeometryPointer& geometry) {
    BodySpec whole = body_of(Shape::stored(ShapeKind::compound, world.add_geometry(geometry)), {});
    return spawned(world, whole);
  };
  const Rotation upright = Rotation::Identity(), turned = to_eigen(about_z(1));
  const Rotation tipped(std::sqrt(0.5), std::sqrt(0.5), 0, 0);
  const Shape box = Shape::box({0.1, 0.2, 0.3});
  CHECK(with(plane, compound(box, nullptr, {1, 0, 0}, turned)) == Result::ok);
  CHECK(with(plane, compound({ShapeKind::hull, {}}, hexagon, {1, 0, 0}, turned)) == Result::ok);
  CHECK(with(plane, compound(box, nullptr, {1, 0, 0.1}, upright)) == Result::out_of_plane);
  CHECK(with(plane, compound(box, nullptr, {1, 0, 0}, tipped)) == Result::out_of_plane);
  CHECK(with(plane, compound(Shape::cylinder(1, 1), nullptr, {1, 0, 0}, upright)) ==
        Result::out_of_plane);
  CHECK(with(space, compound(regular_triangle(1), nullptr, Vector::Zero(), upright)) ==
        Result::bad_shape);
  CHECK(with(space, compound({ShapeKind::hull, {}}, hexagon, Vector::Zero(), upright)) ==
        Result::bad_shape);
  CHECK(with(space, compound(box, nullptr, Vector::Zero(), tipped)) == Result::ok);
}

TEST_CASE("in the plane a compound weighs as its parts do, and stands on them") {
  World world(planar_settings(kAlongMinusY));
  add(world, level(0));
  const Rotation upright = Rotation::Identity();
  // A table of 2 m by 0.8 m: a plate and two legs.
  const GeometryPointer table =
      make_compound({{Shape::box({1, 0.1, 0.5}), nullptr, {0, 0.7, 0}, upright, 1000},
                     {Shape::box({0.1, 0.3, 0.5}), nullptr, {-0.8, 0.3, 0}, upright, 1000},
                     {Shape::polygon({-0.1, -0.3}, {0.1, -0.3}, {0.1, 0.3}, {-0.1, 0.3}),
                      nullptr,
                      {0.8, 0.3, 0},
                      upright,
                      1000}})
          .geometry;
  const BodyId body =
      add(world, body_of(Shape::stored(ShapeKind::compound, world.add_geometry(table)), {0, 0, 0}));
  CHECK(event_of(world, body).mass_kg == Approx(400 + 2 * 120).epsilon(1e-14));
  CHECK(event_of(world, body).p_BoBcm.y == Approx((400 * 0.7 + 240 * 0.3) / 640).epsilon(1e-14));
  const BodyId load = add(world, body_of(Shape::sphere(0.2), {0.3, 0.9999, 0}));
  CHECK(world.step().contacts == 5);  // two a leg, and the disc
  steps(world, 300);
  CHECK(distance(state(world, body).p_WBo, {0, 0, 0}) < 2e-3);
  CHECK(turn_between(state(world, body).q_WB, {}) < 1e-3);
  CHECK(state(world, load).p_WBo.y == Approx(1).margin(5e-3));
  CHECK(is_in_plane(state(world, body)));
}

}  // namespace cradle
