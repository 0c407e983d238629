// A world that goes on as it did asks for no memory.
#include <catch2/catch.hpp>
#include <functional>
#include <memory>
#include <vector>

#include "server/collision/stored_geometry.h"
#include "tests/physics/terrains.h"
#include "tests/physics/worlds.h"
#include "tests/steady/allocations.h"

namespace cradle {
namespace {

/// Of `ticks` steps, how many asked for memory, after `warm_up` of them. Events are taken as a
/// daemon takes them; there are none.
std::size_t allocating_ticks(World& world, int warm_up, int ticks) {
  steps(world, warm_up);
  world.take_events();
  std::size_t found = 0;
  for (int k = 0; k < ticks; ++k) {
    const std::size_t before = test::allocations();
    world.step();
    if (test::allocations() != before) ++found;
  }
  CHECK(world.take_events().empty());
  return found;
}

WorldSettings steady() {
  WorldSettings how = settings();
  how.balance_every = 2;
  how.balance_flight = true;
  return how;
}

void box_of_walls(World& world, double half_m) {
  add(world, ground());
  for (const double side : {-1.0, 1.0}) {
    for (const bool along_x : {true, false}) {
      const double at = side * (half_m + 0.5);
      BodySpec wall = brick(along_x ? Vec3{0.5, half_m + 1, 4} : Vec3{half_m + 1, 0.5, 4},
                            along_x ? Vec3{at, 0, 4} : Vec3{0, at, 4});
      wall.kind = BodyKind::fixed;
      add(world, wall);
    }
  }
}

}  // namespace

TEST_CASE("memory is counted") {
  const std::size_t before = test::allocations();
  const auto one = std::make_unique<std::vector<double>>(1000);
  CHECK(test::allocations() >= before + 2);
  CHECK(one->size() == 1000);
}

TEST_CASE("a stack and a pyramid at rest ask for no memory") {
  World world(steady());
  add(world, ground());
  for (int i = 0; i < 10; ++i) add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5 + i}));
  for (int row = 0; row < 8; ++row) {
    for (int i = 0; i < 8 - row; ++i) {
      add(world, brick({0.5, 0.5, 0.5}, {5 + i + 0.5 * row, 0, 0.5 + row}));
    }
  }
  CHECK(allocating_ticks(world, 300, 100) == 0);
}

TEST_CASE("a layer of cubes that is solved by domains asks for no memory") {
  World world(steady());
  BodySpec belt = brick({40, 40, 0.5}, {0, 0, -0.5}, {0.1, 0, 0});
  belt.kind = BodyKind::kinematic;
  add(world, belt);
  for (int i = 0; i < 900; ++i) {
    add(world, brick({0.5, 0.5, 0.5}, {1.0 * (i % 30), 1.0 * (i / 30), 0.5}, {0.1, 0, 0}));
  }
  CHECK(allocating_ticks(world, 60, 30) == 0);
}

TEST_CASE("sleepers ask for no memory") {
  WorldSettings how = steady();
  how.is_sleeping = true;
  World world(how);
  add(world, ground());
  for (int i = 0; i < 5; ++i) add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5 + i}));
  steps(world, 400);
  CHECK(world.awake_count() == 0);
  add(world, brick({0.2, 0.2, 0.2}, {5, 0, 30}, {0, 0, 12}));  // flies past meanwhile
  CHECK(allocating_ticks(world, 20, 60) == 0);
}

TEST_CASE("a heap of several shapes at rest asks for no memory") {
  World world(steady());
  box_of_walls(world, 1.5);
  const std::vector<Vector> corners = {{0.3, 0, 0},  {-0.3, 0, 0}, {0, 0.3, 0},
                                       {0, -0.3, 0}, {0, 0, 0.3},  {0.2, 0.2, -0.2}};
  const GeometryPointer hull = make_hull(corners).geometry;
  const Shape stored = Shape::stored(hull->kind(), world.add_geometry(hull));
  for (int i = 0; i < 60; ++i) {
    const Vec3 at{0.6 * (i % 4) - 0.9, 0.6 * (i / 4 % 4) - 0.9, 0.5 + 0.6 * (i / 16) + 0.01 * i};
    BodySpec spec = i % 5 == 0 ? ball(0.25, at) : brick({0.25, 0.25, 0.2}, at);
    if (i % 5 == 1) spec.shape = Shape::capsule(0.15, 0.2);
    if (i % 5 == 2) spec.shape = Shape::cylinder(0.2, 0.2);
    if (i % 5 == 3) spec.shape = stored;
    add(world, spec);
  }
  CHECK(allocating_ticks(world, 1200, 100) == 0);
}

