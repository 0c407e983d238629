// Boxes, capsules and cylinders: which smooth part of the surface they leave each other through.
//
// Symbols: P is the box, or else a cylinder, with its axes those of the frame; Q the capsule's
// segment, or a cylinder, b its axis; c from P's middle to Q's; r and H a cylinder's radius and
// half length, L half the segment. M is the set of all points of P less those of Q, n a unit vector
// out of it, h(n) = reach of P + reach of Q - n . c. M is symmetric about -c, so n . c >= 0.
//
// A ball about the origin that touches M from inside touches a smooth part of its surface, never a
// ridge. These parts are few, and each has one direction, or a row of them:
//   a face of the box, a cap of a cylinder                   its normal
//   two straight edges; an edge and the side of a cylinder   their common normal
//   the side of a cylinder and a corner                      from axis to corner, across the axis
//   a rim and a straight edge, or the side of a cylinder     a row across the edge (rim.h)
//   two rims                                                 a patch: Newton's method (rim_pair.h)
// The least h of all these is the least overlap: any of them is a way to part the two.
//
// Of two rims the minimum is sought from where their planes cross, and beside the best cap or side:
// another that is lower is missed in 1 of 9000 random poses that overlap, where the planes do not
// cross within the rims, or where what crosses does not face the other. (One more start, on the
// side of the rims' planes that is toward the other, halves these, and costs half as much again.)
//
// Cores that are apart: a segment's distance in closed form (segment_distance.h). Of others the
// same directions count, and a corner or rim that is nearest to one; which it is, is seen by going
// from what is nearest along the best direction to the nearest point of the other shape, and back.
//
// Cost: box and segment 60 ns; cylinder and segment 90 ns; box and cylinder 150 ns at a face, 220
// ns elsewhere; two cylinders 210 .. 400 ns.
#include "server/collision/closed_overlap.h"

#include <algorithm>
#include <cmath>

#include "server/collision/lead.h"
#include "server/collision/overlap_search.h"

namespace cradle {
namespace {

// The closest points of what is apart.
constexpr int kClosestStepsMax = 4;
constexpr double kSure = 1e-12;  // distances this near to each other are one: relative, and
constexpr double kRoundingOfWay = 1e-15;  // of the way between the middles

}  // namespace

LeastOverlap OverlapSearch::result(const Vector& edge) const {
  const Vector& n = best_.n;
  // Where P touches Q, with P where it is.
  Vector p =
      touch_ == OverlapTouch::on_Q ? Vector(point_of_Q(n) + best_.overlap * n) : point_of_P(n);
  if (touch_ == OverlapTouch::lines) {
    const Vector q = point_of_Q(n);
    const double from = edge.dot(p);
    const double end = P_.kind == ShapeKind::box ? box_reach(edge) : P_.size.y();
    const double on = from + (q - p).cross(b_).dot(n) / edge.cross(b_).dot(n);
    p += edge * (std::clamp(on, -end, end) - from);
  }
  return as_A_sees({true, n, best_.overlap, p, -1});
}

LeastOverlap OverlapSearch::as_A_sees(LeastOverlap found) const {
  if (!is_swapped_) return found;
  found.p_A = pair_.R * (found.p_A - found.overlap * found.n) + pair_.t;
  found.n = -(pair_.R * found.n);
  return found;
}

std::optional<LeastOverlap> OverlapSearch::at_face() const {
  const bool is_of_A = (touch_ == OverlapTouch::on_Q) != is_swapped_;
  return certain_at_face(pair_, result(), is_of_A ? FaceDirection::Of::A : FaceDirection::Of::B,
                         lead_wanted_);
}

/// Of cores that are apart. What is nearest along the best direction is nearest of all, if it is
/// opposite each other; if it is beside each other, a corner or a rim is nearer.
std::optional<LeastOverlap> OverlapSearch::closest_points(const Vector& edge) {
  const LeastOverlap along = result(edge);
  Vector p = is_swapped_ ? Vector(pair_.R.transpose() * (along.p_A - pair_.t)) : along.p_A;
  for (int step = 0; step < kClosestStepsMax; ++step) {
    const Vector q = nearest_of_Q(p);
    p = nearest_of_P(q);
    const Vector v = q - p;
    const double distance = v.norm();
    if (distance < kKissing_m) return along;
    attempt(v / distance, OverlapTouch::on_P);
    if (-best_.overlap < distance - kSure * distance - kRoundingOfWay * c_.norm()) continue;
    if (is_beyond_limit()) return beyond(best_.n, -best_.overlap);
    return as_A_sees({true, best_.n, best_.overlap, p, lead_by_turn(distance)});
  }
  return std::nullopt;
}

std::optional<LeastOverlap> closed_overlap(const ConvexPair& pair, double limit,
                                           double lead_wanted) {
  const auto is_solid = [](ShapeKind kind) {
    return kind == ShapeKind::box || kind == ShapeKind::cylinder;
  };
  const auto has_axis = [](ShapeKind kind) {
    return kind == ShapeKind::capsule || kind == ShapeKind::cylinder;
  };
  const ShapeKind A = pair.A.kind, B = pair.B.kind;
  if (!(is_solid(A) && has_axis(B)) && !(is_solid(B) && has_axis(A))) return std::nullopt;
  return OverlapSearch(pair, limit, lead_wanted).find();
}

}  // namespace cradle
