/// Two convex shapes as A sees them, and how far their cores are from each other. Private to this
/// folder.
///
/// Everything in the frame of A, m. n is a direction from A to B.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "server/collision/convex_shape.h"
#include "server/collision/manifold.h"

namespace cradle {

struct ConvexPair {
  ConvexShape A, B;
  Matrix R;         ///< turns vectors of B into A
  Vector t;         ///< from Ao to Bo
  Vector centre;    ///< from A's centre to B's
  Matrix toward_B;  ///< turns n into B, and back: where B reaches farthest

  ConvexPair(const Collider& collider_A, const Collider& collider_B);
  ConvexPair(const ConvexShape& shape_A, const Pose& X_WA, const ConvexShape& shape_B,
             const Pose& X_WB);

  /// One is flat: it has no far side to be left by.
  bool has_flat() const { return A.is_flat() || B.is_flat(); }
  /// Two hulls that know their likely vertices.
  bool are_quick_hulls = A.is_quick_hull() && B.is_quick_hull();
  bool is_finite() const { return t.squaredNorm() < kInfinity && R.squaredNorm() < kInfinity; }
  /// From middle to middle, unit: where a search begins that knows nothing better.
  Vector middles() const {
    const double length = centre.norm();
    return length > 0 ? Vector(centre / length) : Vector(Vector::UnitZ());
  }
  double radii() const { return A.radius + B.radius; }
  /// Well below the size of the smaller shape.
  double small_length() const { return 1e-2 * std::min(A.thickness, B.thickness); }
};

/// Support points found last: where hulls begin to search.
struct SupportHints {
  std::int32_t A = 0, B = 0;
};

/// A corner of the set of all a - b, and its a.
struct Difference {
  Vector w, a;
  std::uint16_t name;  ///< corner_names.h; 0: none
};

/// The pair's a and b for which n . (a - b) is largest.
void find_support(const ConvexPair& pair, const Vector& n, SupportHints& hints, Difference& found);
inline Difference support(const ConvexPair& pair, const Vector& n, SupportHints& hints) {
  Difference found;
  find_support(pair, n, hints, found);
  return found;
}

/// How far A's core reaches into that of B along n; negative: apart.
inline double core_overlap(const ConvexPair& pair, const Vector& n, SupportHints& hints) {
  return n.dot(support(pair, n, hints).w);
}

/// Up to three corners from which the search for closest points begins, and where it ended: the
/// next search nearby begins there. Empty at first. Four where a tetrahedron was found to hold the
/// origin.
struct Simplex {
  std::array<Difference, 4> corners;
  std::array<double, 3> weights;  ///< of the corners in the closest point, where it ended apart
  std::size_t count = 0;
  double gap = 1e-10;  ///< how well the squared distance is to be known, relative
};

inline constexpr double kKissing_m = 1e-8;  ///< nearer than this, closest points tell no direction

/// What the closest points of two cores tell.
struct Closest {
  enum class Kind { apart, overlapping, beyond_limit } kind = Kind::overlapping;
  Vector n = Vector::Zero();    ///< unit, from A to B; unless overlapping
  double distance = 0;          ///< if apart; beyond the limit, what they have along n
  Vector p_A = Vector::Zero();  ///< closest point of A
};

/// The closest points of the cores, with B moved by `shift`. The search begins with the simplex or,
/// if that is empty, along `n`, a unit vector, and ends early where the cores are farther apart
/// than `limit`.
Closest closest(const ConvexPair& pair, const Vector& shift, const Vector& n, double limit,
                Simplex& simplex, SupportHints& hints);

/// The direction in which the cores overlap least, or, if they are apart, are farthest apart.
struct LeastOverlap {
  /// False: farther apart than the limit, by -overlap at least; there is no more to it.
  bool is_within_limit = false;
  Vector n = Vector::Zero();    ///< unit, from A to B
  double overlap = 0;           ///< of the cores along n
  Vector p_A = Vector::Zero();  ///< a point of A that touches B when B has been moved out along n
  /// m, of cores with corners only: what both may move together until another direction overlaps
  /// less, or n has turned; it may be more. 0: not known; below: too little to rely on.
  double lead = 0;
  double sine = 1;  ///< of the angle between the edges that n is across; 1: it is not across two
  SupportHints farthest{-1, -1};  ///< vertices of hulls that are farthest along n, if not below 0
  std::uint32_t names = 0;  ///< of the corners where the search ended, corner_names.h; 0: none

  /// Farther apart than the limit: by `distance` along n, so at least.
  static LeastOverlap beyond(const Vector& n, double distance) {
    LeastOverlap nothing;
    nothing.n = n;
    nothing.overlap = -distance;
    return nothing;
  }
};

/// `limit` is a distance of the cores, m. The lead is sought if `lead_wanted` (m) is above 0, and
/// up to that.
LeastOverlap least_overlap(const ConvexPair& pair, double limit, SupportHints& hints,
                           double lead_wanted = 0);

/// A lead beyond this is of no use.
double lead_worth_knowing(const ConvexPair& pair);

/// The manifold of two shapes, once the direction of least overlap is known for the limit
/// `margin + radii()`, m.
Manifold convex_manifold(const ConvexPair& pair, LeastOverlap least, SupportHints& hints,
                         const Pose& X_WA, double margin);

}  // namespace cradle
