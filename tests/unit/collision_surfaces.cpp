// Convex shapes on meshes and height fields: against every single triangle, against the solid that
// a mesh stands for, and what holds for the manifolds of any pair.
#include <map>

#include "server/collision/bounds.h"
#include "server/collision/convex_pair.h"
#include "server/collision/manifolds.h"
#include "server/collision/surface.h"
#include "tests/physics/terrains.h"
#include "tests/unit/collision_pairs.h"

using namespace cradle;

namespace {

double bumps(double x, double y) { return 0.3 * std::sin(1.7 * x) * std::cos(2.1 * y + 0.3 * x); }

std::vector<Manifold> touch(const Solid& ground, const Pose& X_WS, const Solid& body,
                            const Pose& X_WC, double margin = kMargin) {
  std::vector<Manifold> manifolds;
  add_manifolds({ground.shape, X_WS, ground.geometry.get()},
                {body.shape, X_WC, body.geometry.get()}, margin, manifolds);
  return manifolds;
}

Solid solid_of(const GeometryPointer& geometry) {
  Solid solid(geometry);
  solid.shape = Shape::stored(geometry->kind(), 1);
  return solid;
}

double least_separation(const std::vector<Manifold>& manifolds) {
  double least = std::numeric_limits<double>::infinity();
  for (const Manifold& m : manifolds) least = std::min(least, -deepest(m));
  return least;
}

/// A body over the terrain, moved down until its lowest point along z is near the ground.
Pose pose_over(Random& random, const Solid& body) {
  Pose X{{random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5), 0}, random.rotation()};
  X.x.z() =
      support(body, X, -Vector::UnitZ()) + bumps(X.x.x(), X.x.y()) + random.uniform(-0.1, 0.3);
  return X;
}

/// By closest points with each triangle; the normal is from it to the body.
struct Nearest {
  double distance = std::numeric_limits<double>::infinity();
  Vector normal = Vector::Zero();
};
Nearest nearest_of_all(const TriangleMesh& mesh, const SurfaceView& surface, const Solid& body,
                       const Pose& X) {
  Nearest nearest;
  const ConvexShape convex(Collider{body.shape, X, body.geometry.get()});
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const SurfaceTriangle triangle = surface.triangle(static_cast<std::int32_t>(t));
    const ConvexShape flat(triangle);
    const Pose in_S;
    const ConvexPair pair(flat, in_S, convex, X);
    Simplex simplex;
    SupportHints hints;
    const Closest found = closest(pair, Vector::Zero(), Vector::UnitZ(),
                                  std::numeric_limits<double>::infinity(), simplex, hints);
    const double distance =
        found.kind == Closest::Kind::apart ? found.distance - convex.radius : -1;
    if (distance < nearest.distance) nearest = {distance, found.n};
  }
  return nearest;
}

}  // namespace

TEST_CASE("the nearest of all triangles is found, with its direction") {
  const GeometryPointer ground = mesh_of(terrain(16, 0.25, 0.3, bumps)).geometry;
  const auto& mesh = std::get<TriangleMesh>(ground->value);
  const Solid terrain_solid = solid_of(ground);
  const Pose in_W;
  const SurfaceView surface(Collider{terrain_solid.shape, in_W, ground.get()});
  Random random(3);
  for (const ShapeKind kind : kConvex) {
    int compared = 0;
    for (int trial = 0; trial < 4000 && compared < 150; ++trial) {
      CAPTURE(word_of(kind), trial);
      const Solid body = random.solid(kind);
      const Pose X = pose_over(random, body);
      const Nearest nearest = nearest_of_all(mesh, surface, body, X);
      if (!(nearest.distance > 1e-5 && nearest.distance < kMargin)) continue;
      if (nearest.normal.z() < 0.1) continue;  // from behind, or beside the border
      ++compared;
      const std::vector<Manifold> manifolds = touch(terrain_solid, {}, body, X);
      REQUIRE(!manifolds.empty());
      REQUIRE(std::abs(least_separation(manifolds) - nearest.distance) < 1e-6);
      const bool has_normal = std::ranges::any_of(manifolds, [&](const Manifold& m) {
        return (m.normal_W - nearest.normal).norm() < 1e-2;  // nearly equal ones share a manifold
      });
      REQUIRE(has_normal);
    }
    CHECK(compared >= 100);
  }
}

