// Convex shapes on surfaces of few large triangles, at what is between them: slivers, inner edges
// and valleys. Each was a fault of ours once.
#include "server/collision/manifolds.h"
#include "server/collision/stored_geometry.h"
#include "tests/unit/collision_pairs.h"

using namespace cradle;

namespace {

std::vector<Manifold> touch_ground(const GeometryPointer& ground, const Solid& body,
                                   const Pose& X_WC, double margin = kMargin) {
  std::vector<Manifold> manifolds;
  const Shape shape = Shape::stored(ground->kind(), 1);
  const Pose in_W;
  add_manifolds({shape, in_W, ground.get()}, {body.shape, X_WC, body.geometry.get()}, margin,
                manifolds);
  return manifolds;
}

double deepest_of(const std::vector<Manifold>& manifolds) {
  double depth = -1;
  for (const Manifold& m : manifolds) depth = std::max(depth, deepest(m));
  return depth;
}

GeometryPointer creased_mesh(const std::vector<Vector>& vertices,
                             const std::vector<Triangle>& triangles) {
  return make_mesh(vertices, triangles).geometry;
}

/// z = slope |x|, 12 m wide.
GeometryPointer valley(double slope) {
  std::vector<Vector> vertices;
  for (const double x : {-6.0, 0.0, 6.0}) {
    for (const double y : {-6.0, 6.0}) vertices.emplace_back(x, y, slope * std::abs(x));
  }
  return creased_mesh(vertices, {{0, 2, 3}, {0, 3, 1}, {2, 4, 5}, {2, 5, 3}});
}

}  // namespace

TEST_CASE("two slivers that share their longest edge carry") {
  // Each asked the other for a normal, so neither had one, and balls fell through.
  for (const double size : {1.0, 10.0, 100.0}) {
    for (const double width : {1e-8, 1e-7, 1e-6, 1e-5, 1e-4}) {
      CAPTURE(size, width);
      const GeometryPointer plane =
          creased_mesh({{-size, 0, 0},
                        {size, 0, 0},
                        {0.1 * size, width, 0},
                        {-0.1 * size, -width, 0},
                        {0, size, 0},
                        {0, -size, 0}},
                       {{0, 1, 2}, {1, 0, 3}, {0, 2, 4}, {2, 1, 4}, {0, 5, 3}, {3, 5, 1}});
      REQUIRE(plane);
      const auto manifolds = touch_ground(plane, Shape::sphere(0.1 * size),
                                          {{0, width / 3, 0.09 * size}, Matrix::Identity()});
      REQUIRE(manifolds.size() == 1);
      CHECK(manifolds[0].normal_W.isApprox(Vector(Vector::UnitZ()), 1e-9));
      CHECK(deepest_of(manifolds) == Approx(0.01 * size).epsilon(1e-9));
    }
  }
}

TEST_CASE("what lies nearly flat over an inner edge touches under itself alone") {
  // The far end of the edge, metres away, was taken for a point that touches.
  const GeometryPointer mesh =
      creased_mesh({{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}}, {{0, 1, 2}, {0, 2, 3}});
  const GeometryPointer field =
      make_height_field(2, 2, 4, 4, std::vector<double>{0, 0, 0, 0}).geometry;
  Random random(5);
  const std::vector<Solid> bodies = {Shape::box({0.3, 0.2, 0.1}), Shape::cylinder(0.3, 0.1),
                                     Shape::cone(0.3, 0.2), Shape::capsule(0.1, 0.3)};
  int touching = 0;
  for (const GeometryPointer& ground : {mesh, field}) {
    for (const Solid& body : bodies) {
      for (int trial = 0; trial < 500; ++trial) {
        CAPTURE(ground == mesh, word_of(body.shape.kind), trial);
        const double tilt = std::pow(10, random.uniform(-5, -1.5));
        Pose X;
        X.R = Eigen::AngleAxisd(tilt, random.direction()) *
              Eigen::AngleAxisd(random.uniform(0, 7), Vector::UnitZ()).toRotationMatrix();
        if (body.shape.kind == ShapeKind::capsule) {
          X.R = X.R * Eigen::AngleAxisd(1.5707963267948966, Vector::UnitX());
        }
        X.x = {random.uniform(-1.4, 1.4), random.uniform(-1.4, 1.4), 0};
        X.x.z() = support(body, X, -Vector::UnitZ()) - random.uniform(-1e-3, 1e-2);
        for (const Manifold& m : touch_ground(ground, body, X)) {
          REQUIRE(m.normal_W.isApprox(Vector(Vector::UnitZ()), 1e-9));
          for (const ContactPoint& point : points(m)) {
            REQUIRE(outside(body, X, point.p_W) <= std::abs(point.separation) / 2 + 1.5e-3);
            ++touching;
          }
        }
      }
    }
  }
  CHECK(touching > 4000);
}

