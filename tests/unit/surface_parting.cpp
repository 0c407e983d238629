// How deep bodies are in meshes and height fields, by support functions and the triangles alone.
#include "server/collision/manifolds.h"
#include "tests/physics/terrains.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/trials.h"

using namespace cradle;

namespace {

double low_bumps(double x, double y) {
  return 0.15 * std::sin(1.7 * x) * std::cos(2.1 * y + 0.3 * x);
}

/// The point of all manifolds that is deepest.
struct LowestPoint {
  double separation = std::numeric_limits<double>::infinity();
  Vector n = Vector::Zero();          ///< up from the ground
  Vector on_ground = Vector::Zero();  ///< the two points that touch first as the body comes down
  Vector on_body = Vector::Zero();
};

LowestPoint look(const GeometryPointer& ground, const Solid& body, const Pose& X) {
  std::vector<Manifold> manifolds;
  add_manifolds({Shape::stored(ground->kind(), 1), {}, ground.get()},
                {body.shape, X, body.geometry.get()}, kMargin, manifolds);
  LowestPoint deepest;
  for (const Manifold& m : manifolds) {
    for (const ContactPoint& p : points(m)) {
      if (p.separation >= deepest.separation) continue;
      const Vector half = 0.5 * p.separation * m.normal_W;
      deepest = {p.separation, m.normal_W, p.p_W - half, p.p_W + half};
    }
  }
  return deepest;
}

/// A body over the ground, down until it is in it by less than 5 mm.
Pose sunk_into(Random& random, const GeometryPointer& ground, const Solid& body) {
  Pose X{{random.uniform(-1, 1), random.uniform(-1, 1), 0}, random.rotation()};
  double low = -0.2, high = 0.2;
  const double reach = support(body, X, -Vector::UnitZ());
  for (int k = 0; k < 24; ++k) {
    X.x.z() = reach + 0.5 * (low + high);
    const double separation = look(ground, body, X).separation;
    if (separation < 0 && separation > -0.005) break;
    (separation < 0 ? low : high) = 0.5 * (low + high);
  }
  return X;
}

/// m: how far a point is from the triangle over or under it, across that.
double off(const TriangleMesh& mesh, const Vector& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const Triangle& t : mesh.triangles) {
    const auto corner = [&](std::size_t k) {
      return mesh.vertices[static_cast<std::size_t>(t[k])];
    };
    const Vector a = corner(0), b = corner(1), c = corner(2), n = (b - a).cross(c - a);
    const auto turn = [&](const Vector& u, const Vector& v) {
      return (v - u).head<2>().x() * (p - u).y() - (v - u).y() * (p - u).x();
    };
    constexpr double kRounding = -1e-9;
    if (std::min({turn(a, b), turn(b, c), turn(c, a)}) < kRounding) continue;
    least = std::min(least, std::abs(n.normalized().dot(p - a)));
  }
  return least;
}

}  // namespace

TEST_CASE("the deepest point on terrain is on both, and as deep as the body reaches there") {
  const Surface ground = terrain(16, 0.25, 0.3, low_bumps);
  const GeometryPointer mesh = mesh_of(ground).geometry;
  Random random(5);
  int sunk_in = 0, in_one_manifold = 0, over_edge = 0;
  for (int trial = 0; trial < trials(4000); ++trial) {
    const Solid body = random.solid(kConvex[static_cast<std::size_t>(trial) % kConvex.size()]);
    CAPTURE(trial, word_of(body.shape.kind));
    const Pose X = sunk_into(random, mesh, body);
    const LowestPoint deepest = look(mesh, body, X);
    if (!(deepest.separation < 0 && deepest.separation > -0.005)) continue;
    ++sunk_in;
    const double off_ground = off(std::get<TriangleMesh>(mesh->value), deepest.on_ground);
    const double above_lowest = deepest.n.dot(deepest.on_body) + support(body, X, -deepest.n);
    // Contacts whose normals are 0.6 degrees apart share the normal of one of them.
    REQUIRE(off_ground < 0.01 * 0.005);
    REQUIRE(above_lowest > -1e-7);
    in_one_manifold += off_ground > 1e-9 || above_lowest < -1e-9;
    // The body reaches farther beside the triangle, where the ground is lower.
    over_edge += above_lowest > 1e-9;
    REQUIRE(outside(body, X, deepest.on_body) < 1e-4);
  }
  CAPTURE(sunk_in, in_one_manifold, over_edge);
  CHECK(sunk_in > trials(3000));
  CHECK(in_one_manifold <= sunk_in / 1000);
  CHECK(over_edge <= sunk_in / 100);
}

TEST_CASE("what is sunk in terrain is out of it when moved by the depths") {
  const Surface ground = terrain(16, 0.25, 0.3, low_bumps);
  std::vector<double> heights;
  for (int i = 0; i <= 16; ++i) {
    for (int j = 0; j <= 16; ++j) heights.push_back(low_bumps(0.25 * (j - 8), 0.25 * (i - 8)));
  }
  for (const GeometryPointer& surface :
       {mesh_of(ground).geometry, make_height_field(17, 17, 0.25, 0.25, heights).geometry}) {
    Random random(6);
    int sunk_in = 0, at_once = 0;
    for (int trial = 0; trial < trials(4000); ++trial) {
      const Solid body = random.solid(kConvex[static_cast<std::size_t>(trial) % kConvex.size()]);
      CAPTURE(trial, word_of(body.shape.kind));
      Pose X = sunk_into(random, surface, body);
      double depth = -look(surface, body, X).separation;
      if (!(depth > 0 && depth < 0.005)) continue;
      ++sunk_in;
      int moves = 0;
      for (; depth > 1e-6 && moves < 8; ++moves) {  // there may be more than one side to leave by
        const LowestPoint deepest = look(surface, body, X);
        X.x += deepest.n * -deepest.separation;
        depth = -look(surface, body, X).separation;
      }
      REQUIRE(depth <= 1e-6);
      at_once += moves == 1;
    }
    CAPTURE(sunk_in, at_once);
    CHECK(sunk_in > trials(3000));
    CHECK(at_once > sunk_in / 100 * 98);
  }
}
