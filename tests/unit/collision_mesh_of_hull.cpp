// A closed mesh of a hull's faces against the hull itself: what touches the one touches the other,
// as deep, and what is apart from the one is apart from the other, as far.
#include "server/collision/manifolds.h"
#include "tests/unit/collision_fcl_known.h"
#include "tests/unit/collision_pairs.h"

using namespace cradle;

namespace {

/// Moved so that the separation along their normal is `wanted`.
void part_by(Pair& pair, double wanted) {
  Vector n = Vector::UnitX();
  for (int k = 0; k < 3; ++k) {
    const Manifold manifold = pair.collide(100);
    if (manifold.count > 0) n = manifold.normal_W;
    pair.X_WB.x += n * overlap(pair, n);
  }
  pair.X_WB.x += n * wanted;
}

double separation_of(const std::vector<Manifold>& manifolds) {
  double least = std::numeric_limits<double>::infinity();
  for (const Manifold& manifold : manifolds) least = std::min(least, -deepest(manifold));
  return least;
}

}  // namespace

namespace {

/// How far the mesh's answers are from the hull's.
struct Compared {
  int poses = 0;
  int off = 0;  ///< by more than a thousandth of the depth
  double most_off_m = 0;
};

/// Of random hulls, and shapes that are moved to the separation that `wanted` tells.
template <class F>
Compared compare_hulls(int trials, F&& wanted) {
  Random random(97);
  Compared compared;
  for (int trial = 0; trial < trials; ++trial) {
    CAPTURE(trial);
    const Solid hull = random.solid(ShapeKind::hull);
    const auto kind = static_cast<ShapeKind>(1 + trial % static_cast<int>(ShapeKind::hull));
    if (kind == ShapeKind::half_space) continue;
    Pair pair{hull, random.solid(kind), {random.vector(2), random.rotation()}, {}};
    pair.X_WB = {pair.X_WA.x + random.vector(0.3), random.rotation()};
    part_by(pair, wanted(random));
    const Manifold at_hull = pair.collide(10);
    if (at_hull.count == 0) continue;
    const double truth = -overlap(pair, at_hull.normal_W);
    if (truth > kMargin - 1e-6) continue;
    const Solid mesh = mesh_solid(hull.hull());
    std::vector<Manifold> at_mesh;
    add_manifolds({mesh.shape, pair.X_WA, mesh.geometry.get()},
                  {pair.B.shape, pair.X_WB, pair.B.geometry.get()}, kMargin, at_mesh);
    CAPTURE(word_of(kind), truth);
    REQUIRE_FALSE(at_mesh.empty());
    const double error = std::abs(separation_of(at_mesh) - truth);
    ++compared.poses;
    compared.off += error > 1e-3 * std::abs(truth) + 1e-5 ? 1 : 0;
    compared.most_off_m = std::max(compared.most_off_m, error);
  }
  return compared;
}

}  // namespace

TEST_CASE("a closed mesh of a hull's faces touches what the hull touches") {
  const Compared apart =
      compare_hulls(20000, [](Random& random) { return random.uniform(1e-4, 0.019); });
  CHECK(apart.poses > 10000);
  CHECK(apart.off == 0);
  const Compared touching =
      compare_hulls(20000, [](Random& random) { return -std::pow(10, random.uniform(-6, -3)); });
  CHECK(touching.poses > 10000);
  CHECK(touching.off * 1000 < touching.poses);  // the rims of cones at edges
  CHECK(touching.most_off_m < 1e-3);
  // Through much of what is thin.
  const Compared deep =
      compare_hulls(20000, [](Random& random) { return -std::pow(10, random.uniform(-3, -1.3)); });
  CHECK(deep.poses > 10000);
  CHECK(deep.off * 100 < deep.poses);
}
