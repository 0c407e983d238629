// The direction of least overlap of two convex cores.
//
// Symbols, in A's frame: M the set of all a - b, h(n) = max over M of n . m its support function,
// the overlap along n. If the cores are apart, the best n is that of the closest points. If they
// overlap it is the unit vector with the least h: the nearest point of M's surface lies there.
//
// Boxes, capsules and cylinders among themselves: closed_overlap.cpp. The others here.
//
// Cores with corners only: polytope_search.cpp. Cylinders and cones at boxes and hulls:
// revolved_overlap.cpp; cones at cones and cylinders: revolved_pair.cpp. Other curved ones:
// curved_search.cpp. Here it is chosen among them, and here are those with a flat shape, a
// triangle.
//
// A flat shape has no far side, and no inside for a polytope to grow from. The search begins at the
// best of the directions in which shapes use to leave each other: their faces and sides. If that is
// certainly best, all is done. Else B is moved out along it so that the cores are apart, and
// roughly closest points lead to where Newton's method finds a local minimum (polish.h). Where
// parts are flat Newton's method is no help, and the way down goes by steps (descent.h). A triangle
// can be left by its edges, too: cores clearly apart from it are told by their closest points, and
// what seems to overlap is looked at once more from there (look_past_edges).
//
// Cost at -O3: as in the files named; with a flat shape 0.7 us.
#include <cmath>

#include "server/collision/closed_overlap.h"
#include "server/collision/curved_search.h"
#include "server/collision/descent.h"
#include "server/collision/lead.h"
#include "server/collision/polish.h"
#include "server/collision/polytope_search.h"
#include "server/collision/revolved_overlap.h"
#include "server/collision/revolved_pair.h"

