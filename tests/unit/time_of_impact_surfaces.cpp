// The time of impact with meshes and height fields, against samples of the true motion: closest
// points with every triangle that the body begins in front of.
#include <numbers>

#include "server/collision/convex_pair.h"
#include "server/collision/extents.h"
#include "server/collision/surface.h"
#include "server/collision/time_of_impact.h"
#include "tests/physics/terrains.h"
#include "tests/unit/collision_pairs.h"

namespace cradle {
namespace {

double hilly(double x, double y) { return 0.3 * std::sin(1.7 * x) * std::cos(2.1 * y + 0.3 * x); }

/// 12 x 12 cells of 0.5 m.
GeometryPointer field_of_bumps() {
  std::vector<double> heights;
  for (int row = 0; row <= 12; ++row) {
    for (int column = 0; column <= 12; ++column)
      heights.push_back(hilly(0.5 * column - 3, 0.5 * row - 3));
  }
  return make_height_field(13, 13, 0.5, 0.5, heights).geometry;
}

Pose pose_at(const Path& path, const Pose& X, double time) {
  const double t = std::min(time, path.until), angle = path.turn.norm();
  Matrix R = Matrix::Identity();
  if (angle > 0) R = Eigen::AngleAxisd(t * angle, path.turn / angle).toRotationMatrix();
  return {path.x + t * path.travel + R * (X.x - path.x), R * X.R};
}

/// A convex body and a surface, on their ways.
struct Encounter {
  Collider surface, convex;
  Path path_S, path_C;
  std::vector<std::int32_t> ahead;  ///< triangles that the body begins in front of

