// That the normal of a manifold is the best of all: against every axis that can part polytopes, and
// against a search over the sphere for curved shapes. Neither shares code with what is tested.
#include <numbers>

#include "tests/bench/parting.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/trials.h"

using namespace cradle;

namespace {

constexpr double kExact = 1e-9;  // m
constexpr double kNear = 1e-4;   // rad

/// Down from a direction by trial steps to all sides, ever shorter.
double descend(const Pair& pair, Vector n, double step) {
  double least = overlap(pair, n);
  while (step > 1e-6) {
    const Vector helper = std::abs(n.x()) < 0.6 ? Vector::UnitX() : Vector::UnitY();
    const Vector e = n.cross(helper).normalized(), f = n.cross(e);
    bool is_lower = false;
    for (int k = 0; k < 8; ++k) {
      const double angle = k * std::numbers::pi / 4 + 1e6 * step;  // turned anew for every step
      const Vector m = (n + step * (std::cos(angle) * e + std::sin(angle) * f)).normalized();
      const double there = overlap(pair, m);
      if (there < least - 1e-10) least = there, n = m, is_lower = true;
    }
    if (!is_lower) step *= 0.5;
  }
  return least;
}

/// The least overlap over the sphere: of many directions the best few, followed down.
double least_overlap_by_search(const Pair& pair) {
  constexpr int kDirections = 1000;
  std::vector<std::pair<double, Vector>> tried;
  for (int i = 0; i < kDirections; ++i) {  // on a spiral from pole to pole, evenly
    const double z = 1 - (2 * i + 1.0) / kDirections, across = std::sqrt(1 - z * z);
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const Vector n(across * std::cos(angle), across * std::sin(angle), z);
    tried.emplace_back(overlap(pair, n), n);
  }
  std::ranges::sort(tried, {}, [](const auto& one) { return one.first; });
  double least = std::numeric_limits<double>::infinity();
  std::vector<Vector> begun;
  for (const auto& one : tried) {
    const Vector& n = one.second;
    if (std::ranges::any_of(begun, [&](const Vector& m) { return (m - n).norm() < 0.25; })) {
      continue;
    }
    begun.push_back(n);
    least = std::min(least, descend(pair, n, 0.05));
    if (begun.size() == 4) break;
  }
  return least;
}

/// A pair that overlaps by up to 1 % of its thickness three times of four, else as it happens to.
Pair contact(Random& random, ShapeKind kind_A, ShapeKind kind_B, int trial) {
  Pair pair = random.pair(kind_A, kind_B);
  if (trial % 4 == 0) return pair;
  const Vector n = pair.collide(10).normal_W;
  const double thickness = overlap({pair.A, pair.B, {}, {}}, Vector::UnitZ());
  const double share = 0.01 * std::pow(random.uniform(0, 1), trial % 4);
  pair.X_WB.x += n * (overlap(pair, n) - share * thickness);
  return pair;
}

}  // namespace

TEST_CASE("the normal of two polytopes is the best of all axes") {
  Random random(6);
  for (const ShapeKind kind_A : {ShapeKind::box, ShapeKind::hull}) {
    int contacts = 0;
    for (int trial = 0; trial < 400; ++trial) {
      CAPTURE(word_of(kind_A), trial);
      const Pair pair = contact(random, kind_A, ShapeKind::hull, trial);
      const Manifold manifold = pair.collide(0.02);
      if (manifold.count == 0) continue;
      ++contacts;
      const double along_normal = overlap(pair, manifold.normal_W);
      const double least = least_overlap_of_polytopes(pair);
      if (least > 0) {
        REQUIRE(along_normal - least <= kExact);
      } else {
        REQUIRE(along_normal < kExact);  // what is apart is not told to overlap
      }
    }
    CHECK(contacts > 300);
  }
}

