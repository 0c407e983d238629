/// Our manifolds against the answers of another library, where neither is believed: overlaps along
/// both normals, by support functions, tell which of two that differ is right.
#pragma once

#include <ostream>

#include "tests/bench/parting.h"
#include "tests/unit/collision_pairs.h"

namespace cradle {

/// What another library says of a pair.
struct OtherAnswer {
  Vector n = Vector::Zero();  ///< from A to B
  double depth = 0;           ///< m, negative: apart
};

/// How often two answers differed, and how that is explained.
struct Verdicts {
  int asked = 0, agreed = 0;
  int inconsistent = 0;  ///< their depth is not the overlap along their normal
  int worse = 0;         ///< theirs is, but ours overlaps less
  int tie = 0;           ///< two directions that overlap alike
  int ours_worse = 0;    ///< theirs overlaps less
  double most_m = 0;     ///< by that much at most

  /// Shares of those that were asked.
  double disagreeing() const { return 1 - static_cast<double>(agreed) / std::max(1, asked); }
  double ours_worse_share() const { return static_cast<double>(ours_worse) / std::max(1, asked); }
};

inline std::ostream& operator<<(std::ostream& out, const Verdicts& v) {
  return out << v.asked << " asked, " << v.agreed << " agreed, " << v.inconsistent
             << " inconsistent, " << v.worse << " worse, " << v.tie << " ties, " << v.ours_worse
             << " ours worse by up to " << v.most_m << " m";
}

/// `tolerance` (m) is what their depth is good for, `angle` (rad) their normal.
inline void judge(Verdicts& verdicts, const Pair& pair, const Manifold& ours,
                  const OtherAnswer& theirs, double tolerance, double angle) {
  ++verdicts.asked;
  const double ours_m = overlap(pair, ours.normal_W), theirs_m = overlap(pair, theirs.n);
  if (std::abs(deepest(ours) - theirs.depth) < tolerance &&
      (ours.normal_W - theirs.n).norm() < angle) {
    ++verdicts.agreed;
  } else if (std::abs(theirs.n.norm() - 1) > 1e-6 ||
             std::abs(theirs_m - theirs.depth) > tolerance) {
    ++verdicts.inconsistent;
  } else if (theirs_m > ours_m + tolerance) {
    ++verdicts.worse;
  } else if (theirs_m > ours_m - tolerance) {
    ++verdicts.tie;
  } else {
    ++verdicts.ours_worse;
    verdicts.most_m = std::max(verdicts.most_m, ours_m - theirs_m);
  }
}

inline bool is_polytope(ShapeKind kind) {
  return kind == ShapeKind::box || kind == ShapeKind::hull;
}

/// The share of poses, 1 % of the thickness deep, in which an exact answer may overlap less than
/// ours: two boxes prefer faces (tolerances.h); of curved shapes another minimum may be as low.
inline double most_ours_worse(ShapeKind A, ShapeKind B) {
  if (A == ShapeKind::box && B == ShapeKind::box) return 0.22;
  return is_polytope(A) && is_polytope(B) ? 0 : 0.005;
}

/// `count` pairs of two kinds that overlap by up to `share` of their thickness along the best
/// direction; below zero: that are apart by up to `-share`.
inline std::vector<Pair> sunk_pairs(Random& random, ShapeKind A, ShapeKind B, double share,
                                    int count) {
  std::vector<Pair> pairs;
  for (int k = 0; k < count; ++k) {
    Pair pair = random.pair(A, B, 0.1);
    const bool is_plane = pair.has(ShapeKind::half_space);
    const double thickness = overlap({pair.A, pair.B, {}, {}}, Vector::UnitZ());
    if (!is_plane) pair.X_WB.x += random.direction() * thickness;
    const Vector n = bench::parting(pair).n;
    pair.X_WB.x += n * (overlap(pair, n) - share * thickness * random.uniform(0, 1));
    pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace cradle