  Encounter(const Collider& S, const Collider& C) : surface(S), convex(C) {
    path_S.x = S.X_WB.x;
    path_C.x = C.X_WB.x;
    const SurfaceView view(S);
    const Vector centre =
        S.X_WB.R.transpose() * (C.X_WB.x + C.X_WB.R * ConvexShape(C).centre - S.X_WB.x);
    const std::int32_t count = view.field() != nullptr
                                   ? 2 * (view.field()->rows - 1) * (view.field()->columns - 1)
                                   : static_cast<std::int32_t>(view.mesh()->triangles.size());
    for (std::int32_t t = 0; t < count; ++t) {
      const SurfaceTriangle triangle = view.triangle(t);
      if (triangle.normal.dot(centre - triangle.corners[0]) > 0) ahead.push_back(t);
    }
  }
  TimeOfImpact find() const { return time_of_impact({surface, path_S}, {convex, path_C}); }
  TimeOfImpact find_turned_round() const {
    return time_of_impact({convex, path_C}, {surface, path_S});
  }
  /// To the nearest of those triangles; 0: it overlaps one.
  double distance(double time) const {
    const Pose X_WS = pose_at(path_S, surface.X_WB, time),
               X_WC = pose_at(path_C, convex.X_WB, time);
    const Pose X_SC{X_WS.R.transpose() * (X_WC.x - X_WS.x), X_WS.R.transpose() * X_WC.R}, in_S;
    const SurfaceView view(surface);
    const ConvexShape body(Collider{convex.shape, X_SC, convex.geometry});
    double least = std::numeric_limits<double>::infinity();
    for (const std::int32_t t : ahead) {
      const SurfaceTriangle triangle = view.triangle(t);
      const ConvexShape flat(triangle);
      const ConvexPair pair(flat, in_S, body, X_SC);
      Simplex simplex;
      SupportHints hints;
      const Closest found = closest(pair, Vector::Zero(), Vector::UnitZ(),
                                    std::numeric_limits<double>::infinity(), simplex, hints);
      const double distance =
          found.kind == Closest::Kind::apart ? found.distance - body.radius : 0.0;
      least = std::min(least, distance);
    }
    return least;
  }
};

}  // namespace

TEST_CASE("before it meets a mesh or a height field, a body is in front of all that it was") {
  const std::vector<GeometryPointer> grounds = {mesh_of(terrain(12, 0.5, 0.3, hilly)).geometry,
                                                field_of_bumps()};
  Random random(61);
  int hits = 0, count = 0;
  for (const GeometryPointer& ground : grounds) {
    const Shape shape = Shape::stored(ground->kind(), 1);
    for (const ShapeKind kind : kConvex) {
      for (int k = 0; k < 25; ++k) {
        CAPTURE(word_of(ground->kind()), word_of(kind), k);
        const Solid body = random.solid(kind);
        const Pose X_WS{random.vector(2), random.rotation()};
        const Vector over{random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(1.5, 4)};
        const Pose X_WC{X_WS.x + X_WS.R * over, random.rotation()};
        Encounter both({shape, X_WS, ground.get()}, {body.shape, X_WC, body.geometry.get()});
        both.path_C.travel = X_WS.R * Vector{random.uniform(-2, 2), random.uniform(-2, 2), -4.0};
        if (k % 5 != 0) both.path_C.turn = random.uniform(0, 9) * random.direction();
        if (k % 3 == 0) {  // the ground moves, too
          both.path_S.travel = random.vector(1);
          both.path_S.turn = random.uniform(0, 0.5) * random.direction();
        }
        const TimeOfImpact found = both.find();
        const ImpactLengths lengths =
            impact_lengths(thickness(both.convex), std::numeric_limits<double>::infinity());
        CAPTURE(found.time, found.iterations, lengths.gap);
        REQUIRE(found.kind != TimeOfImpact::Kind::capped);
        ++count;
        hits += found.kind == TimeOfImpact::Kind::hit;
        for (int sample = 0; sample < 30 && !found.began_touching; ++sample) {
          const double time = found.time * (sample + random.uniform(0, 1)) / 30;
          CAPTURE(time);
          REQUIRE(both.distance(time) > lengths.gap - 1e-7);
        }
        if (found.kind == TimeOfImpact::Kind::hit) {
          REQUIRE(both.distance(found.time) <= lengths.gap + lengths.tolerance + 1e-7);
        }
        const TimeOfImpact turned = both.find_turned_round();
        REQUIRE(turned.kind == found.kind);
        REQUIRE(turned.time == Approx(found.time).margin(1e-4));
      }
    }
  }
  CHECK(hits > count / 2);
  CHECK(hits < count);
}

TEST_CASE("times of impact with triangles in closed form") {
  const auto level = [](double, double) { return 0.0; };
  const GeometryPointer ground = mesh_of(terrain(8, 1, 0.3, level)).geometry;
  const Pose at_ground, at_ball{{0.3, 0.2, 5}, Matrix::Identity()};
  const Shape ball = Shape::sphere(0.05), stored = Shape::stored(ShapeKind::mesh, 1);
  const double gap = impact_lengths(0.05, std::numeric_limits<double>::infinity()).gap;
  const Path rest, fall{at_ball.x, {0, 0, -10}, {0, 0, 50}};
  const MovingPart plate{{stored, at_ground, ground.get()}, rest};
  const TimeOfImpact hit = time_of_impact({{ball, at_ball}, fall}, plate);
  REQUIRE(hit.kind == TimeOfImpact::Kind::hit);
  CHECK(hit.time == Approx((5 - 0.05 - gap) / 10).margin(1e-9));
  CHECK((hit.normal_W + Vector::UnitZ()).norm() < 1e-9);
  // From behind it goes through.
  const Pose below{{0.3, 0.2, -5}, Matrix::Identity()};
  const Path rise{below.x, {0, 0, 10}, {0, 0, 0}};
  CHECK(time_of_impact({{ball, below}, rise}, plate).kind == TimeOfImpact::Kind::none);
  // Beside the border, by 1 mm more than the gap, nothing is met; by 1 mm less it is.
  for (const double off : {1e-3, -1e-3}) {
    const Pose beside{{4.05 + gap + off, 0.2, 5}, Matrix::Identity()};
    const Path past{beside.x, {0, 0, -10}, {0, 0, 0}};
    CHECK((time_of_impact({{ball, beside}, past}, plate).kind == TimeOfImpact::Kind::none) ==
          (off > 0));
  }

  // A rod of half length 1, level, turning about x: its end comes to the ground at sin(a) = 0.5.
  const Shape rod = Shape::capsule(0.005, 1);
  Pose level_rod{{0, 0, 0.505}, Matrix::Identity()};
  level_rod.R.col(2) = Vector::UnitY();
  level_rod.R.col(1) = -Vector::UnitZ();
  const Path spin{level_rod.x, {0, 0, 0}, {std::numbers::pi, 0, 0}};
  const TimeOfImpact met = time_of_impact({{rod, level_rod}, spin}, plate);
  REQUIRE(met.kind == TimeOfImpact::Kind::hit);
  CHECK(met.time == Approx(1.0 / 6).margin(2e-4));
}

TEST_CASE("what is through a surface is not held by the triangle behind which it is") {
  const auto level = [](double, double) { return 0.0; };
  const GeometryPointer ground = mesh_of(terrain(8, 1, 0, level)).geometry;
  const Shape stored = Shape::stored(ShapeKind::mesh, 1), rod = Shape::capsule(0.005, 1);
  const Pose at_ground;
  const Path rest;
  const MovingPart plate{{stored, at_ground, ground.get()}, rest};
  // From above at 45 degrees it is 10 cm through the ground, 2 cm beside an edge, its tip beyond
  // it.
  Pose at_rod;
  at_rod.R = Eigen::AngleAxisd(std::numbers::pi / 4, Vector::UnitY()).toRotationMatrix();
  const Vector axis = at_rod.R.col(2);
  at_rod.x = Vector{1.02, 0.4, 0} + 0.859 * axis;
  const double out = 0.1 / std::sqrt(0.5);
  // Drawn out along its axis, and let slide over the ground, it meets nothing.
  for (const Vector& way : {Vector(out * axis), Vector(0, 0.3, 0.05), Vector(-0.3, 0, 0.02)}) {
    const Path path{at_rod.x, way, {0, 0, 0}};
    CAPTURE(way.transpose());
    CHECK(time_of_impact({{rod, at_rod}, path}, plate, ImpactGoal::gap).kind ==
          TimeOfImpact::Kind::none);
  }
}

TEST_CASE("a rod that comes round the edge of a block meets the face behind that edge") {
  const GeometryPointer block = mesh_of(box_surface({0.5, 0.5, 0.5})).geometry;
  const Shape stored = Shape::stored(ShapeKind::mesh, 1), rod = Shape::capsule(0.005, 1);
  // Upright beside the block, its middle below the top; it rises above that and falls over.
  const Pose at_block, at_rod{{0.6, 0, 0.4}, Matrix::Identity()};
  const double turn = std::numbers::pi / 2 + 0.35;
  const Path rest, over{at_rod.x, {0, 0, 0.2}, {0, -turn, 0}};
  const TimeOfImpact met =
      time_of_impact({{rod, at_rod}, over}, {{stored, at_block, block.get()}, rest});
  REQUIRE(met.kind == TimeOfImpact::Kind::hit);
  // Its lower end's middle comes to 0.5 + 0.005 where 0.4 + 0.2 t + cos(turn t) is that.
  const double height = 0.4 + 0.2 * met.time + std::cos(turn * met.time);
  CHECK(height == Approx(0.505).margin(2e-4));
  CHECK((met.normal_W + Vector::UnitZ()).norm() < 1e-6);
}

TEST_CASE("a mesh is as thick as its volume by its area, and reaches its farthest vertex") {
  const Pose at;
  const auto measure = [&](const GeometryPointer& geometry, double& thick) {
    const Collider collider{Shape::stored(geometry->kind(), 1), at, geometry.get()};
    thick = thickness(collider);
    return reach(collider, {1, 0, 0});
  };
  double thick = 0;
  const double far = measure(mesh_of(box_surface({2, 3, 0.01})).geometry, thick);
  CHECK(far == Approx(std::hypot(3.0, 3.0, 0.01)).epsilon(1e-12));
  CHECK(thick < 0.01);
  CHECK(thick > 0.0098);
  CHECK(measure(mesh_of(terrain(4, 1, 0, hilly)).geometry, thick) >= 3);
  CHECK(thick > 0);
  CHECK(std::isfinite(measure(field_of_bumps(), thick)));
  CHECK(thick > 0);
}

}  // namespace cradle
