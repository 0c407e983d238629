// A rim of each of two cylinders or cones (revolved_pair.cpp): where to look for minima.
//
// Symbols as there and in rim_patch.cpp, d the overlap that is to be surpassed. At a minimum with
// the overlap h < d the point of M is h n, and so the point of one rim is beside the plane of the
// other by h times the share of n along the other's axis. That share is between those of the cap's
// normal and of the side's: so the points lie on a short arc each, the shorter the smaller d is,
// and mostly on none. On both arcs there may be two minima, where the rims cross twice, seldom
// more. Newton's method begins in the middle and at all four corners: of 24 000 random poses no
// minimum was missed by that; 49 by the middle alone, 16 by the two corners where one rim is near
// the side and the other near the cap, 2 by the four corners.
#include <cmath>

#include "server/collision/revolved_search.h"

namespace cradle {
namespace {

constexpr double kOpposite = 1e-7;     // of the radii: what Newton's method has left of the way
constexpr double kRounding_m = 1e-12;  // where ends meet

}  // namespace

void RevolvedPair::try_rims() {
  if (!(sine_ > 0)) return;
  for (const bool upper_A : {false, true}) {
    for (const bool upper_B : {false, true}) {
      if (A_.radius(upper_A) > 0 && B_.radius(upper_B) > 0) try_rims(upper_A, upper_B);
    }
  }
}

void RevolvedPair::try_rims(bool upper_A, bool upper_B) {
  const double most = best_.overlap;
  if (!(below_A_.rims[upper_A] < most && below_B_.rims[upper_B] < most)) return;
  const Rims both = rims(upper_A, upper_B, most);
  const RimPatch& patch = both.patch;
  if (patch.is_empty()) return;
  const HalfAngle low_A = at_cosine(patch.low_A), high_A = at_cosine(patch.high_A);
  const HalfAngle low_B = at_cosine(patch.low_B), high_B = at_cosine(patch.high_B);
  const HalfAngle middle_A = between(low_A, high_A), middle_B = between(low_B, high_B);
  if (!patch.may_be_nearer(most, middle_A, middle_B)) return;
  try_rims_from(both, middle_A, middle_B);
  try_rims_from(both, low_A, high_B);
  try_rims_from(both, high_A, low_B);
  try_rims_from(both, high_A, high_B);
  try_rims_from(both, low_A, low_B);
}

/// With the arcs on which a place with an overlap below `most` may be.
RevolvedPair::Rims RevolvedPair::rims(bool upper_A, bool upper_B, double most) const {
  const double out_A = upper_A ? 1 : -1, out_B = upper_B ? 1 : -1;  // of the axes
  const double r_A = A_.radius(upper_A), r_B = B_.radius(upper_B);
  const Vector d = B_.middle_of(upper_B) - A_.middle_of(upper_A);
  const Vector v_A = out_B * u_A_, v_B = out_A * u_B_;
  const double d_a = out_A * d.z(), d_b = out_B * d.dot(B_.axis);
  const double lean_A = -out_A * A_.up, lean_B = -out_B * B_.up;
  const double to_A = 1 / (r_B * sine_), to_B = 1 / (r_A * sine_);
  return {v_A,
          v_B,
          {r_A, r_B, out_A * out_B * cosine_, d.dot(v_A), d.dot(v_B), t_e_, d.squaredNorm(),
           std::max(-1.0, (d_b - most) * to_B), std::min(1.0, (d_b + lean_B * most) * to_B),
           std::max(-1.0, (-most - d_a) * to_A), std::min(1.0, (lean_A * most - d_a) * to_A)}};
}

bool RevolvedPair::try_rims_from(const Rims& both, HalfAngle at_A, HalfAngle at_B) {
  if (!both.patch.polish(at_A, at_B)) return false;
  const Vector q_A = at_A.c * e_ - at_A.s * both.v_A, q_B = at_B.c * e_ + at_B.s * both.v_B;
  const Vector across = q_A.cross(q_B);  // of both tangents
  const double length = across.norm();
  if (!(length > 0)) return false;
  const bool is_out = across.dot(at_A.c * both.v_A + at_A.s * e_) > 0;
  return attempt(across / (is_out ? length : -length), PairTouch::rims);
}

/// Whether the best direction is a minimum; if it is not, two rims beside what touches may make
/// one, and it is that.
bool RevolvedPair::is_minimum() {
  Beside beside;
  if (is_opposite(beside)) return true;
  return try_rims_beside(beside) && is_opposite(beside);
}

/// Whether what touches along the best direction is opposite each other.
bool RevolvedPair::is_opposite(Beside& beside) const {
  const Vector& n = best_.n;
  auto& [p_A, p_B, upper_A, upper_B] = beside;
  if (touch_ == PairTouch::rims) {
    const Vector a = A_.farthest(n), b = B_.farthest(-n);
    p_A = a, upper_A = a.z() > 0;
    p_B = b - B_.middle, upper_B = p_B.dot(B_.axis) > 0;
    const double still = kOpposite * (A_.lower + B_.lower);
    return (a - b - best_.overlap * n).squaredNorm() <= still * still;
  }
  if (touch_ == PairTouch::lines) {
    double on_A = 0, on_B = 0;
    cross_lines(on_A, on_B);
    p_A = n, upper_A = on_A > 0.5;
    p_B = -n, upper_B = on_B > 0.5;
    return on_A >= 0 && on_A <= 1 && on_B >= 0 && on_B <= 1;
  }
  if (touch_ == PairTouch::face_of_A || touch_ == PairTouch::on_B) {
    return is_opposite(A_, B_, n, p_A, upper_A, p_B, upper_B);
  }
  return is_opposite(B_, A_, -n, p_B, upper_B, p_A, upper_A);
}

/// The face or side of the one, with m out of it, at a point of the other.
bool RevolvedPair::is_opposite(const RevolvedBody& one, const RevolvedBody& other, const Vector& m,
                               Vector& p_one, bool& upper_one, Vector& p_other,
                               bool& upper_other) const {
  const Vector q = deepest_in(one, other, m);
  const Vector d = q - one.middle;
  p_other = q - other.middle;
  upper_other = p_other.dot(other.axis) > 0;
  if (is_at_face()) {
    p_one = d;
    upper_one = m.dot(one.axis) > 0;
    return (d - d.dot(one.axis) * one.axis).squaredNorm() <= one.lower * one.lower;
  }
  const double on = one.axis.dot(d + best_.overlap * m);
  p_one = m;
  upper_one = on > 0;
  // Of a disc that is level with the side, no point need lie over the line that touches.
  const double beside = one.axis.cross(m).dot(d);
  return std::abs(on) <= one.half_length + kRounding_m &&
         std::abs(beside) <= kOpposite * (one.lower + other.lower);
}

bool RevolvedPair::try_rims_beside(const Beside& beside) {
  const auto& [p_A, p_B, upper_A, upper_B] = beside;
  if (!(sine_ > 0 && A_.radius(upper_A) > 0 && B_.radius(upper_B) > 0)) return false;
  const Rims both = rims(upper_A, upper_B, kInfinity);
  const auto angle = [](double c, double s) {
    return between({c, std::max(0.0, s)}, {c, std::max(0.0, s)});
  };
  return try_rims_from(both, angle(p_A.dot(both.v_A), p_A.dot(e_)),
                       angle(p_B.dot(both.v_B), -p_B.dot(e_)));
}

}  // namespace cradle
