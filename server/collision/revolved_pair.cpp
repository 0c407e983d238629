// Cylinders and cones at cones: every smooth part of M's surface that may be nearest.
//
// Symbols: A and B the bodies, a and b their axes; e a unit vector across both, toward B; n a unit
// vector from A to B; M the set of all points of A less those of B, h(n) the overlap.
//
// A ball about the origin that touches M from inside touches a smooth part of its surface, as in
// closed_overlap.cpp:
//   a cap and what is deepest behind it       its normal
//   two sides                                 two normals, that are along both sides'
//   a side and a tip                          from the axis to the tip, leaning as the side does
//   a side and a rim                          a row of normals, two minima at most (side_arc.h)
//   two rims                                  a patch: Newton's method (rim_patch.h)
// M mirrored in the plane of both axes is M again, but for where it is: so the best n has n . e >=
// 0, and of what is mirrored one is looked at. The least h of all is the least overlap.
//
// Few are looked at: with a ball of radius R inside B about c, h(n) is R at least and how far c is
// behind the part of A that n belongs to, and the same from B. And the two rims must come nearer to
// each other than the least overlap so far (revolved_rims.cpp).
//
// If there is an overlap, the best of these is a local minimum of h: what touches is opposite each
// other. Where it is not, a minimum of the rims was missed, or the cores are apart after all, with
// a tip or rim nearest: these are found by polytope (curved_search.cpp). Of cores that are apart,
// points that are opposite each other are the closest; else they are sought by going to and fro
// between the nearest points of either, and known by their distance, which is that along n.
//
// Cost: at a cap 60 ns; elsewhere two cones 350 .. 500 ns, a cylinder and a cone 370 .. 630. (Two
// cylinders would take 80 to 800: cylinder_overlap.cpp knows their symmetry, and is quicker.)
#include "server/collision/revolved_pair.h"

#include <array>
#include <cmath>

#include "server/collision/lead.h"
#include "server/collision/revolved_search.h"
#include "server/collision/side_arc.h"