TEST_CASE("the normal of curved shapes is the best that a search over the sphere finds") {
  Random random(7);
  int contacts = 0, worse = 0;
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    if (kind_A > kind_B) continue;
    // Rims and tips near edges have most minima beside each other.
    const bool has_many =
        kind_A != kind_B &&
        (kind_A == ShapeKind::cone || kind_B == ShapeKind::cone || kind_A == ShapeKind::cylinder);
    for (int trial = 0; trial < (has_many ? 150 : 20); ++trial) {
      CAPTURE(word_of(kind_A), word_of(kind_B), trial);
      Pair pair = contact(random, kind_A, kind_B, trial);
      if (pair.has(ShapeKind::half_space) || is_elementary(pair)) break;
      if (is_polytope(pair.A) && is_polytope(pair.B)) break;
      const Manifold manifold = pair.collide(0.02);
      if (manifold.count == 0) continue;
      ++contacts;
      const double along_normal = overlap(pair, manifold.normal_W);
      const double least = least_overlap_by_search(pair);
      worse += along_normal > least + 1e-4 * std::abs(least) + 1e-7;
      REQUIRE(along_normal < least + 0.05 * std::abs(least) + 1e-7);
    }
  }
  CAPTURE(worse, contacts);
  CHECK(contacts > 500);
  CHECK(worse <= contacts / 500);  // at rims of cones two minima may be a few degrees apart
}

TEST_CASE("normals are within 1e-4 of the best, but where another minimum is nearly as low") {
  Random random(8);
  int all = 0, all_other = 0;
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    CAPTURE(word_of(kind_A), word_of(kind_B));
    int contacts = 0, other = 0;
    for (int trial = 0; trial < 300; ++trial) {
      CAPTURE(trial);
      const Pair pair = contact(random, kind_A, kind_B, trial);
      if (pair.has(ShapeKind::half_space) || pair.is_boxes()) break;  // boxes prefer faces
      const Manifold manifold = pair.collide(0.02);
      if (manifold.count == 0) continue;
      ++contacts;
      const Parting best = bench::parting(pair);
      const double excess = overlap(pair, manifold.normal_W) - best.overlap;
      if ((manifold.normal_W - best.n).norm() < kNear || excess < kExact) continue;
      ++other;
      REQUIRE(excess < 0.02 * std::abs(best.overlap) + 1e-7);
    }
    CAPTURE(other, contacts);
    CHECK(other <= contacts / 100);
    all += contacts;
    all_other += other;
  }
  CAPTURE(all_other, all);
  CHECK(all > 10000);
  CHECK(all_other <= all / 2000);
}

TEST_CASE("boxes, capsules and cylinders find the best normal of all, in closed form") {
  using enum ShapeKind;
  Random random(9);
  for (const auto& [kind_A, kind_B] : {std::pair{box, capsule}, std::pair{capsule, cylinder},
                                       std::pair{box, cylinder}, std::pair{cylinder, cylinder}}) {
    CAPTURE(word_of(kind_A), word_of(kind_B));
    const int all = trials(kind_A == cylinder ? 10000 : 2500);
    int overlapping = 0, apart = 0, other = 0;
    for (int trial = 0; trial < all; ++trial) {
      CAPTURE(trial);
      Pair pair = contact(random, kind_A, kind_B, trial);
      if (trial % 3 == 0) {  // apart
        const Vector n = pair.collide(10).normal_W;
        pair.X_WB.x += n * (overlap(pair, n) + random.uniform(1e-4, 0.02));
      }
      const Manifold manifold = pair.collide(0.1);
      if (manifold.count == 0) continue;
      const double along_normal = overlap(pair, manifold.normal_W);
      REQUIRE(std::abs(deepest(manifold) - along_normal) < 1e-12);
      const Parting best = bench::parting(pair);
      const double excess = along_normal - best.overlap;
      if (best.overlap < 0) {
        ++apart;
        REQUIRE(excess < kExact);
        // The search ends at 1e-9 m, where its normal may be off by more than ours.
        const bool is_as_good = along_normal <= overlap(pair, best.n);
        REQUIRE((is_as_good || (manifold.normal_W - best.n).norm() < kNear));
      } else {
        ++overlapping;
        // Of rims that are deep in each other one minimum may be missed.
        const bool may_miss = kind_A == cylinder && trial % 4 == 0;
        if (!may_miss) REQUIRE(excess < kExact);
        other += excess >= kExact;
      }
    }
    CAPTURE(other);
    CHECK(overlapping > all / 2);
    CHECK(apart > all / 4);
    CHECK(other <= all / 2000);
  }
}