TEST_CASE("bodies at rest on a mesh and on a height field ask for no memory") {
  const bool is_field = GENERATE(false, true);
  CAPTURE(is_field);
  const auto level = [](double, double) { return 0.0; };
  World world(steady());
  add_surface(world,
              is_field ? make_height_field(41, 41, 0.1, 0.1, std::vector<double>(41 * 41)).geometry
                       : mesh_of(terrain(40, 0.1, 0, level)).geometry);
  add(world, brick({1.2, 1.2, 0.1}, {0, 0, 0.1}));  // over a thousand triangles
  add(world, brick({0.2, 0.2, 0.2}, {1.6, 1.6, 0.2}));
  add(world, ball(0.2, {-1.6, -1.6, 0.2}));
  BodySpec lying = brick({0.1, 0.1, 0.1}, {1.6, -1.6, 0.15});
  lying.shape = Shape::cylinder(0.1, 0.15);
  add(world, lying);
  CHECK(allocating_ticks(world, 300, 100) == 0);
}

TEST_CASE("bodies that move steadily ask for no memory") {
  World world(steady());
  add(world, ground(0));
  BodySpec belt = brick({1000, 2, 0.1}, {0, 20, -0.05}, {1, 0, 0});
  belt.kind = BodyKind::kinematic;
  add(world, belt);
  add(world, brick({0.3, 0.3, 0.3}, {0, 20, 0.35}));           // goes along
  add(world, brick({0.3, 0.3, 0.3}, {0, 0, 0.3}, {1, 0, 0}));  // slides
  const BodyId pushed = add(world, brick({0.3, 0.3, 0.3}, {0, -5, 0.3}));
  Wrench wrench;
  wrench.body = pushed;
  wrench.duration = WrenchDuration::until_cleared;
  wrench.value = {0.1, 0, 0};
  world.push(std::array{wrench});
  BodySpec spinning = brick({0.1, 0.2, 0.3}, {0, 9, 500});
  spinning.w_WB = {1, 2, 3};
  add(world, spinning);
  CHECK(allocating_ticks(world, 120, 100) == 0);
}

TEST_CASE("a gas of balls asks for no memory") {
  World world(steady());
  box_of_walls(world, 2);
  for (int i = 0; i < 100; ++i) {
    BodySpec spec = ball(0.1, {0.7 * (i % 5) - 1.4, 0.7 * (i / 5 % 5) - 1.4, 0.5 + 0.7 * (i / 25)},
                         {1.0 * (i % 3) - 1, 0.5 * (i % 4) - 0.7, 0.3 * (i % 5) - 0.6});
    spec.material.restitution = 1;
    spec.material.friction = 0;
    add(world, spec);
  }
  CHECK(allocating_ticks(world, 1200, 100) == 0);
}

TEST_CASE("a planar heap at rest asks for no memory") {
  WorldSettings how = steady();
  how.is_planar = true;
  how.gravity_W = {0, -kGravity, 0};
  World world(how);
  BodySpec floor = brick({10, 0.5, 0.5}, {0, -0.5, 0});
  floor.kind = BodyKind::fixed;
  add(world, floor);
  for (int i = 0; i < 12; ++i) {
    BodySpec spec = i % 3 == 0 ? ball(0.25, {}) : brick({0.25, 0.25, 0.5}, {});
    spec.p_WBo = {0.9 * (i % 4) - 1.5, 0.3 + 0.6 * (i / 4), 0};
    add(world, spec);
  }
  CHECK(allocating_ticks(world, 900, 100) == 0);
}

}  // namespace cradle
