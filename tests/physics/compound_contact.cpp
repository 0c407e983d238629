// Compounds in contact: as their parts would be, glued together.
#include <catch2/catch.hpp>

#include "server/collision/manifolds.h"
#include "tests/physics/worlds.h"

using namespace cradle;

namespace {

CompoundPart part(const Shape& shape, const Vector& p_BoPo) {
  return {shape, nullptr, p_BoPo, Rotation::Identity(), 1000};
}

GeometryPointer compound_of(std::vector<CompoundPart> parts) {
  return make_compound(std::move(parts)).geometry;
}

BodySpec body_of(World& world, const GeometryPointer& geometry, const Vec3& p_WBo) {
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
  const BodyId table = add(world, body_of(world, compound_of(parts), {0, 0, 0}));
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
      compound_of({part(Shape::sphere(0.5), {-1, 0, 0}), part(Shape::box({1, 0.1, 0.1}), {0, 0, 0}),
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
