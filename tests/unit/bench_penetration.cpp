// The benchmark's own overlap check against closed forms.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/bench/penetration.h"
#include "tests/unit/collision_support.h"

using namespace cradle;
using namespace cradle::bench;

namespace {

constexpr double kPlacesRounding = 1e-13;  // m, of coordinates of the order of one

const Shape kFloor = Shape::box({100, 100, 10});  // its top at z = 0 if its centre is at -10
const Shape kBall = Shape::sphere(0.5);

Matrix turned(double angle_rad, const Vector& axis) {
  return Eigen::AngleAxisd(angle_rad, axis.normalized()).toRotationMatrix();
}

/// A cube that stands on a corner: its longest diagonal points along z.
Matrix on_its_corner() { return turn_onto(Vector{1, 1, 1}, Vector::UnitZ()).toRotationMatrix(); }

/// A scene of boxes, spheres, capsules and cones, every third static, in a cloud about the origin.
Scene cloud(int count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Scene scene;
  for (int i = 0; i < count; ++i) {
    BodySpec body;
    body.kind = i % 3 == 0 ? BodyKind::fixed : BodyKind::dynamic;
    const Shape shapes[] = {kCube, kBall, Shape::capsule(0.3, 0.4), Shape::cone(0.5, 0.4)};
    body.shape = shapes[i % 4];
    body.p_WBo = {4 * uniform(random), 4 * uniform(random), 4 * uniform(random)};
    body.q_WB = {uniform(random), uniform(random), uniform(random), uniform(random)};
    scene.bodies.push_back(body);
  }
  return scene;
}

std::vector<BodyState> start_of(const Scene& scene) {
  std::vector<BodyState> states;
  for (const BodySpec& body : scene.bodies) {
    BodyState state;
    state.p_WBo = body.p_WBo;
    state.q_WB = to_plain(to_eigen(body.q_WB).normalized());
    states.push_back(state);
  }
  return states;
}

}  // namespace

TEST_CASE("two level cubes overlap by what their sides lack") {
  CHECK(overlap_m(kCube, at(0, 0, 0), kCube, at(0.9, 0.3, 0.2)) ==
        Approx(0.1).margin(kPlacesRounding));
  CHECK(overlap_m(kCube, at(0, 0, 0), kCube, at(1.2, 0, 0)) ==
        Approx(-0.2).margin(kPlacesRounding));
}

TEST_CASE("a corner in a face overlaps by half the diagonal less the height") {
  // The corner of a unit cube is sqrt(3)/2 from its centre.
  const double depth = std::sqrt(3.0) / 2 - 0.8;
  const Pose cube = at(3, 4, 0.8, on_its_corner());
  CHECK(overlap_m(kCube, cube, kFloor, at(0, 0, -10)) == Approx(depth).margin(kPlacesRounding));
  CHECK(overlap_m(kCube, cube, Shape::half_space(), at(0, 0, 0)) ==
        Approx(depth).margin(kPlacesRounding));
}

TEST_CASE("crossed edges overlap by twice half the face's diagonal less the distance") {
  // Each edge is sqrt(1/2) from its cube's centre; the faces alone would say 0.36 m.
  const double quarter = std::numbers::pi / 4;
  const double overlap = overlap_m(kCube, at(0, 0, 0, turned(quarter, Vector::UnitX())), kCube,
                                   at(0, 0, 1.4, turned(quarter, Vector::UnitY())));
  CHECK(overlap == Approx(std::sqrt(2.0) - 1.4).margin(kPlacesRounding));
}

TEST_CASE("spheres overlap by their radii less their distance") {
  CHECK(overlap_m(kBall, at(0, 0, 0), Shape::sphere(0.25), at(0.3, 0, 0.4)) ==
        Approx(0.25).margin(kPlacesRounding));
}

TEST_CASE("a sphere overlaps a box's corner, its face, and its inside") {
  // Beyond the corner by 0.2 along each axis; above a face by 0.4; below a face by 0.1.
  CHECK(overlap_m(kBall, at(0.7, 0.7, 0.7), kCube, at(0, 0, 0)) ==
        Approx(0.5 - 0.2 * std::sqrt(3.0)).margin(kPlacesRounding));
  CHECK(overlap_m(kBall, at(0.1, 0.2, 0.9), kCube, at(0, 0, 0)) ==
        Approx(0.1).margin(kPlacesRounding));
  CHECK(overlap_m(kBall, at(0.1, 0.2, 0.4), kCube, at(0, 0, 0)) ==
        Approx(0.6).margin(kPlacesRounding));
}

TEST_CASE("an overlap does not depend on which shape comes first") {
  const Pose corner = at(0.2, 0.1, 0.7, on_its_corner());
  for (const Shape& other : {kBall, kFloor, Shape::half_space()}) {
    CHECK(overlap_m(kCube, corner, other, at(0, 0, 0)) ==
          Approx(overlap_m(other, at(0, 0, 0), kCube, corner)).margin(kPlacesRounding));
  }
}

