/// A manifold as two bodies remember it, and how far they may move before it must be made anew.
///
/// Motion is counted as how far B's origin is from where it was beside A's, and the ways that the
/// points of both bodies have gone at most by turning about their origins, together, since the
/// manifold was made: then no separation has changed by more. What falls or slides side by side
/// does not move. What a manifold bears follows from its lead:
///  - nothing within the margin: motion and margin together stay below the separation, so nothing
///    can be missed (exact);
///  - contacts: no other direction can have become the better one (each separation changes by the
///    motion at most, their difference by twice as much), and the points have not wandered far.
///    Where the lead is not known, nothing is kept. Normal and points move with the bodies. The
///    error of a separation is of second order in the motion: 2e-6 m for a cube of 1 m.
/// Cost: next to nothing where nothing touches, 40 ns to move four points.
#pragma once

#include <array>
#include <cstdint>
#include <numbers>

#include "server/collision/collider.h"
#include "server/collision/manifold.h"

namespace cradle {

/// Pairs whose manifold costs more to make than to keep. Never composite ones.
bool is_worth_keeping(ShapeKind A, ShapeKind B);

/// Plain numbers without padding: part of the world's hash.
struct KeptManifold {
  struct Point {
    Vector p_A = Vector::Zero(), p_B = Vector::Zero();  ///< m: where it touches A and B, in A and B
    std::uint64_t feature = 0;
  };

  Vector n_A = Vector::Zero();  ///< the normal, in A
  std::array<Point, kManifoldPoints> points;
};

/// m: how much motion a manifold bears. `reach`: radius of the ball about Bo that holds the smaller
/// body. Where nothing touches, the margin counts as motion, too.
double bearable_motion(const Manifold& manifold, double reach);

/// m: the most that it is for manifolds with points.
double most_bearable_motion(double reach);

/// Into `kept`; zeros for points that there are not.
void keep(const Manifold& manifold, const Pose& X_WA, const Pose& X_WB, KeptManifold& kept);

/// Into `manifold`: that of `count` points at other poses.
void pose(const KeptManifold& kept, int count, const Pose& X_WA, const Pose& X_WB,
          Manifold& manifold);

/// m: no point within `reach` of Bo goes farther than this by turning about it.
inline double way_of_turning(const Matrix& from, const Matrix& to, double reach) {
  if (from == to) return 0;  // also where reach is infinite
  // |(R1 - R0) p| <= 2 sin(angle / 2) |p|, and that is the Frobenius norm by the root of two.
  return reach * (to - from).norm() / std::numbers::sqrt2;
}

}  // namespace cradle
