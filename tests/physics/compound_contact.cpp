// Compounds in contact: as their parts would be, glued together.
#include <catch2/catch.hpp>

#include "server/collision/manifolds.h"
#include "tests/physics/worlds.h"

using namespace cradle;

namespace {

CompoundPart part(const Shape& shape, const Vector& p_BoPo) {
  return {shape, nullptr, p_BoPo, Rotation::Identity(), 1000};
}

GeometryPointer welded(std::vector<CompoundPart> parts) {
  return make_compound(std::move(parts)).geometry;
}

BodySpec stored_body(World& world, const GeometryPointer& geometry, const Vec3& p_WBo) {
  BodySpec spec;
  spec.shape = Shape::stored(geometry->kind(), world.add_geometry(geometry));
  spec.p_WBo = p_WBo;
  return spec;
}

}  // namespace

TEST_CASE("a table stands on its four legs") {
  std::vector<CompoundPart> parts = {part(Shape::box({1, 0.6, 0.05}), {0, 0, 0.75})};
  for (const double x : {-0.9, 0.9}) {
    for (const double y : {-0.5, 0.5})
      parts.push_back(part(Shape::box({0.05, 0.05, 0.35}), {x, y, 0.35}));
  }
  World world(settings());
  add(world, ground());
  const BodyId table = add(world, stored_body(world, welded(parts), {0, 0, 0}));
  steps(world, 240);
  const BodyState s = state(world, table);
  CHECK(s.p_WBo.z == Approx(0).margin(1e-3));
  CHECK(std::hypot(s.p_WBo.x, s.p_WBo.y) < 1e-4);  // sinks on one leg after the other at first
  CHECK(std::hypot(s.v_WBcm.x, s.v_WBcm.y) < 1e-9);
  CHECK(s.q_WB.w == Approx(1).epsilon(1e-9));
  CHECK(world.step().contacts == 16);  // four a leg
}

TEST_CASE("parts of two compounds meet, and are named by their numbers") {
  const GeometryPointer dumbbell =
      welded({part(Shape::sphere(0.5), {-1, 0, 0}), part(Shape::box({1, 0.1, 0.1}), {0, 0, 0}),
              part(Shape::sphere(0.5), {1, 0, 0})});
  const Shape shape = Shape::stored(ShapeKind::compound, 1);
  const Pose lower, upper{{0, 0, 0.99}, Matrix::Identity()};
  std::vector<Manifold> manifolds;
  add_manifolds({shape, lower, dumbbell.get()}, {shape, upper, dumbbell.get()}, 0.02, manifolds);
  REQUIRE(manifolds.size() == 2);
  CHECK(manifolds[0].part == 0);
  CHECK(manifolds[1].part == (std::uint64_t{2} << 44 | std::uint64_t{2} << 32));
  for (const Manifold& manifold : manifolds) {
    CHECK(manifold.normal_W.z() == 1);
    CHECK(manifold.points[0].separation == Approx(-0.01));
  }
}

TEST_CASE("a box in two halves stands, slides and stops as a box does") {
  World world(settings());
  add(world, ground());
  const GeometryPointer halves = welded({part(Shape::box({0.25, 0.5, 0.5}), {-0.25, 0, 0}),
                                         part(Shape::box({0.25, 0.5, 0.5}), {0.25, 0, 0})});
  BodySpec whole = brick({0.5, 0.5, 0.5}, {0, 5, 0.5}, {3, 0, 0});
  whole.mass_kg = 1000;
  BodySpec two = stored_body(world, halves, {0, 0, 0.5});
  two.v_WBcm = {3, 0, 0};
  const BodyId box = add(world, whole), compound = add(world, two);
  steps(world, 120);
  const double v0 = 3, stop = v0 * v0 / (2 * 0.5 * kGravity);
  CHECK(state(world, box).p_WBo.x == Approx(stop).epsilon(1e-3));
  CHECK(state(world, compound).p_WBo.x == Approx(stop).epsilon(1e-3));
  CHECK(state(world, compound).p_WBo.z == Approx(0.5).margin(3e-4));
  CHECK(norm(state(world, compound).v_WBcm) < 1e-6);
}

TEST_CASE("compounds of hulls and boxes stack") {
  // A stool of a hull and four legs, three of them on each other.
  std::vector<Vector> seat;
  for (int k = 0; k < 8; ++k) {
    const double t = 0.25 * std::numbers::pi * k;
    for (const double z : {0.5, 0.6}) seat.emplace_back(0.5 * std::cos(t), 0.5 * std::sin(t), z);
  }
  std::vector<CompoundPart> parts = {part({ShapeKind::hull, {}}, {0, 0, 0})};
  parts[0].geometry = make_hull(seat).geometry;
  for (const double x : {-0.25, 0.25}) {
    for (const double y : {-0.25, 0.25})
      parts.push_back(part(Shape::box({0.04, 0.04, 0.25}), {x, y, 0.25}));
  }
  WorldSettings told = settings();
  told.sub_steps = 8;
  World world(told);
  add(world, ground());
  BodySpec stool = stored_body(world, welded(parts), {0, 0, 0});
  std::vector<BodyId> stools;
  for (int i = 0; i < 3; ++i) {
    stool.p_WBo.z = 0.6 * i;
    stools.push_back(add(world, stool));
  }
  steps(world, 300);
  // They rocked on their legs for good, by less than 0.1 mm, and crept by 0.5 mm a second.
  for (std::size_t i = 0; i < stools.size(); ++i) {
    const BodyState s = state(world, stools[i]);
    CHECK(s.p_WBo.z == Approx(0.6 * static_cast<double>(i)).margin(1e-3));
    CHECK(distance(s.p_WBo, {0, 0, s.p_WBo.z}) < 1e-4);
    CHECK(norm(s.v_WBcm) == 0);
    CHECK((to_eigen(s.q_WB) * Vector::UnitZ()).z() > 1 - 1e-6);
  }
}

TEST_CASE("a hammer that falls from its handle's end strikes with its head") {
  // It lies on an edge with the handle's end and turns about it, as a pendulum would.
  World world(settings());
  add(world, ground());
  const GeometryPointer hammer = welded({part(Shape::cylinder(0.03, 0.5), {0, 0, 0}),
                                         part(Shape::box({0.2, 0.1, 0.1}), {0, 0, 0.6})});
  BodySpec spec = stored_body(world, hammer, {0, 0, 0.5});
  spec.q_WB = {std::cos(0.05), 0, std::sin(0.05), 0};  // leaning towards x
  spec.p_WBo = {0.5 * std::sin(0.1), 0, 0.5 * std::cos(0.1) + 0.003};
  const BodyId body = add(world, spec);
  double fastest = 0, most = 0;
  const Totals start = world.totals();
  for (int tick = 0; tick < 240; ++tick) {
    world.step();
    fastest = std::max(fastest, norm(state(world, body).v_WBcm));
    const Totals now = world.totals();
    most = std::max(most, now.kinetic_energy_J + now.potential_energy_J);
  }
  CHECK(most < 1.001 * start.potential_energy_J);
  const BodyState s = state(world, body);
  CHECK(fastest > 2);
  CHECK(norm(s.v_WBcm) < 0.05);
  // At rest on its heavy head: on a side of it, or with the handle in the air.
  const Vector axis = to_eigen(s.q_WB) * Vector::UnitZ();
  CHECK(axis.z() < 0.2);
}
