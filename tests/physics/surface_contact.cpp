// Worlds with meshes and height fields: who stands, who stays above, what is refused.
#include <catch2/catch.hpp>

#include "tests/physics/terrains.h"

using namespace cradle;

namespace {

GeometryPointer field_of(int n, double cell, const std::function<double(double, double)>& height) {
  std::vector<double> heights;
  for (int row = 0; row <= n; ++row) {
    for (int column = 0; column <= n; ++column)
      heights.push_back(height((column - 0.5 * n) * cell, (row - 0.5 * n) * cell));
  }
  return make_height_field(n + 1, n + 1, cell, cell, heights).geometry;
}

double bowl(double x, double y) {
  return 0.6 * std::sin(0.9 * x) * std::cos(0.8 * y) + 0.04 * (x * x + y * y);
}

BodySpec stored(World& world, const GeometryPointer& geometry, const Vec3& p_WBo) {
  BodySpec spec;
  spec.shape = Shape::stored(geometry->kind(), world.add_geometry(geometry));
  spec.p_WBo = p_WBo;
  return spec;
}

}  // namespace

TEST_CASE("a thousand bodies stay above bumpy ground") {
  const bool is_field = GENERATE(false, true);
  CAPTURE(is_field);
  World world(settings());
  add_surface(world,
              is_field ? field_of(24, 0.7, bowl) : mesh_of(terrain(24, 0.7, 0, bowl)).geometry);
  const std::int64_t hull =
      world.add_geometry(make_hull(octahedron_surface(0.2).vertices).geometry);
  std::vector<BodyId> bodies;
  for (int i = 0; i < 1000; ++i) {
    BodySpec spec =
        ball(0.15, {0.45 * (i % 10) - 2, 0.45 * (i / 10 % 10) - 2, 2.2 + 0.45 * (i / 100)});
    if (i % 2 == 1) spec.shape = Shape::stored(ShapeKind::hull, hull);
    bodies.push_back(add(world, spec));
  }
  steps(world, 300);
  int below = 0;
  for (const BodyId body : bodies) {
    const Vec3 p = state(world, body).p_WBo;
    below += !(p.z > bowl(p.x, p.y) - 0.1);  // the ground's triangles lie below the arc by less
  }
  CHECK(below == 0);
}

TEST_CASE("a body comes to rest in a pit, and on an edge between two triangles") {
  const auto pit = [](double x, double) { return std::abs(x); };
  World world(settings());
  add_surface(world, mesh_of(terrain(8, 1, 0, pit)).geometry);
  const double r = 0.3;
  const BodyId sphere = add(world, ball(r, {0.2, 0.1, 1}));
  const BodyId box = add(world, brick({0.2, 0.2, 0.2}, {0.1, 1.5, 1.5}));
  steps(world, 600);
  CHECK(std::abs(state(world, sphere).p_WBo.x) < 1e-3);
  CHECK(state(world, sphere).p_WBo.z == Approx(r * std::sqrt(2)).margin(1e-3));
  CHECK(norm(state(world, sphere).v_WBcm) < 1e-5);
  CHECK(state(world, box).p_WBo.z > 0.2);
  CHECK(norm(state(world, box).v_WBcm) < 1e-4);

  World level(settings());
  add_surface(level, mesh_of(terrain(8, 1, 0, flat)).geometry);
  const BodyId on_edge = add(level, brick({0.2, 0.2, 0.2}, {0.5, 0.5, 0.5}));  // of two triangles
  BodySpec rod;
  rod.shape = Shape::capsule(0.1, 0.4);
  rod.p_WBo = {-1.5, -1.5, 0.3};
  const double c = std::cos(M_PI / 8), s = std::sin(M_PI / 8), h = std::sqrt(0.5);
  rod.q_WB = {c * h, -s * h, c * h, s * h};  // lies along the diagonal edge
  const BodyId along_edge = add(level, rod);
  steps(level, 300);
  CHECK(state(level, on_edge).p_WBo.z == Approx(0.2).margin(1e-3));
  CHECK(state(level, along_edge).p_WBo.z == Approx(0.1).margin(1e-3));
  CHECK(norm(state(level, on_edge).v_WBcm) < 1e-6);
  CHECK(norm(state(level, along_edge).v_WBcm) < 1e-6);
}

TEST_CASE("a sphere crosses a ridge and a valley without a spurious stop") {
  // Slopes of 0.1 up and down: without friction, energy alone says how fast it is at the end.
  const double sign = GENERATE(1.0, -1.0);
  const auto roof = [sign](double x, double) { return -sign * 0.1 * std::abs(x); };
  World world(settings(240));
  BodySpec spec = ball(0.2, {-2, 0.3, 0}, {});
  spec.material.friction = 0;
  const double lift = 0.2 * std::sqrt(1.01);
  spec.p_WBo.z = roof(-2, 0) + lift;
  const double speed = 3;
  spec.v_WBcm = {speed / std::sqrt(1.01), 0.2, sign * 0.1 * speed / std::sqrt(1.01)};
  add_surface(world, mesh_of(terrain(16, 0.5, 0, roof)).geometry);
  const BodyId body = add(world, spec);
  double x = -2;
  for (int tick = 0; tick < 600 && x < 2; ++tick) {
    world.step();
    x = state(world, body).p_WBo.x;
    CHECK(state(world, body).v_WBcm.x > 2.0);
  }
  CHECK(x >= 2);
  CHECK(state(world, body).v_WBcm.y == Approx(0.2).margin(1e-6));
  // The slopes differ by 2 atan 0.1. A valley swallows the part of the velocity that points into
  // the slope behind it; over a ridge the sphere flies, and loses as much at most where it lands.
  const double turned = std::cos(2 * std::atan(0.1));
  const Vec3 v = state(world, body).v_WBcm;
  const double end = std::hypot(v.x, v.z);
  if (sign > 0) {
    CHECK(end > 0.998 * turned * speed);
    CHECK(end < 1.002 * speed);
  } else {
    const double fall = 2 * kGravity * 0.2;
    CHECK(end == Approx(std::sqrt(turned * turned * (speed * speed + fall) - fall)).epsilon(0.005));
  }
}