TEST_CASE("manifolds on terrain are sound, and the same wherever both are") {
  const Solid ground = solid_of(mesh_of(terrain(16, 0.25, 0.3, bumps)).geometry);
  Random random(4);
  int touching = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const Solid body = random.solid(kConvex[static_cast<std::size_t>(trial) % kConvex.size()]);
    CAPTURE(trial, word_of(body.shape.kind));
    const Pose X = pose_over(random, body);
    const std::vector<Manifold> here = touch(ground, {}, body, X);
    std::set<std::uint64_t> parts;
    for (const Manifold& m : here) {
      REQUIRE(std::abs(m.normal_W.norm() - 1) < 1e-12);
      REQUIRE(m.count >= 1);
      REQUIRE(m.count <= kManifoldPoints);
      REQUIRE(features(m).size() == static_cast<std::size_t>(m.count));
      REQUIRE(parts.insert(m.part).second);
      // No deeper than the body reaches along the normal.
      for (const ContactPoint& p : points(m)) {
        REQUIRE(p.separation <= kMargin);
        REQUIRE(p.p_W.allFinite());
        REQUIRE(outside(body, X, p.p_W) <= std::abs(p.separation) + kTolerances.clip_slack_m);
      }
    }
    touching += !here.empty();

    const Pose Y{random.vector(3), random.rotation()};
    const Pose Y_X{Y.x + Y.R * X.x, Y.R * X.R};
    const std::vector<Manifold> there = touch(ground, Y, body, Y_X);
    REQUIRE(there.size() == here.size());
    if (!here.empty()) REQUIRE(std::abs(least_separation(there) - least_separation(here)) < 1e-7);
    const std::vector<Manifold> swapped = [&] {
      std::vector<Manifold> m;
      add_manifolds({body.shape, X, body.geometry.get()}, {ground.shape, {}, ground.geometry.get()},
                    kMargin, m);
      return m;
    }();
    REQUIRE(swapped.size() == here.size());
    for (std::size_t k = 0; k < here.size(); ++k) REQUIRE(swapped[k].normal_W == -here[k].normal_W);
  }
  CHECK(touching > 1000);
}

TEST_CASE("a height field is the mesh of its triangles") {
  constexpr int n = 12;
  std::vector<double> heights;
  for (int row = 0; row <= n; ++row) {
    for (int column = 0; column <= n; ++column)
      heights.push_back(bumps(0.3 * (column - 6), 0.25 * (row - 6)));
  }
  const Solid field = solid_of(make_height_field(n + 1, n + 1, 0.3, 0.25, heights).geometry);
  Surface grid;
  for (int row = 0; row <= n; ++row) {
    for (int column = 0; column <= n; ++column)
      grid.vertices.emplace_back(0.3 * (column - 6), 0.25 * (row - 6),
                                 bumps(0.3 * (column - 6), 0.25 * (row - 6)));
  }
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      const int a = row * (n + 1) + column;
      grid.triangles.push_back({a, a + 1, a + n + 2});
      grid.triangles.push_back({a, a + n + 2, a + n + 1});
    }
  }
  const Solid mesh = solid_of(mesh_of(grid).geometry);
  const Pose in_W;
  const SurfaceView of_field(Collider{field.shape, in_W, field.geometry.get()});
  const SurfaceView of_mesh(Collider{mesh.shape, in_W, mesh.geometry.get()});
  for (std::int32_t t = 0; t < 2 * n * n; ++t) {
    const SurfaceTriangle a = of_field.triangle(t), b = of_mesh.triangle(t);
    for (std::size_t k = 0; k < 3; ++k) {
      REQUIRE((a.corners[k] - b.corners[k]).norm() < 1e-12);
      REQUIRE(of_field.neighbour(a, k) == of_mesh.neighbour(b, k));
      REQUIRE(of_field.edge_kind(a, k) == of_mesh.edge_kind(b, k));
    }
  }
  Random random(5);
  for (int trial = 0; trial < 1500; ++trial) {
    CAPTURE(trial);
    const Solid body = random.solid(kConvex[static_cast<std::size_t>(trial) % kConvex.size()]);
    const Pose X = pose_over(random, body);
    const auto on_field = touch(field, {}, body, X), on_mesh = touch(mesh, {}, body, X);
    if (on_mesh.empty()) continue;  // the field may push out what is under it
    REQUIRE(!on_field.empty());
    const Vector c = X.x + X.R * ConvexShape(Collider{body.shape, X, body.geometry.get()}).centre;
    const std::int32_t under = of_field.triangle_at(c.x(), c.y());
    const SurfaceTriangle t = of_field.triangle(std::max(under, 0));
    const bool is_pushed_out = under >= 0 && t.normal.dot(c - t.corners[0]) < 0;
    if (!is_pushed_out)
      REQUIRE(std::abs(least_separation(on_field) - least_separation(on_mesh)) < 1e-9);
  }
}

