// Searches that begin at a pair's last axis, or at the corners where the last one ended, find what
// those find that know nothing.
#include "tests/unit/collision_pairs.h"
#include "tests/unit/made_in_order.h"
#include "tests/unit/trials.h"

using namespace cradle;

namespace {

const int kPairs = trials(1000);  // of each pair of kinds

Manifold collide_with(const Pair& pair, PairHints hints) {
  InOrder in_order(1);
  Collisions collisions(in_order);
  hints.wants_lead = true;
  collisions.add(0, {pair.A.shape, pair.X_WA, pair.A.geometry.get()},
                 {pair.B.shape, pair.X_WB, pair.B.geometry.get()}, kMargin, hints);
  collisions.finish();
  return in_order.made[0];
}

Manifold collide_from(const Pair& pair, const Vector& axis_W, bool was_apart) {
  PairHints hints;
  hints.axis_W = axis_W;
  hints.was_apart = was_apart;
  return collide_with(pair, hints);
}

/// Pairs that overlap, are within the margin, or beyond.
Pair pair_near(Random& random, ShapeKind kind_A, ShapeKind kind_B) {
  Pair pair = random.pair(kind_A, kind_B, 0.2);
  const Vector n = pair.collide(10).normal_W;
  pair.X_WB.x += n * (overlap(pair, n) + random.uniform(-0.02, 0.06));
  return pair;
}

/// Near to where the best direction is, anywhere, or opposite to it.
Vector some_axis(Random& random, const Vector& n, int trial) {
  const double off = std::pow(10, random.uniform(-6, -0.3));
  if (trial % 3 == 0) return random.direction();
  return trial % 17 == 1 ? Vector(-n) : Vector((n + off * random.direction()).normalized());
}

}  // namespace

TEST_CASE("a search finds the same from any axis, and the same pairs apart") {
  Random random;
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    CAPTURE(word_of(kind_A), word_of(kind_B));
    int apart = 0;
    for (int trial = 0; trial < kPairs; ++trial) {
      CAPTURE(trial);
      const Pair pair = pair_near(random, kind_A, kind_B);
      const Manifold best = pair.collide(1);
      const Vector axis = some_axis(random, best.normal_W, trial);
      for (const bool was_apart : {false, true}) {
        const Manifold found = collide_from(pair, axis, was_apart);
        if (found.count == 0) {
          ++apart;
          REQUIRE(overlap(pair, best.normal_W) < -kMargin + kExact);
          REQUIRE(found.lead <= -overlap(pair, best.normal_W) + kExact);
          continue;
        }
        REQUIRE(overlap(pair, best.normal_W) > -kMargin - kExact);
        REQUIRE(std::abs(deepest(found) - overlap(pair, found.normal_W)) < kExact);
        REQUIRE(std::abs(deepest(found) - deepest(pair.collide(kMargin))) < kExact);
      }
    }
    CHECK(apart > kPairs / 4);
  }
}

TEST_CASE("what is apart is told along the axis that it was apart along, while that parts it") {
  Random random;
  int along_axis = 0, searches = 0;
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    for (int trial = 0; trial < kPairs; ++trial) {
      CAPTURE(word_of(kind_A), word_of(kind_B), trial);
      const Pair pair = pair_near(random, kind_A, kind_B);
      const Manifold best = pair.collide(1);
      if (overlap(pair, best.normal_W) > -kMargin - 1e-3) continue;
      const Vector axis = (best.normal_W + 1e-3 * random.direction()).normalized();
      const Manifold found = collide_from(pair, axis, true);
      REQUIRE(found.count == 0);
      if (pair.is_boxes() || found.lead == 0) continue;
      ++searches;
      REQUIRE(found.lead <= -overlap(pair, found.normal_W) + kExact);
      along_axis += (found.normal_W - axis).norm() < 1e-12;
    }
  }
  CAPTURE(along_axis, searches);
  CHECK(along_axis > searches * 9 / 10);
  CHECK(searches > kPairs);
}

TEST_CASE("a search that begins with the corners of the last one, or any others, finds the same") {
  Random random;
  constexpr ShapeKind kPartners[] = {ShapeKind::hull, ShapeKind::box, ShapeKind::capsule,
                                     ShapeKind::sphere};
  int remembered = 0, touching = 0;
  for (int trial = 0; trial < 8 * kPairs; ++trial) {
    CAPTURE(trial);
    Pair pair = trial % 2 == 0 ? pair_near(random, ShapeKind::hull, kPartners[trial / 2 % 4])
                               : pair_near(random, kPartners[trial / 2 % 4], ShapeKind::hull);
    PairHints hints;
    hints.choice = pair.collide(kMargin).choice;
    remembered += hints.choice != 0;
    // As in the next tick, or long after; or with what another pair remembers.
    const double moved = std::pow(10, random.uniform(-5, 0));
    pair.X_WB.x += moved * random.direction();
    if (trial % 5 == 0) hints.choice = static_cast<std::uint32_t>(random.uniform(0, 4294967295.0));
    const Manifold alone = pair.collide(kMargin), found = collide_with(pair, hints);
    const double s = overlap(pair, pair.collide(1).normal_W);
    if (std::abs(s + kMargin) < kExact) continue;
    REQUIRE((found.count > 0) == (alone.count > 0));
    if (found.count == 0) {
      REQUIRE(found.lead <= -s + kExact);
      continue;
    }
    ++touching;
    REQUIRE(std::abs(deepest(found) - overlap(pair, found.normal_W)) < kExact);
    REQUIRE(std::abs(deepest(found) - deepest(alone)) < kExact);
  }
  CAPTURE(remembered, touching);
  CHECK(remembered > kPairs);
  CHECK(touching > kPairs);
}