TEST_CASE("a closed mesh of a dynamic body rests on all that has a surface") {
  const GeometryPointer cube = mesh_of(box_surface({0.3, 0.2, 0.1})).geometry;
  World world(settings());
  add(world, ground());
  BodySpec table = brick({1, 1, 0.5}, {5, 0, 0.5});
  table.kind = BodyKind::fixed;
  add(world, table);
  const BodyId on_plane = add(world, stored(world, cube, {0, 0, 0.15}));
  const BodyId on_box = add(world, stored(world, cube, {5, 0, 1.15}));
  const BodyId ball_on_it = add(world, ball(0.1, {0, 0, 0.5}));
  steps(world, 300);
  CHECK(state(world, on_plane).p_WBo.z == Approx(0.1).margin(1e-3));
  CHECK(state(world, on_box).p_WBo.z == Approx(1.1).margin(1e-3));
  CHECK(state(world, ball_on_it).p_WBo.z == Approx(0.3).margin(2e-3));
  for (const BodyId body : {on_plane, on_box}) CHECK(norm(state(world, body).v_WBcm) < 1e-6);
}

TEST_CASE("nothing fast passes a mesh or a height field from the front") {
  const bool is_field = GENERATE(false, true);
  const GeometryPointer ground_under =
      is_field ? field_of(20, 0.5, bowl) : mesh_of(terrain(20, 0.5, 0, bowl)).geometry;
  std::mt19937 random(21);
  std::uniform_real_distribution<double> uniform(-1, 1);
  World world(settings(60, {0, 0, 0}));
  add_surface(world, ground_under);
  std::vector<BodyId> bodies;
  for (int i = 0; i < 200; ++i) {
    const double x = 2 * uniform(random), y = 2 * uniform(random);
    BodySpec spec = i % 2 == 0 ? ball(0.05, {}) : brick({0.2, 0.02, 0.01}, {});
    // No two in one place: they start one above the other, and each has its own tick to arrive.
    spec.p_WBo = {x, y, bowl(x, y) + 2 + 3.0 * i};
    spec.v_WBcm = {20 * uniform(random), 20 * uniform(random), -300};
    spec.w_WB = {30 * uniform(random), 30 * uniform(random), 0};
    spec.p_WBo.x -= spec.v_WBcm.x * 3.0 * i / 300;  // aims at the middle of the ground
    spec.p_WBo.y -= spec.v_WBcm.y * 3.0 * i / 300;
    bodies.push_back(add(world, spec));
  }
  int below = 0;
  for (int tick = 0; tick < 180; ++tick) {
    world.step();
    for (const BodyId body : bodies) {
      const Vec3 p = state(world, body).p_WBo;
      const bool is_over = std::max(std::abs(p.x), std::abs(p.y)) < 4.9;
      below += is_over && p.z < bowl(p.x, p.y) - 0.1;
    }
  }
  CHECK(below == 0);
}

TEST_CASE("a mesh stays above a half-space, however fast it comes, also as a part") {
  const GeometryPointer cube = mesh_of(box_surface({0.3, 0.2, 0.1})).geometry;
  for (const double speed : {0.0, 4.0, 8.0, 30.0, 300.0}) {
    World world(settings());
    add(world, ground());
    BodySpec falling = stored(world, cube, {0, 0, 1}), sliding = stored(world, cube, {5, 0, 0.1});
    falling.v_WBcm = {0, 0, -speed};
    sliding.v_WBcm = {speed, 0, 0};
    const BodyId one = add(world, falling), other = add(world, sliding);
    steps(world, 180);
    CAPTURE(speed);
    CHECK(state(world, one).p_WBo.z > 0.09);
    CHECK(state(world, other).p_WBo.z > 0.09);
  }
}

TEST_CASE("two surfaces touch nothing, and are counted") {
  const GeometryPointer cube = mesh_of(box_surface({0.3, 0.2, 0.1})).geometry;
  World world(settings());
  add_surface(world, mesh_of(terrain(8, 0.5, 0, flat)).geometry);
  add(world, stored(world, cube, {0, 0, 0.1}));
  const StepReport report = world.step();
  CHECK(report.contacts == 0);
  CHECK(report.surfaces_passing == 1);
  CHECK(world.not_colliding_count() == 0);
}

TEST_CASE("a height field is not for dynamic bodies, and its heights are in the hash") {
  const auto hash_of = [](double height) {
    World world(settings());
    world.add_geometry(field_of(4, 1, [=](double x, double) { return x > 1.5 ? height : 0; }));
    return world.hash();
  };
  CHECK(hash_of(0.5) != hash_of(0.5 + 1e-15));
  World world(settings());
  const BodySpec spec = stored(world, field_of(4, 1, flat), {});
  CHECK(world.spawn(std::array{spec}).result == Result::bad_shape);
}