TEST_CASE("queries of a mesh and of a height field find all triangles whose boxes they meet") {
  std::vector<double> heights;
  for (int i = 0; i < 17 * 23; ++i) heights.push_back(bumps(0.2 * (i % 23), 0.3 * (i / 23)));
  const std::array<Solid, 2> grounds = {
      solid_of(mesh_of(terrain(16, 0.25, 0.3, bumps)).geometry),
      solid_of(make_height_field(17, 23, 0.2, 0.3, heights).geometry)};
  const std::array<std::int32_t, 2> counts = {2 * 16 * 16, 2 * 16 * 22};
  Random random(6);
  for (std::size_t g = 0; g < 2; ++g) {
    const Pose in_W;
    const SurfaceView surface(Collider{grounds[g].shape, in_W, grounds[g].geometry.get()});
    for (int trial = 0; trial < 500; ++trial) {
      const Vector middle = random.vector(3), half = random.vector(1).cwiseAbs();
      const Aabb box{middle - half, middle + half};
      std::set<std::int32_t> found;
      surface.for_each_in(box, [&](std::int32_t t) { REQUIRE(found.insert(t).second); });
      for (std::int32_t t = 0; t < counts[g]; ++t) {
        const auto p = surface.triangle(t).corners;
        const Aabb own{p[0].cwiseMin(p[1]).cwiseMin(p[2]), p[0].cwiseMax(p[1]).cwiseMax(p[2])};
        if (own.overlaps(box)) REQUIRE(found.contains(t));
      }
    }
  }
}

TEST_CASE("a mesh of a cube behaves as the cube") {
  const Solid mesh = solid_of(mesh_of(box_surface({1, 0.8, 0.6})).geometry);
  const Solid box = Shape::box({1, 0.8, 0.6});
  const Solid hull(make_hull(box_surface({1, 0.8, 0.6}).vertices).geometry);
  Random random(8);
  for (const ShapeKind kind : kConvex) {
    int compared = 0, missed = 0;
    for (int trial = 0; trial < 6000 && compared < 300; ++trial) {
      CAPTURE(word_of(kind), trial);
      Pair pair = random.pair(kind, ShapeKind::box);
      pair.B = kind == ShapeKind::box ? hull : box;  // box against box prefers faces
      pair.X_WB = {};
      const Vector n0 = random.direction();
      pair.X_WA.x = n0 * 2;
      const Vector n = pair.collide(10).normal_W;
      pair.X_WA.x -= n * (overlap(pair, n) - random.uniform(-0.015, 0.002));
      const Manifold expected = pair.collide(kMargin);
      if (expected.count == 0) continue;
      ++compared;
      const std::vector<Manifold> found = touch(mesh, {}, pair.A, pair.X_WA);
      // Each edge and face is looked at alone, so that near corners others than the least overlap
      // of the whole may be added, or found instead; hardly deeper ones.
      const double least = -deepest(expected);
      const bool is_found = std::ranges::any_of(
          found, [&](const Manifold& m) { return std::abs(least + deepest(m)) < 1e-6; });
      missed += !is_found;
      const ConvexShape shape(Collider{pair.A.shape, pair.X_WA, pair.A.geometry.get()});
      REQUIRE(!found.empty());
      REQUIRE(least_separation(found) > std::min(2 * least, 0.0) - 0.1 * shape.thickness - 2e-3);
      if (kind == ShapeKind::sphere) {
        REQUIRE(found.size() == 1);
        REQUIRE((found[0].normal_W + expected.normal_W).norm() < 1e-9);
        REQUIRE((found[0].points[0].p_W - expected.points[0].p_W).norm() < 1e-9);
      }
    }
    CHECK(compared >= 200);
    CAPTURE(word_of(kind));
    CHECK(missed <= (kind == ShapeKind::sphere ? 0 : compared / 50));
  }
  // A cube flush on it, overhanging: the same four points.
  const Solid cube = Shape::box({0.5, 0.5, 0.5});
  const Pose X{{0.7, 0.5, 1.1 - 1e-4}, turn(0.4, Vector::UnitZ())};
  const std::vector<Manifold> flush = touch(mesh, {}, cube, X);
  REQUIRE(flush.size() == 1);
  CHECK(flush[0].count == 4);
  const Manifold expected = Pair{box, cube, {}, X}.collide(kMargin);
  for (const ContactPoint& p : points(flush[0])) {
    CHECK(p.separation == Approx(-1e-4));
    CHECK(outside(box, {}, p.p_W) < 1e-3);
    CHECK(outside(cube, X, p.p_W) < 1e-3);
  }
  CHECK(expected.count == 4);
}

