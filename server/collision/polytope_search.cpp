// Cores with corners only. Their distance by GJK; if they overlap, the tetrahedron it ends with
// grows into M until its nearest face lies in M's surface: that is the least h, exactly. Where the
// overlap along the middles is large, a tetrahedron with a side across that line grows at once.
//
// Symbols as in least_overlap.cpp. A support point takes 150 cycles from its direction, the next
// direction as many from there: the processor is idle half of the time, unless it has another
// search to go on with (polytope_batch.h).
//
// Cost: apart 9 support points, resting 7.5, at an angle 9.7, deep 10.3 of two hulls of 42 corners;
// 2.3 in the mean of T5, where searches begin with the corners that the last ones ended with.
#include "server/collision/polytope_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/collision/corner_names.h"
#include "server/collision/descent.h"
#include "server/collision/lead.h"

namespace cradle {
namespace {

constexpr int kLeadSteps = 6;   // to see how much the best direction leads
constexpr double kAside = 0.6;  // the three sides of the first tetrahedron, from where it points to

}  // namespace

bool has_corners(const ConvexShape& shape) {
  switch (shape.kind) {
    case ShapeKind::sphere:
    case ShapeKind::capsule:
    case ShapeKind::box:
    case ShapeKind::hull:
    case ShapeKind::mesh:
      return true;
    default:
      return false;
  }
}

Vector unit_across(const Vector& n) {
  return (std::abs(n.x()) < 0.57 ? Vector::UnitX() : Vector::UnitY()).cross(n).normalized();
}

std::array<Vector, 3> around(const Vector& n) {
  const Vector e = unit_across(n), f = n.cross(e);
  constexpr double kRoot = std::numbers::sqrt3 / 2;
  return {n + kAside * e, n + kAside * (-0.5 * e + kRoot * f), n + kAside * (-0.5 * e - kRoot * f)};
}

bool begin_below(const ConvexPair& pair, std::array<Difference, 4>& corners, const Difference& top,
                 ExpandingPolytope& polytope) {
  corners[0] = {-pair.centre, pair.A.centre, 0};
  if (!polytope.begin(corners)) return false;
  constexpr int kTop = ExpandingPolytope::kWithoutFirst;
  const double beyond = polytope.face(kTop).n.dot(top.w) - polytope.face(kTop).distance;
  return beyond <= kSure_m || polytope.expand(kTop, top);
}

bool begin_anywhere(const ConvexPair& pair, SupportHints& hints, ExpandingPolytope& polytope) {
  std::array<Difference, 4> corners;
  const auto farther = [&](const Vector& d) {
    const Difference one = support(pair, d, hints), other = support(pair, -d, hints);
    const double middle = d.dot(corners[0].w);
    return d.dot(one.w) - middle >= middle - d.dot(other.w) ? one : other;
  };
  corners[0] = support(pair, Vector::UnitX(), hints);
  corners[1] = support(pair, -Vector::UnitX(), hints);
  const Vector along = corners[1].w - corners[0].w;
  corners[2] = farther(
      along.cross(std::abs(along.y()) < std::abs(along.z()) ? Vector::UnitY() : Vector::UnitZ()));
  corners[3] = farther(along.cross(corners[2].w - corners[0].w));
  return polytope.begin(corners);
}

void ExpandingSearch::begin(double least, double lead_wanted) {
  stage_ = Stage::growing;
  least_ = least;
  lead_wanted_ = lead_wanted;
  best_ = {true, Vector::Zero(), kInfinity, Vector::Zero()};
  aim();
}

void ExpandingSearch::aim() {
  face_ = polytope.nearest(best_.overlap - kSure_m);
  if (face_ < 0) look_for_lead();
}

bool ExpandingSearch::take(const Difference& next) {
  const ExpandingPolytope::Face& face = polytope.face(face_);
  const double overlap = face.n.dot(next.w);
  const bool is_in_surface = overlap - face.distance <= kSure_m;
  if (stage_ == Stage::leading) {
    lead_by(next, is_in_surface);
    return false;
  }
  const bool is_better = overlap < best_.overlap;
  if (is_better) {
    best_.n = face.n;
    best_.overlap = overlap;
    best_.p_A = next.a;
    best_face_ = is_in_surface ? face_ : -1;
  }
  if (is_in_surface) polytope.close(face_);
  if (overlap >= least_ && (is_in_surface || polytope.expand(face_, next))) {
    aim();
  } else {
    stage_ = Stage::failed;
  }
  return is_better;
}

void ExpandingSearch::lead_by(const Difference& next, bool is_in_surface) {
  if (is_in_surface && is_other_) return end(polytope.face(face_).distance - best_.overlap);
  if (is_in_surface) {
    polytope.close(face_);
  } else if (!polytope.expand(face_, next)) {
    return end(-1);
  }
  ++lead_steps_;
  aim_at_others();
}

void ExpandingSearch::look_for_lead() {
  lead_steps_ = 0;
  if (lead_wanted_ > 0) {
    stage_ = Stage::leading;
    aim_at_others();
  } else {
    end(0);
  }
}

/// How much less the best direction overlaps than any other, up to what is wanted: the polytope
/// grows on until its nearest face, but for those that are as good as the best, is known well
/// enough.
void ExpandingSearch::aim_at_others() {
  face_ = polytope.nearest(best_.overlap + lead_wanted_);
  if (face_ < 0) return end(lead_wanted_);
  const ExpandingPolytope::Face& face = polytope.face(face_);
  const double at_least = face.distance - best_.overlap;
  is_other_ = face.n.dot(best_.n) < kOneDirection;
  if (is_other_ && (lead_steps_ >= kLeadSteps || 2 * at_least > lead_wanted_)) return end(at_least);
  if (lead_steps_ >= kLeadSteps) end(-1);
}

void ExpandingSearch::end(double lead) {
  stage_ = Stage::found;
  // It need not be the face that told the direction: two edges make a parallelogram of M, which is
  // two faces here.
  const int at_foot = polytope.face_at_foot(best_face_, best_.n, best_.overlap);
  if (at_foot >= 0) {
    best_.p_A = polytope.foot_on_A(at_foot);
    best_.names = names_of(polytope.corners_of(at_foot));
  }
  if (!(lead_wanted_ > 0)) return;
  best_.lead = lead > 0 && at_foot >= 0 ? lead : -1;
  if (at_foot >= 0) best_.sine = edge_sine(polytope.corners_of(at_foot));
}

PolytopeSearch::PolytopeSearch(const ConvexPair& pair, double limit, double lead_wanted,
                               SupportHints& hints, const Vector& toward, std::uint32_t names)
    : pair_(pair), limit_(limit), lead_wanted_(lead_wanted), hints_(hints), n_(toward) {
  direction_ = &n_;
  if (names != 0 && find_corners(pair, names, simplex_)) seek_distance();
}

void PolytopeSearch::take(const Difference& next) {
  switch (stage_) {
    case Stage::first:
      return take_first(next);
    case Stage::across:
      return take_across(next);
    case Stage::distance:
      distance_->take(next);
      return judge_distance();
    case Stage::apart:
      best_.overlap = best_.n.dot(next.w);
      best_.farthest = hints_;
      return end(best_);
    case Stage::expanding:
      if (expanding_.take(next)) farthest_ = hints_;
      return judge_expanding();
    case Stage::done:
      return;
  }
}

void PolytopeSearch::take_first(const Difference& next) {
  const double overlap = n_.dot(next.w);
  if (-overlap > limit_) return end(LeastOverlap::beyond(n_, -overlap));
  simplex_.corners[0] = next;
  simplex_.count = 1;
  if (!(overlap > kDeepOverlap * std::min(pair_.A.thickness, pair_.B.thickness))) {
    return seek_distance();
  }
  across_ = around(n_);
  corner_count_ = 1;
  direction_ = &across_[0];
  stage_ = Stage::across;
}

void PolytopeSearch::take_across(const Difference& next) {
  corners_[corner_count_++] = next;
  if (corner_count_ < 4) {
    direction_ = &across_[corner_count_ - 1];
  } else if (begin_below(pair_, corners_, simplex_.corners[0], expanding_.polytope)) {
    expand(kKissing_m);
  } else {
    seek_distance();
  }
}

void PolytopeSearch::seek_distance() {
  stage_ = Stage::distance;
  distance_.emplace(Vector::Zero(), limit_, simplex_);
  judge_distance();
}

/// Deep along the middles, but apart elsewhere: along the face that told, or nearly.
void PolytopeSearch::seek_distance_from_face() {
  std::ranges::copy(expanding_.corners_of_face(), simplex_.corners.begin());
  simplex_.count = 3;
  seek_distance();
}

void PolytopeSearch::judge_distance() {
  if (!distance_->is_done()) {
    direction_ = &distance_->direction();
    return;
  }
  const Closest& found = distance_->found();
  if (found.kind == Closest::Kind::beyond_limit)
    return end(LeastOverlap::beyond(found.n, found.distance));
  // Of those that kiss, the closest points tell no direction.
  if (found.kind == Closest::Kind::apart && found.distance > kKissing_m) {
    best_ = {true, found.n, 0, found.p_A};
    best_.names = names_of(std::span(simplex_.corners).first(simplex_.count));
    if (lead_wanted_ > 0) {
      best_.lead = lead_of_closest(simplex_, found.distance);
      if (simplex_.count == 3) best_.sine = edge_sine(std::span(simplex_.corners).first(3));
    }
    direction_ = &best_.n;
    stage_ = Stage::apart;
    return;
  }
  const bool has_begun = (simplex_.count == 4 && expanding_.polytope.begin(simplex_.corners)) ||
                         begin_anywhere(pair_, hints_, expanding_.polytope);
  if (has_begun) {
    expand(-kInfinity);
  } else {
    fall_back();
  }
}

void PolytopeSearch::expand(double least) {
  stage_ = Stage::expanding;
  expanding_.begin(least, lead_wanted_);
  judge_expanding();
}

void PolytopeSearch::judge_expanding() {
  if (!expanding_.is_done()) {
    direction_ = &expanding_.direction();
  } else if (expanding_.has_found()) {
    best_ = expanding_.best();
    best_.farthest = farthest_;
    end(best_);
  } else if (!distance_) {
    seek_distance_from_face();
  } else {
    fall_back();
  }
}

void PolytopeSearch::fall_back() {
  best_ = descend(pair_, best_face(pair_, hints_), hints_);
  best_.lead = -1;
  end(best_);
}

void PolytopeSearch::end(const LeastOverlap& best) {
  best_ = best;
  stage_ = Stage::done;
}

}  // namespace cradle