TEST_CASE("a tip behind the crease of a valley touches") {
  // It is over neither of the two triangles, seen along their normals: there was no contact.
  const Matrix tip_down = Eigen::AngleAxisd(3.1415926535897931, Vector::UnitX()).matrix();
  for (const double slope : {0.1, 0.5, 1.0}) {
    const GeometryPointer ground = valley(slope);
    const double cosine = 1 / std::sqrt(1 + slope * slope);
    for (const double depth : {1e-3, 5e-3, 0.01, 0.02}) {
      for (const double x : {-1e-3, -5e-5, 5e-5, 2e-4, 5e-4, 1e-3, 3e-3}) {
        CAPTURE(slope, depth, x);
        const double height = 0.06 + slope * std::abs(x) - depth;
        const auto manifolds =
            touch_ground(ground, Shape::cone(0.05, 0.06), {{x, 0, height}, tip_down});
        // Below the nearer plane by this, which parts it as well as any.
        CHECK(deepest_of(manifolds) == Approx(depth * cosine).margin(1e-9));
      }
    }
  }
}

TEST_CASE("what is in one side of a groove touches there, whatever else is near") {
  // The point was taken out, because the other side, not overlapped at all, told that the body was
  // not that deep: what spun in grooves hung there, and in the end went through.
  Random random(11);
  const std::vector<Solid> bodies = {Shape::capsule(0.05, 0.12), Shape::box({0.1, 0.15, 0.05}),
                                     Shape::cylinder(0.08, 0.1),
                                     Shape::ellipsoid({0.1, 0.15, 0.08})};
  int overlapping = 0;
  for (const double slope : {0.5, 1.0, 2.0}) {
    std::vector<double> heights;  // with a ridge at x = 1
    for (int row = 0; row < 5; ++row) {
      for (const double z : {2.0, 1.0, 0.0, 1.0, 0.0}) heights.push_back(slope * z);
    }
    const GeometryPointer ground = make_height_field(5, 5, 1, 1, heights).geometry;
    const Vector n = Vector(slope, 0, 1).normalized(), n_beyond(-n.x(), 0, n.z());
    for (const Solid& body : bodies) {
      for (int trial = 0; trial < 500; ++trial) {
        CAPTURE(slope, word_of(body.shape.kind), trial);
        Pose X{{-0.4, random.uniform(-0.3, 0.3), slope * 0.4}, random.rotation()};
        const auto depth = [&](const Vector& normal) {  // behind the plane through the crease
          return support(body, X, -normal);
        };
        X.x += n * (depth(n) - random.uniform(0.005, 0.04));
        if (depth(n_beyond) > -1e-3) continue;
        const std::vector<Manifold> manifolds = touch_ground(ground, body, X, 1);
        REQUIRE(std::abs(deepest_of(manifolds) - depth(n)) < 1e-9);
        ++overlapping;
      }
    }
  }
  CHECK(overlapping > 4000);
}
