// Names of points stay while bodies move by up to 0.1 mm a step and the same corners touch.
#include <optional>

#include "server/collision/manifolds.h"
#include "tests/physics/terrains.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/trials.h"

using namespace cradle;

namespace {

constexpr double kStep_m = 1e-4;
constexpr double kThere_m = 1e-7;
constexpr double kTurned = 1e-3;  // rad: beyond, something else touches

/// The corner of a hull or box that is at a place; none: -1.
int corner_at(const Solid& solid, const Pose& X, const Vector& p_W) {
  std::vector<Vector> corners;
  if (solid.shape.kind == ShapeKind::hull) corners = solid.hull().vertices;
  if (solid.shape.kind == ShapeKind::box) {
    const Vector half = to_eigen(solid.shape.half_extents_m());
    for (int k = 0; k < 8; ++k) {
      corners.push_back(half.cwiseProduct(Vector(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
    }
  }
  const Vector p = X.R.transpose() * (p_W - X.x);
  for (std::size_t k = 0; k < corners.size(); ++k) {
    if ((corners[k] - p).norm() < kThere_m) return static_cast<int>(k);
  }
  return -1;
}

/// A lone point, and the corners of both bodies that are there.
struct Lone {
  Vector n;
  std::uint32_t name;
  int corner_A, corner_B;
};

std::optional<Lone> lone_point(const Pair& pair) {
  const Manifold m = pair.collide(kMargin);
  if (m.count != 1) return std::nullopt;
  const Vector half = 0.5 * m.points[0].separation * m.normal_W;
  return Lone{m.normal_W, m.points[0].feature, corner_at(pair.A, pair.X_WA, m.points[0].p_W - half),
              corner_at(pair.B, pair.X_WB, m.points[0].p_W + half)};
}

/// What was seen along the way.
struct Names {
  int corners = 0, changed = 0, crossings = 0, flickers = 0;

  void look(const Lone& before, const Lone& now) {
    if ((before.n - now.n).norm() > kTurned) return;
    const bool has_corner = now.corner_A >= 0 || now.corner_B >= 0;
    if (before.corner_A != now.corner_A || before.corner_B != now.corner_B) return;
    (has_corner ? corners : crossings) += 1;
    changed += has_corner && before.name != now.name;
  }
};

}  // namespace

TEST_CASE("a lone point keeps its name while the same corners touch, or the same edges") {
  using enum ShapeKind;
  const std::pair<ShapeKind, ShapeKind> kinds[] = {
      {cone, hull},    {hull, cone}, {cylinder, hull}, {box, hull},
      {capsule, hull}, {hull, hull}, {hull, capsule},  {ellipsoid, hull}};
  Names names;
  for (const auto& [kind_A, kind_B] : kinds) {
    Random random(96);
    for (int trial = 0; trial < trials(1800); ++trial) {
      CAPTURE(word_of(kind_A), word_of(kind_B), trial);
      Pair pair = random.pair(kind_A, kind_B);
      const Vector n = pair.collide(10).normal_W;
      pair.X_WB.x += n * (overlap(pair, n) - random.uniform(-0.01, 0.02));
      const Vector way = kStep_m * random.uniform(0, 1) * random.direction();
      const Matrix turn =
          Eigen::AngleAxisd(kStep_m / 2 * random.uniform(0, 1), random.direction()).matrix();
      std::vector<std::optional<Lone>> seen;
      for (int step = 0; step < 40; ++step) {
        seen.push_back(lone_point(pair));
        pair.X_WB.x += way;
        pair.X_WB.R = turn * pair.X_WB.R;
      }
      for (std::size_t k = 1; k < seen.size(); ++k) {
        if (!seen[k - 1] || !seen[k]) continue;
        names.look(*seen[k - 1], *seen[k]);
        if (k < 2 || !seen[k - 2]) continue;
        const std::uint32_t name = seen[k]->name;
        names.flickers += seen[k - 2]->name == name && seen[k - 1]->name != name;
      }
    }
  }
  CHECK(names.corners > trials(100'000));
  CHECK(names.crossings > trials(100'000));
  CHECK(names.changed == 0);
  CHECK(names.flickers == 0);
}

TEST_CASE("a drum that leans a little over an edge keeps the name of its deepest point") {
  // It is at a corner of the octagon that stands for the rim: rounding chose one of two sides.
  Random random(98);
  int kept = 0, renamed = 0;
  for (int trial = 0; trial < trials(1000); ++trial) {
    CAPTURE(trial);
    Pair pair{Shape::cylinder(0.3, 0.2), Shape::box({0.5, 0.5, 0.5}), {}, {}};
    // Lowest beyond the edge: the rim crosses that where both touch first.
    const Matrix lean = Eigen::AngleAxisd(random.uniform(1e-3, 1e-2), Vector::UnitY()).matrix();
    const Matrix yaw = Eigen::AngleAxisd(random.uniform(-0.5, 0.5), Vector::UnitZ()).matrix();
    pair.X_WA.R = yaw * lean;
    pair.X_WA.x = {0.5 + random.uniform(0.05, 0.25), random.uniform(-0.1, 0.1), 0.7};
    for (int k = 0; k < 2; ++k) {
      const Vector n = pair.collide(10).normal_W;
      pair.X_WB.x += n * (overlap(pair, n) - random.uniform(0, 1e-3));
    }
    const Vector way = 1e-5 * random.direction();
    std::set<std::uint32_t> before;
    for (int step = 0; step < 20; ++step) {
      const Manifold m = pair.collide(kMargin);
      const std::set<std::uint32_t> names = features(m);
      if (step > 0) (names == before ? kept : renamed) += 1;
      before = names;
      pair.X_WA.x += way;
    }
  }
  CHECK(kept > trials(18'000));
  CHECK(renamed <= trials(10));
}

TEST_CASE("what lies over a ridge of a mesh keeps the names of its points") {
  // The face and the edge found the same point, and rounding chose which of them named it.
  const auto roof = [](double x, double) { return std::min(0.0, -x); };
  const GeometryPointer ground = mesh_of(terrain(8, 0.25, 0, roof)).geometry;
  const Collider ridge{Shape::stored(ShapeKind::mesh, 1), {}, ground.get()};
  Random random(97);
  int kept = 0, renamed = 0;
  for (int trial = 0; trial < trials(300); ++trial) {
    Pair pair{Shape::box({0.3, 0.2, 0.1}), Shape::half_space(), {}, {}};
    Pose& X = pair.X_WA;
    X.R = Eigen::AngleAxisd(random.uniform(0, 6), Vector::UnitZ()).matrix();
    X.x = {random.uniform(-0.2, 0), random.uniform(-0.3, 0.3), 0.1 - random.uniform(0, 1e-3)};
    const Vector way = 1e-5 * random.direction();
    const Matrix turn = Eigen::AngleAxisd(1e-7, random.direction()).matrix();
    std::vector<Manifold> before;
    for (int step = 0; step < 20; ++step) {
      std::vector<Manifold> now;
      add_manifolds({pair.A.shape, X}, ridge, kMargin, now);
      for (const Manifold& m : now) {
        for (const Manifold& old : before) {
          if (old.part != m.part) continue;
          const std::set<std::uint32_t> names = features(old);
          for (const ContactPoint& p : points(m)) {
            const bool was_there = std::ranges::any_of(
                points(old), [&](const ContactPoint& q) { return (q.p_W - p.p_W).norm() < 1e-4; });
            kept += was_there && names.contains(p.feature);
            renamed += was_there && !names.contains(p.feature);
          }
        }
      }
      before = now;
      X.x += way;
      X.R = turn * X.R;
    }
  }
  CHECK(kept > trials(15'000));
  CHECK(renamed == 0);
}