TEST_CASE("what has no volume overlaps nothing") {
  CHECK(overlap_m(Shape::none(), at(0, 0, 0), kCube, at(0, 0, 0)) < 0);
  CHECK(overlap_m(Shape::half_space(), at(0, 0, 0), Shape::half_space(), at(0, 0, 0)) < 0);
}

TEST_CASE("the grid finds the pairs that a look at all pairs finds") {
  const Scene scene = cloud(300);
  const std::vector<BodyState> states = start_of(scene);
  Penetration expected;
  for (std::size_t i = 0; i < states.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (i % 3 == 0 && j % 3 == 0) continue;  // both static
      const auto pose = [&](std::size_t k) -> Pose {
        return {to_eigen(states[k].p_WBo), to_eigen(states[k].q_WB).toRotationMatrix()};
      };
      const double depth =
          overlap_m(scene.bodies[i].shape, pose(i), scene.bodies[j].shape, pose(j));
      if (depth <= 0) continue;
      ++expected.pairs;
      expected.max_m = std::max(expected.max_m, depth);
      expected.mean_m += depth;
    }
  }
  expected.mean_m /= static_cast<double>(expected.pairs);

  const Penetration found = PenetrationCheck(scene).look(states);
  CHECK(found.pairs == expected.pairs);
  CHECK(found.max_m == Approx(expected.max_m).margin(kPlacesRounding));
  CHECK(found.mean_m == Approx(expected.mean_m).margin(kPlacesRounding));
}

TEST_CASE("a floor far larger than the bodies is held against each of them") {
  Scene scene;
  for (const double x : {-60.0, 0.0, 60.0}) {
    BodySpec cube;
    cube.shape = kCube;
    cube.p_WBo = {x, 0, 0.49};
    scene.bodies.push_back(cube);
  }
  BodySpec floor;
  floor.kind = BodyKind::fixed;
  floor.shape = kFloor;
  floor.p_WBo = {0, 0, -10};
  scene.bodies.push_back(floor);
  const Penetration found = PenetrationCheck(scene).look(start_of(scene));
  CHECK(found.pairs == 3);
  CHECK(found.mean_m == Approx(0.01).margin(kPlacesRounding));
}

TEST_CASE("every convex shape overlaps the floor by what it is sunk into it") {
  const Matrix lying = turned(std::numbers::pi / 2, Vector::UnitY());
  const Solid space = Shape::half_space(), floor = kFloor;
  const auto check = [&](const Solid& solid, double height, const Matrix& R) {
    CHECK(overlap_m(solid, at(0.1, 0.2, height - 0.01, R), space, {}) ==
          Approx(0.01).margin(kPlacesRounding));
    CHECK(overlap_m(solid, at(0.1, 0.2, height - 0.01, R), floor, at(0, 0, -10)) ==
          Approx(0.01).margin(1e-10));
    CHECK(overlap_m(floor, at(0, 0, -10), solid, at(0.1, 0.2, height + 0.01, R)) < 0);
  };
  check(Shape::capsule(0.2, 0.5), 0.2, lying);
  check(Shape::cylinder(0.3, 0.5), 0.3, lying);
  check(Shape::cylinder(0.3, 0.5), 0.5, turned(0, Vector::UnitX()));
  check(Shape::cone(0.3, 0.5), 0.5, turned(0, Vector::UnitX()));
  check(Shape::ellipsoid({0.5, 0.3, 0.2}), 0.5, lying);
  std::vector<Vector> corners;
  for (int k = 0; k < 8; ++k)
    corners.emplace_back(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
  check(Solid(make_hull(corners).geometry), std::sqrt(3.0) / 2, on_its_corner());
}

TEST_CASE("a compound overlaps by the part that overlaps most, a hull of a scene by itself") {
  Scene scene = parse_scene(R"(
[[body]]
shape = "compound"
position_m = [0, 0, 1]
[[body.part]]
shape = "sphere"
radius_m = 0.2
position_m = [0, 0, -0.9]
[[body.part]]
shape = "box"
half_extents_m = [0.2, 0.2, 0.1]
position_m = [0, 0, 0.95]
orientation_wxyz = [0, 1, 0, 0]
[[body]]
shape = "hull"
position_m = [0, 0, 2.33]
points_m = [[0, 0, -0.3], [1, 0, 0.5], [-1, 1, 0.5], [-1, -1, 0.5]]
[[body]]
kind = "static"
shape = "half_space"
)",
                            "test");
  const Penetration found = PenetrationCheck(scene).look(start_of(scene));
  CHECK(found.pairs == 2);
  CHECK(found.max_m == Approx(0.1).margin(kPlacesRounding));  // the ball in the half-space
  CHECK(found.mean_m ==
        Approx(0.06).margin(kPlacesRounding));  // the hull's tip in the box's top: 0.02
}

TEST_CASE("a pose that is not a number is a penetration that is not a number") {
  const Scene scene = cloud(4);
  std::vector<BodyState> states = start_of(scene);
  states[2].q_WB.x = std::numeric_limits<double>::quiet_NaN();
  const Penetration found = PenetrationCheck(scene).look(states);
  CHECK(std::isnan(found.max_m));
  CHECK(std::isnan(found.mean_m));
}
