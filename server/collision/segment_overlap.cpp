// Capsules at boxes and cylinders (closed_overlap.cpp).
#include <cmath>

#include "server/collision/lead.h"
#include "server/collision/overlap_search.h"
#include "server/collision/segment_distance.h"

namespace cradle {

LeastOverlap OverlapSearch::box_segment() {
  const Vector& h = P_.size;
  double second = std::numeric_limits<double>::infinity(), sine = 1;
  int edge = -1;
  for (int k = 0; k < 3; ++k) {
    const double overlap = h[k] + Q_.size.y() * std::abs(b_[k]) - std::abs(c_[k]);
    second = std::min(second, std::max(overlap, best_.overlap));
    take(Vector::Unit(k), overlap, c_[k] < 0, OverlapTouch::on_Q);
  }
  for (int k = 0; k < 3; ++k) {
    const Vector across = Vector::Unit(k).cross(b_);
    const double length2 = across.squaredNorm();
    if (!(length2 > kParallel2)) continue;
    const double length = std::sqrt(length2), along = across.dot(c_);
    const double overlap = (box_reach(across) - std::abs(along)) / length;
    second = std::min(second, std::max(overlap, best_.overlap));
    if (!(overlap < best_.overlap)) continue;
    edge = k;
    sine = length;
    take(across / length, overlap, along < 0, OverlapTouch::lines);
  }
  if (best_.overlap < 0) {
    const SegmentDistance closest = segment_box({c_, b_, Q_.size.y()}, h);
    if (closest.distance > limit_) return beyond(closest.n, closest.distance);
    if (closest.distance > 0) {
      LeastOverlap found{true,
                         closest.n,
                         box_reach(closest.n) + segment_reach(closest.n) - closest.n.dot(c_),
                         closest.p,
                         std::max(lead_by_turn(closest.distance), closest.inside),
                         closest.sine};
      return as_A_sees(found);
    }
  }
  LeastOverlap found = edge < 0 ? result() : result(Vector::Unit(edge));
  // All other directions are known, and the opposite of this one is another.
  found.lead = std::min({lead_wanted_, second - best_.overlap, 2 * best_.n.dot(c_)});
  if (!(found.lead > 0)) found.lead = -1;
  found.sine = sine;
  return found;
}

LeastOverlap OverlapSearch::cylinder_segment() {
  const double r = P_.size.x(), H = P_.size.y(), L = Q_.size.y();
  take(Vector::UnitZ(), H + L * std::abs(b_.z()) - std::abs(c_.z()), c_.z() < 0,
       OverlapTouch::on_Q);
  if (is_beyond_limit()) return beyond(best_.n, -best_.overlap);
  const SeenAlong seen({Vector::UnitZ(), r, H}, b_);
  if (!seen.is_round) {
    const double along = seen.u.dot(c_);
    take(seen.u, r - std::abs(along), along < 0, OverlapTouch::lines);
    if (is_beyond_limit()) return beyond(best_.n, -best_.overlap);
  }
  const SegmentDistance closest = segment_cylinder({c_, b_, L}, r, H);
  if (closest.distance > limit_) return beyond(closest.n, closest.distance);
  if (closest.distance > 0) {
    const Vector& n = closest.n;
    LeastOverlap found{true,
                       n,
                       upright_reach(n) + segment_reach(n) - n.dot(c_),
                       closest.p,
                       std::max(lead_by_turn(closest.distance), closest.inside),
                       closest.sine};
    return as_A_sees(found);
  }
  if (touch_ == OverlapTouch::on_Q) {
    if (const auto found = at_face()) return *found;
  }
  for (const double end : {L, -L}) {
    const Vector q = c_ + end * b_;
    const double across = std::sqrt(q.x() * q.x() + q.y() * q.y());
    attempt(across > 0 ? Vector(q.x() / across, q.y() / across, 0) : Vector(Vector::UnitX()),
            OverlapTouch::on_Q);
  }
  try_rim_at_line(seen, c_, best_.overlap,
                  [&](const Vector& n) { attempt(n, OverlapTouch::on_P); });
  return result(Vector::UnitZ());
}

}  // namespace cradle