namespace cradle {
namespace {

// The way to a local minimum. Its first closest points need only lead roughly there: their squared
// distance is known to a tenth, with B this many small lengths out.
constexpr double kWayGap = 0.1;
constexpr double kBeside = 20;

/// The local minimum that closest points lead to from a direction; not found where rounding or flat
/// parts are in the way.
bool find_near(const ConvexPair& pair, const FaceDirection& from, double limit, SupportHints& hints,
               LeastOverlap& least) {
  Simplex simplex;
  simplex.gap = kWayGap;
  const double out = from.overlap > 0 ? from.overlap + kBeside * pair.small_length() : 0;
  const Closest found =
      closest(pair, out * from.n, from.n, out > 0 ? kInfinity : limit, simplex, hints);
  if (found.kind == Closest::Kind::beyond_limit) {
    least = LeastOverlap::beyond(found.n, found.distance);
    return true;
  }
  if (found.kind != Closest::Kind::apart) return false;
  if (from.face_of != FaceDirection::Of::nothing &&
      (found.n - from.n).squaredNorm() < kBesideFace2) {
    return false;
  }
  return polish(pair, found.n, simplex, hints, least) && least.overlap <= from.overlap + kSure_m;
}

/// Cores with corners only, one of them flat, that are clearly apart: closest points tell all.
bool are_clearly_apart(const ConvexPair& pair, double limit, SupportHints& hints,
                       LeastOverlap& least) {
  const Vector n = pair.middles();
  Simplex simplex;
  const Closest found = closest(pair, Vector::Zero(), n, limit, simplex, hints);
  if (found.kind == Closest::Kind::beyond_limit) {
    least = LeastOverlap::beyond(found.n, found.distance);
    return true;
  }
  if (found.kind != Closest::Kind::apart || found.distance <= pair.small_length()) return false;
  least = {true, found.n, core_overlap(pair, found.n, hints), found.p_A,
           lead_by_turn(found.distance)};
  return true;
}

/// A flat shape can be left by its edges in ways that no face leads to, and if the cores are apart
/// one of them is the way between their closest points. Takes what overlaps less.
void look_past_edges(const ConvexPair& pair, double limit, SupportHints& hints,
                     LeastOverlap& best) {
  const auto try_from = [&](const Vector& n) {
    if (n.isZero(0)) return;  // one middle
    const double overlap = core_overlap(pair, n, hints);
    const LeastOverlap other = descend(pair, {n, overlap}, hints);
    if (other.overlap < best.overlap) best = other;
  };
  Simplex simplex{};
  const Closest found = closest(pair, Vector::Zero(), best.n, limit, simplex, hints);
  if (found.kind == Closest::Kind::beyond_limit) {
    best = LeastOverlap::beyond(found.n, found.distance);
  } else if (found.kind == Closest::Kind::apart && found.distance > kKissing_m) {
    try_from(found.n);
  } else {
    ExpandingSearch search;
    if (has_corners(pair.A) && has_corners(pair.B) &&
        begin_anywhere(pair, hints, search.polytope)) {
      search.begin(-kInfinity, 0);
      while (!search.is_done()) search.take(support(pair, search.direction(), hints));
      if (search.has_found()) {
        if (search.best().overlap < best.overlap) best = search.best();
        return;
      }
    }
    try_from(pair.centre.normalized());
    try_from(-best.n);
  }
}

LeastOverlap of_flat(const ConvexPair& pair, double limit, double lead_wanted,
                     SupportHints& hints) {
  LeastOverlap apart;
  if (has_corners(pair.A) && has_corners(pair.B) && are_clearly_apart(pair, limit, hints, apart)) {
    return apart;
  }
  const FaceDirection face = best_face(pair, hints);
  if (-face.overlap > limit) return LeastOverlap::beyond(face.n, -face.overlap);
  if (is_best(pair, face)) {
    const bool of_A = face.face_of == FaceDirection::Of::A;
    const bool leads = lead_wanted > 0 && is_best(pair, face, lead_wanted / 2);
    return {true, face.n, face.overlap,
            of_A ? Vector(face.deepest + face.overlap * face.n) : face.deepest,
            leads ? lead_wanted : -1};
  }
  LeastOverlap best;
  if (!find_near(pair, face, limit, hints, best)) {
    Simplex simplex;
    const Closest found = closest(pair, Vector::Zero(), face.n, limit, simplex, hints);
    if (found.kind == Closest::Kind::beyond_limit)
      return LeastOverlap::beyond(found.n, found.distance);
    Direction from = face;
    if (found.kind == Closest::Kind::apart) {
      const Direction n{found.n, core_overlap(pair, found.n, hints)};
      if (found.distance > pair.small_length()) {
        return {true, n.n, n.overlap, found.p_A, lead_by_turn(found.distance)};
      }
      if (n.overlap < from.overlap) from = n;  // else they kiss, and n is noise
    }
    best = descend(pair, from, hints);
  }
  if (best.is_within_limit && best.overlap > 0) look_past_edges(pair, limit, hints, best);
  if (-best.overlap > limit) best.is_within_limit = false;
  // Of overlaps there may always be another that is hardly larger.
  best.lead = best.overlap < -kKissing_m ? lead_by_turn(-best.overlap) : -1;
  return best;
}

}  // namespace

LeastOverlap least_overlap(const ConvexPair& pair, double limit, SupportHints& hints,
                           double lead_wanted) {
  if (const auto found = closed_overlap(pair, limit, lead_wanted)) return *found;
  if (pair.has_flat()) return of_flat(pair, limit, lead_wanted, hints);
  if (!has_corners(pair.A) || !has_corners(pair.B)) {
    if (const auto found = revolved_pair_overlap(pair, limit, lead_wanted)) return *found;
    if (const auto found = revolved_overlap(pair, limit, lead_wanted, hints)) return *found;
    return curved_overlap(pair, limit, lead_wanted, hints);
  }
  PolytopeSearch search(pair, limit, lead_wanted, hints, pair.middles());
  while (!search.is_done()) search.take(support(pair, search.direction(), hints));
  return search.best();
}

}  // namespace cradle