TEST_CASE("neighbours that are nearly in one plane make one manifold") {
  const auto nearly_flat = [](double x, double y) { return 1e-3 * std::sin(3 * x + 2 * y); };
  const Solid ground = solid_of(mesh_of(terrain(8, 0.5, 0.3, nearly_flat)).geometry);
  Random random(9);
  for (int trial = 0; trial < 100; ++trial) {
    const Pose X{{random.uniform(-1, 1), random.uniform(-1, 1), 0.3},
                 turn(random.uniform(0, 3), Vector::UnitZ())};
    const std::vector<Manifold> found = touch(ground, {}, Shape::box({0.6, 0.4, 0.3}), X);
    REQUIRE(found.size() == 1);
    REQUIRE(found[0].count == 4);
    const std::set<std::uint32_t> corners = features(found[0]);
    for (std::uint32_t k = 0; k < 4; ++k) {
      CAPTURE(k);
      REQUIRE(std::ranges::any_of(corners, [](std::uint32_t f) { return f >> 30 == 1; }));
    }
  }
}

TEST_CASE("manifolds of one direction keep their numbers when another one is the deepest") {
  // Numbered by depth, two that took turns gave each other what their points had carried.
  const GeometryPointer ground = mesh_of(terrain(2, 4.0, 0, [](double x, double y) {
                                   return 0.02 * std::abs(x) + 0.2 * y;
                                 })).geometry;
  const Solid box(Shape::box({0.5, 0.5, 0.5}));
  std::map<std::uint32_t, std::uint64_t> parts[2];
  std::uint32_t first[2];
  for (const std::size_t side : {0u, 1u}) {
    Pose X{{0, 0, 0},
           (Eigen::AngleAxisd(std::atan(0.2), Vector::UnitX()) *
            Eigen::AngleAxisd(side == 0 ? 1e-5 : -1e-5, Vector::UnitY()))
               .toRotationMatrix()};
    X.x = 0.508 * X.R.col(2);
    const std::vector<Manifold> manifolds = touch(solid_of(ground), {}, box, X);
    REQUIRE(manifolds.size() == 2);
    CHECK(manifolds[0].part >> 28 == manifolds[1].part >> 28);
    first[side] = manifolds[0].points[0].feature;
    for (const Manifold& m : manifolds) {
      for (int k = 0; k < m.count; ++k) {
        parts[side][m.points[static_cast<std::size_t>(k)].feature] = m.part;
      }
    }
  }
  CHECK(first[0] != first[1]);  // the deepest is the other one
  CHECK(parts[0] == parts[1]);
}

TEST_CASE("an open mesh lets through what comes from behind, a closed one and a field do not") {
  const Solid sheet = solid_of(mesh_of(terrain(8, 0.5, 0.3, flat)).geometry);
  const Solid field = solid_of(make_height_field(9, 9, 4, 4, std::vector<double>(81, 0)).geometry);
  const Solid block = solid_of(mesh_of(box_surface({1, 0.8, 0.6})).geometry);
  Random random(10);
  for (const ShapeKind kind : kConvex) {
    for (int trial = 0; trial < 100; ++trial) {
      CAPTURE(word_of(kind), trial);
      const Solid body = random.solid(kind);
      Pose X{random.vector(0.5), random.rotation()};
      X.x.z() = -support(body, {{0, 0, 0}, X.R}, Vector::UnitZ()) + 0.01;  // pokes through
      if (X.R.row(2).dot(ConvexShape(Collider{body.shape, X, body.geometry.get()}).centre) +
              X.x.z() >=
          0)
        continue;
      CHECK(touch(sheet, {}, body, X).empty());
      const std::vector<Manifold> pushed = touch(field, {}, body, X);
      REQUIRE(pushed.size() == 1);
      CHECK(pushed[0].normal_W.z() == 1);
      CHECK(deepest(pushed[0]) == Approx(support(body, X, -Vector::UnitZ())));
    }
  }
  // Well inside, by the nearest face.
  const std::vector<Manifold> out =
      touch(block, {}, Shape::sphere(0.1), {{0.1, 0.6, 0.2}, Matrix::Identity()});
  REQUIRE(out.size() == 1);
  CHECK((out[0].normal_W - Vector(0, 1, 0)).norm() < 1e-12);
  CHECK(deepest(out[0]) == Approx(0.2 + 0.1));
}

