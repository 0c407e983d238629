// Bodies that move over triangle meshes: they must not notice how the surface is cut.
#include <catch2/catch.hpp>
#include <map>

#include "tests/physics/terrains.h"

using namespace cradle;

namespace {

std::vector<std::pair<std::string, BodySpec>> movers(World& world) {
  std::vector<std::pair<std::string, BodySpec>> all;
  const auto add_mover = [&](const char* name, const Shape& shape, double height, Quat q = {}) {
    BodySpec spec;
    spec.shape = shape;
    spec.p_WBo = {0, 0, height};
    spec.q_WB = q;
    all.emplace_back(name, spec);
  };
  const Quat lying{std::sqrt(0.5), 0, std::sqrt(0.5), 0};
  add_mover("sphere", Shape::sphere(0.3), 0.3);
  add_mover("box", Shape::box({0.4, 0.3, 0.2}), 0.2);
  add_mover("matchbox", Shape::box({0.03, 0.02, 0.01}), 0.01);
  add_mover("crate larger than the cells", Shape::box({2.3, 1.9, 0.4}), 0.4);
  add_mover("capsule", Shape::capsule(0.2, 0.5), 0.2, lying);
  add_mover("cylinder", Shape::cylinder(0.3, 0.2), 0.2);
  add_mover("lying cylinder", Shape::cylinder(0.2, 0.4), 0.2, lying);
  add_mover("cone", Shape::cone(0.3, 0.4), 0.4);
  add_mover("ellipsoid", Shape::ellipsoid({0.4, 0.3, 0.2}), 0.2);
  const std::vector<Vector> frustum = {{0.3, 0.1, -0.2},  {-0.1, 0.3, -0.2}, {-0.3, -0.1, -0.2},
                                       {0.1, -0.3, -0.2}, {0.2, 0, 0.3},     {-0.1, 0.1, 0.3},
                                       {0, -0.1, 0.3}};
  const GeometryPointer hull = make_hull(frustum).geometry;
  add_mover("hull", Shape::stored(ShapeKind::hull, world.add_geometry(hull)), 0.2);
  return all;
}

}  // namespace

namespace {

/// Velocities, tick after tick, of a body that came to rest and then was set going. By soft steps
/// throughout: by "hybrid" what has lain still sinks in first, by 0.2 mm, in some ticks.
std::vector<BodyState> slide(const BodySpec& spec, const GeometryPointer& ground_mesh,
                             const Vec3& velocity) {
  WorldSettings how = settings();
  how.solver = "soft";
  World world(how);
  movers(world);  // the hull is held
  if (ground_mesh) {
    add_surface(world, ground_mesh);
  } else {
    add(world, ground());
  }
  const BodyId body = add(world, spec);
  steps(world, 900);
  Motion motion;
  motion.body = body;
  motion.v_WBcm = velocity;
  motion.sets_velocity = true;
  REQUIRE(world.set_motion(std::vector{motion}).result == Result::ok);
  std::vector<BodyState> states;
  for (int tick = 0; tick < 70; ++tick) {
    world.step();
    states.push_back(state(world, body));
    const Vec3& p = states.back().p_WBo;
    if (std::max(std::abs(p.x), std::abs(p.y)) > 5.5) break;
  }
  return states;
}

/// 20 m wide, each of its eight triangles at its border.
GeometryPointer coarse() {
  return make_height_field(3, 3, 10, 10, std::vector<double>(9, 0)).geometry;
}

Vec3 heading(int direction) {
  const double angle = 0.1 + 1.3 * direction, speed = 1.5 + direction;
  return {speed * std::cos(angle), speed * std::sin(angle), 0};
}

}  // namespace

TEST_CASE("a body slides over a flat mesh without a bump") {
  const GeometryPointer even = mesh_of(terrain(24, 0.7, 0, flat)).geometry;
  const GeometryPointer uneven = mesh_of(terrain(24, 0.7, 0.35, flat)).geometry;
  World all(settings());
  for (auto [name, spec] : movers(all)) {
    spec.material.friction = 0;
    for (int direction = 0; direction < 5; ++direction) {
      for (const GeometryPointer& ground_mesh : {even, uneven, coarse()}) {
        CAPTURE(name, direction, ground_mesh == even, ground_mesh == uneven);
        double largest = 0;
        for (const BodyState& s : slide(spec, ground_mesh, heading(direction)))
          largest = std::max(largest, std::abs(s.v_WBcm.z));
        CHECK(largest <= 1e-6);
      }
    }
  }
}

TEST_CASE("friction on a flat mesh is that on a plane") {
  const GeometryPointer uneven = mesh_of(terrain(24, 0.7, 0.35, flat)).geometry;
  World all(settings());
  for (auto [name, spec] : movers(all)) {
    if (name == "ellipsoid") continue;  // it begins to roll: rounding grows
    for (int direction = 0; direction < 5; ++direction) {
      const auto on_plane = slide(spec, nullptr, heading(direction));
      for (const GeometryPointer& surface : {uneven, coarse()}) {
        CAPTURE(name, direction, surface == uneven);
        const auto on_surface = slide(spec, surface, heading(direction));
        REQUIRE(on_surface.size() == on_plane.size());
        double largest = 0;
        for (std::size_t k = 0; k < on_surface.size(); ++k)
          largest = std::max(largest, distance(on_surface[k].v_WBcm, on_plane[k].v_WBcm));
        // The points of a hull are solved in another order, and the solver does not iterate to the
        // end.
        CHECK(largest <= (name == "hull" ? 1e-2 : 1e-6));
      }
    }
  }
}