namespace cradle {
namespace {

constexpr double kTouching_m = 1e-12;  // overlaps less than this are none

// The closest points of what is apart.
constexpr int kClosestStepsMax = 4;
constexpr double kSure = 1e-12;  // distances this near to each other are one: relative, and
constexpr double kRoundingOfWay = 1e-15;  // of the way between the middles

}  // namespace

void RevolvedPair::try_caps() {
  const double z = pair_.t.z(), w = pair_.t.dot(B_.axis);
  // Out of A along -a or a: B reaches along the opposite.
  take(-A_.axis, A_.half_length + B_.reach_along(cosine_, sine_) + z, PairTouch::face_of_A);
  if (A_.upper > 0) {
    take(A_.axis, A_.half_length + B_.reach_along(-cosine_, sine_) - z, PairTouch::face_of_A);
  }
  take(B_.axis, B_.half_length + A_.reach_along(cosine_, sine_) - w, PairTouch::face_of_B);
  if (B_.upper > 0) {
    take(-B_.axis, B_.half_length + A_.reach_along(-cosine_, sine_) + w, PairTouch::face_of_B);
  }
}

void RevolvedPair::try_sides() {
  const double w = pair_.t.dot(B_.axis);
  const View of_A{A_, B_, below_A_, below_B_, u_A_, 1, pair_.t.z(), pair_.t.dot(u_A_)};
  const View of_B{B_, A_, below_B_, below_A_, u_B_, -1, -w, -pair_.t.dot(u_B_)};
  // n.a = up_A, -n.b = up_B
  const double x = -B_.up - A_.up * cosine_, scale = A_.out * sine_;
  if (x * x < scale * scale) {
    const double c = x / scale;
    const HalfAngle at{c, std::sqrt(1 - c * c)};
    const Vector n = normal_at(of_A, at);
    take(n, A_.reach + B_.reach - n.dot(pair_.t), PairTouch::lines);
  }
  try_side(of_A);
  try_side(of_B);
}

/// The rims of the other, or its tip, at a side: each with the normals to which it is farthest.
void RevolvedPair::try_side(const View& view) {
  if (!(view.below_one.side < best_.overlap)) return;
  const double p = view.one.up * cosine_, q = view.one.out * sine_, x = -view.other.up - p;
  double low = -1;
  if (x >= q)
    low = 1;
  else if (x > -q)
    low = x / q;
  if (low < 1) try_side_at(view, false, low, 1);
  if (low > -1) try_side_at(view, true, -1, low);
}

void RevolvedPair::try_side_at(const View& view, bool of_upper, double low, double high) {
  if (!(view.below_other.rims[of_upper] < best_.overlap)) return;
  const RevolvedBody &one = view.one, &other = view.other;
  const double height = of_upper ? other.half_length : -other.half_length;
  const double up = one.up, out = one.out;
  const double d_u = out * (view.d_u + height * sine_), d_e = out * t_e_;
  const double rest = one.reach - up * (view.d_a + height * cosine_);
  const double r = other.radius(of_upper), length = std::sqrt(d_u * d_u + d_e * d_e);
  const PairTouch touch = view.sign > 0 ? PairTouch::on_B : PairTouch::on_A;
  if (!(rest - length < best_.overlap)) return;
  if (r == 0) {
    const HalfAngle at = length > 0 ? HalfAngle{d_u / length, d_e / length} : HalfAngle{0, 1};
    if (at.c >= low && at.c <= high) take(normal_at(view, at), rest - length, touch);
    return;
  }
  const SideArc arc{d_u, d_e, r, up * cosine_, out * sine_};
  const double most = best_.overlap - rest;
  if (!(arc.ends_bound(low, high) < most && arc.point_bound(low, high, up, cosine_) < most)) return;
  std::array<HalfAngle, 2> found;
  const std::size_t count = arc.minima(low, high, found);
  for (std::size_t k = 0; k < count; ++k) {
    take(normal_at(view, found[k]), rest + arc.overlap(found[k]), touch);
  }
}

/// Where the sides' lines that touch cross, seen along n: as shares from the lower rims.
void RevolvedPair::cross_lines(double& on_A, double& on_B) const {
  const Vector& n = best_.n;
  const Vector low_A = A_.on_rim(n, false), side_A = A_.on_rim(n, true) - low_A;
  const Vector low_B = B_.on_rim(-n, false), side_B = B_.on_rim(-n, true) - low_B;
  const Vector between = low_B - low_A;
  const double rise = n.dot(side_B.cross(side_A));
  if (rise == 0) {
    on_A = on_B = 0.5;
    return;
  }
  on_A = n.dot(side_B.cross(between)) / rise;
  on_B = n.dot(side_A.cross(between)) / rise;
}

/// The point of the other that is deepest behind a face or side of the one with the normal m. Where
/// its own side or cap is level with that many are: the one nearest to the middle.
Vector RevolvedPair::deepest_in(const RevolvedBody& one, const RevolvedBody& other,
                                const Vector& m) {
  const Vector lower = other.on_rim(-m, false), upper = other.on_rim(-m, true);
  const Vector side = upper - lower;
  if (std::abs(m.dot(side)) < kLevel_m) {
    const double on = (one.middle - lower).dot(side) / side.squaredNorm();
    return lower + std::clamp(on, 0.0, 1.0) * side;
  }
  const bool of_upper = m.dot(side) < 0;
  const double r = other.radius(of_upper);
  if (!(r * m.cross(other.axis).norm() < kLevel_m)) return of_upper ? upper : lower;
  const Vector middle = other.middle_of(of_upper), d = one.middle - middle;
  const Vector across = d - d.dot(other.axis) * other.axis;
  const double length = across.norm();
  return middle + (length > r ? r / length : 1) * across;
}

LeastOverlap RevolvedPair::result() const {
  const Vector& n = best_.n;
  Vector p = A_.farthest(n);
  if (touch_ == PairTouch::face_of_A || touch_ == PairTouch::on_B) {
    p = deepest_in(A_, B_, n) + best_.overlap * n;
  } else if (touch_ == PairTouch::face_of_B || touch_ == PairTouch::on_A) {
    p = deepest_in(B_, A_, -n);
  } else if (touch_ == PairTouch::lines) {
    double on_A = 0, on_B = 0;
    cross_lines(on_A, on_B);
    const Vector low = A_.on_rim(n, false);
    p = low + std::clamp(on_A, 0.0, 1.0) * (A_.on_rim(n, true) - low);
  }
  return {true, n, best_.overlap, p,
          best_.overlap < -kKissing_m ? lead_by_turn(-best_.overlap) : -1};
}

std::optional<LeastOverlap> RevolvedPair::at_face() {
  const bool is_of_A = touch_ == PairTouch::face_of_A;
  return certain_at_face(pair_, result(), is_of_A ? FaceDirection::Of::A : FaceDirection::Of::B,
                         lead_wanted_);
}

/// Of cores that are apart: from what is nearest along the best direction, or a tip.
std::optional<LeastOverlap> RevolvedPair::closest_points() {
  if (const auto found = closest_points_from(result().p_A)) return found;
  if (A_.upper == 0) {
    if (const auto found = closest_points_from(A_.middle_of(true))) return found;
  }
  if (B_.upper > 0) return std::nullopt;
  return closest_points_from(A_.nearest(B_.middle_of(true)));
}

std::optional<LeastOverlap> RevolvedPair::closest_points_from(Vector p) {
  for (int step = 0; step < kClosestStepsMax; ++step) {
    const Vector q = B_.nearest(p);
    p = A_.nearest(q);
    const Vector v = q - p;
    const double distance = v.norm();
    if (distance < kKissing_m) return std::nullopt;
    attempt(v / distance, PairTouch::on_A);
    if (-best_.overlap < distance - kSure * distance - kRoundingOfWay * pair_.t.norm()) continue;
    if (is_beyond_limit()) return LeastOverlap::beyond(best_.n, -best_.overlap);
    return LeastOverlap{true, best_.n, best_.overlap, p, lead_by_turn(distance)};
  }
  return std::nullopt;
}

std::optional<LeastOverlap> RevolvedPair::find() {
  try_caps();
  if (is_beyond_limit()) return LeastOverlap::beyond(best_.n, -best_.overlap);
  if (const auto found = at_face()) return found;
  try_sides();
  if (is_beyond_limit()) return LeastOverlap::beyond(best_.n, -best_.overlap);
  if (best_.overlap > 0) try_rims();
  const bool is_found = is_minimum();
  best_.overlap = overlap(best_.n);
  if (is_beyond_limit()) return LeastOverlap::beyond(best_.n, -best_.overlap);
  if (is_found && (best_.overlap > -kTouching_m || touch_ != PairTouch::rims)) return result();
  if (best_.overlap < kTouching_m) return closest_points();
  return std::nullopt;
}

std::optional<LeastOverlap> revolved_pair_overlap(const ConvexPair& pair, double limit,
                                                  double lead_wanted) {
  const auto is_revolved = [](ShapeKind kind) {
    return kind == ShapeKind::cone || kind == ShapeKind::cylinder;
  };
  if (!is_revolved(pair.A.kind) || !is_revolved(pair.B.kind)) return std::nullopt;
  return RevolvedPair(pair, limit, lead_wanted).find();
}

}  // namespace cradle