TEST_CASE(
    "what is pressed through an open mesh by no more than half its thickness is pushed back") {
  const Solid sheet = solid_of(mesh_of(terrain(8, 0.5, 0.3, flat)).geometry);
  Random random(12);
  for (const ShapeKind kind : kConvex) {
    for (int trial = 0; trial < 50; ++trial) {
      CAPTURE(word_of(kind), trial);
      const Solid body = random.solid(kind);
      const Vector at{random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5), 0.0};
      Pose X{at, random.rotation()};
      const ConvexShape shape(Collider{body.shape, X, body.geometry.get()});
      X.x -= X.R * shape.centre;
      X.x.z() -= 0.45 * shape.thickness;
      const std::vector<Manifold> pushed = touch(sheet, {}, body, X);
      REQUIRE(pushed.size() == 1);
      CHECK(pushed[0].normal_W.z() == Approx(1));
      CHECK(deepest(pushed[0]) == Approx(support(body, X, -Vector::UnitZ())));
      X.x.z() -= 0.1 * shape.thickness;
      CHECK(touch(sheet, {}, body, X).empty());
      // Beside the border there is nothing to be pushed to.
      X.x.z() += 0.1 * shape.thickness;
      X.x.x() += 2.01 + support(body, X, -Vector::UnitX());
      for (const Manifold& m : touch(sheet, {}, body, X)) CHECK(std::abs(m.normal_W.z()) < 1);
    }
  }
}

TEST_CASE("slivers have the normal of the neighbour they belong to") {
  // A plane with a seam of triangles without area: two rows that do not share vertices.
  Surface s;
  s.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 0, 0}, {0.3, 0, 0}, {-1, 0, 0}, {1, 1, 0}, {-1, 1, 0}};
  s.triangles = {{0, 1, 2}, {0, 2, 4}, {2, 3, 4}, {2, 5, 3}, {3, 5, 6}, {3, 6, 4}};
  const MadeGeometry made = mesh_of(s);
  REQUIRE(made.geometry);
  const auto& mesh = std::get<TriangleMesh>(made.geometry->value);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    CHECK(mesh.normals[t] == Vector(0, 0, 1));
    for (const EdgeKind kind : mesh.edges[t]) CHECK(kind != EdgeKind::ridge);
  }
  const Solid ground = solid_of(made.geometry);
  Random random(12);
  for (int trial = 0; trial < 300; ++trial) {
    const Pose X{{random.uniform(-0.5, 0.5), random.uniform(-0.3, 0.3), 0.199},
                 turn(random.uniform(0, 3), Vector::UnitZ())};
    const std::vector<Manifold> found = touch(ground, {}, Shape::box({0.3, 0.2, 0.2}), X);
    REQUIRE(found.size() == 1);
    REQUIRE(found[0].count == 4);
    REQUIRE(touch(ground, {}, Shape::sphere(0.2), X).size() == 1);
  }
}

TEST_CASE("height fields that are none are refused with a reason") {
  const auto fault = [](int rows, int columns, double dx, std::vector<double> heights) {
    const MadeGeometry made = make_height_field(rows, columns, dx, 1, std::move(heights));
    CHECK(!made.geometry);
    return made.fault;
  };
  CHECK(fault(1, 2, 1, {0, 0}) == "has fewer than two rows or columns");
  CHECK(fault(2, 2, 1, {0, 0, 0}) == "has 3 heights for 2 rows of 2");
  CHECK(fault(2, 2, 0, {0, 0, 0, 0}) == "has cells that are too small");
  CHECK(fault(2, 2, NAN, {0, 0, 0, 0}) == "has cells that are too small");
  CHECK(fault(2, 2, 1e7, {0, 0, 0, 0}) == "is too large");
  CHECK(fault(2, 2, 1, {0, 0, NAN, 0}) ==
        "has in row 1, column 0, a height that is out of range or no number");
  CHECK(fault(40000, 40000, 1, {}) == "has too many heights");
}
