// That the normal of a manifold is the best of all: against every axis that can part polytopes, and
// against a search over the sphere for curved shapes. Neither shares code with what is tested.
#include "tests/bench/parting.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/overlap_by_search.h"
#include "tests/unit/trials.h"

using namespace cradle;

namespace {

constexpr double kNearAngle = 1e-4;  // rad

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
  CHECK(worse == 0);
}

TEST_CASE("normals are within 1e-4 of the best, or overlap as little") {
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
      if ((manifold.normal_W - best.n).norm() < kNearAngle || excess < kExact) continue;
      ++other;
    }
    CAPTURE(other, contacts);
    CHECK(other == 0);
    all += contacts;
    all_other += other;
  }
  CAPTURE(all_other, all);
  CHECK(all > 10000);
  CHECK(all_other == 0);
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
        REQUIRE((is_as_good || (manifold.normal_W - best.n).norm() < kNearAngle));
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
