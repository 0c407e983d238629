// Seen along the edge, the body of revolution is the hull of two ellipses and the edge a point p.
//
// Symbols: n = c e + s f a unit normal of the edge; a = n . b its share along the body's axis b,
// a' its derivative as n turns; r and z the radius and height of a rim, w from its middle to p.
//   h(n) = n . w + r sqrt(1 - a^2)                                     of one rim
//   h'   = n' . w - r a a' / sqrt(1 - a^2)
//   h''  = r (1 - a^2 - a'^2) / (1 - a^2)^(3/2) - h,
// where 1 - a^2 - a'^2 is the square of b's share along the edge.
// The overlap is the larger one of both rims. They are the same along the normals of the sides,
// which are where a / sqrt(1 - a^2) is what it is for all sides: two at most, in closed form.
//
// Between these the overlap is smooth. The point of the body that is deepest against one direction
// bounds all overlaps from below: of two such bounds the larger counts, and its least is where
// they cross. Where that is not below the best overlap so far the arc is done; else the overlap
// there is a bound more, and Newton's method goes down from it, or halves the arc. (It is the
// polytope that expands, in two dimensions.) Within 10 degrees of a minimum no other is sought.
//
// Cost: 20 ns for a minimum.
#include "server/collision/edge_arc.h"

namespace cradle {
namespace {

constexpr int kArcStepsMax = 40;     // where rims look like lines, the arc is halved often
constexpr int kDepthMax = 6;         // of arcs in arcs
constexpr double kArcLongest = 0.5;  // rad, of a step
constexpr double kArcStill = 1e-7;   // rad: the error left is its square
constexpr double kArcSameCosine = 0.985;
constexpr double kArcAsLow_m = 1e-11;
constexpr double kAlongAxis2 =
    1e-24;  // a squared sine: along the axis a rim has no point that counts

double square(double x) { return x * x; }

}  // namespace

EdgeArc::EdgeArc(const Revolved& body, const Vector& p, const Vector& m, const Vector& n,
                 double cosine, double most)
    : e_(m),
      f_((n - cosine * m).normalized()),
      end_c_(cosine),
      end_s_(f_.dot(n)),
      radii_{body.lower, body.upper},
      half_length_(body.half_length),
      axis_e_(e_.dot(body.axis)),
      axis_f_(f_.dot(body.axis)),
      axis_along2_(square(e_.cross(f_).dot(body.axis))),
      best_(most) {
  const Vector w = p - body.middle;
  const double w_e = e_.dot(w), w_f = f_.dot(w);
  const double z_e = half_length_ * axis_e_, z_f = half_length_ * axis_f_;
  w_e_ = {w_e + z_e, w_e - z_e};
  w_f_ = {w_f + z_f, w_f - z_f};
}

bool EdgeArc::find() {
  cut_at_sides(end_c_, end_s_);
  return has_found_;
}

EdgeArc::At EdgeArc::at(double c, double s, bool of_upper) const {
  const double r = radii_[of_upper], w_e = w_e_[of_upper], w_f = w_f_[of_upper];
  At at{c, s, c * w_e + s * w_f, c * w_f - s * w_e, 0};
  const double along = c * axis_e_ + s * axis_f_, turn = c * axis_f_ - s * axis_e_;
  const double across2 = turn * turn + axis_along2_;  // 1 - a^2 would be rounding where a is 1
  if (r > 0 && across2 > kAlongAxis2) {
    const double across = std::sqrt(across2), share = r / across;
    at.h += share * across2;
    at.slope -= share * along * turn;
    at.bend = share * axis_along2_ / across2;
  }
  at.bend -= at.h;
  return at;
}

void EdgeArc::take(const At& at, Rim rim) {
  if (!(at.h < best_)) return;
  best_ = at.h;
  best_c_ = at.c;
  best_s_ = at.s;
  rim_ = rim;
  is_minimum_ = at.is_minimum;
  has_found_ = true;
}

/// Looks between the ends of the arc and the normals of the sides in it.
void EdgeArc::cut_at_sides(double c_end, double s_end) {
  std::array<std::array<double, 2>, 4> cuts;
  std::size_t count = 0;
  cuts[count++] = {1, 0};
  // a = level along all normals of the sides.
  const double narrows = radii_[0] - radii_[1];
  const double level = -narrows / std::sqrt(4 * half_length_ * half_length_ + narrows * narrows);
  const double size2 = axis_e_ * axis_e_ + axis_f_ * axis_f_;
  const double left2 = size2 - level * level;
  if (left2 > 0) {
    const double root = std::sqrt(left2);
    std::array<std::array<double, 2>, 2> sides;
    for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
      const double aside = k == 0 ? root : -root;
      sides[k] = {(level * axis_e_ - aside * axis_f_) / size2,
                  (level * axis_f_ + aside * axis_e_) / size2};
    }
    const auto is_in = [&](const std::array<double, 2>& n) {
      return n[1] > 0 && n[0] * s_end - n[1] * c_end > 0;
    };
    if (sides[0][0] < sides[1][0]) std::swap(sides[0], sides[1]);
    for (const auto& side : sides) {
      if (is_in(side)) cuts[count++] = side;
    }
  }
  cuts[count++] = {c_end, s_end};
  for (std::size_t k = 1; k + 1 < count; ++k) take(at(cuts[k][0], cuts[k][1], false), Rim::side);
  for (std::size_t k = 0; k + 1 < count; ++k) {
    const auto &from = cuts[k], &to = cuts[k + 1];
    const double c = from[0] + to[0], s = from[1] + to[1];
    const double along = (c * axis_e_ + s * axis_f_) / std::sqrt(c * c + s * s);
    const bool of_upper =
        2 * half_length_ * along + narrows * std::sqrt(std::max(0.0, 1 - along * along)) < 0;
    find_between(at(from[0], from[1], of_upper), at(to[0], to[1], of_upper), of_upper, kDepthMax);
  }
}

void EdgeArc::find_between(const At& from, const At& to, bool of_upper, int depth) {
  if (radii_[of_upper] == 0 && from.h > 0 && to.h > 0) return;  // a point is nearest at an end
  // What the deepest point at one end leaves at the other.
  const double cosine = from.c * to.c + from.s * to.s, sine = from.c * to.s - from.s * to.c;
  const double at_end = from.h * cosine + from.slope * sine;
  const double at_begin = to.h * cosine - to.slope * sine;
  const double bound = best_ - kArcAsLow_m;
  if (at_end >= bound || at_begin >= bound || depth == 0) return;
  const double share = to.h - at_end, rest = from.h - at_begin;
  if (!(share > 0 && rest > 0)) return;
  const double length2 = share * share + rest * rest + 2 * share * rest * cosine;
  const double scale = 1 / std::sqrt(length2);
  const bool is_beside = from.is_minimum || to.is_minimum;
  const double needed = is_beside && best_ > 0 ? kArcSameCosine * best_ : bound;
  if (scale * (from.h * share + at_end * rest) >= needed) return;
  At middle =
      at(scale * (share * from.c + rest * to.c), scale * (share * from.s + rest * to.s), of_upper);
  if (from.slope < 0 && to.slope > 0) middle = down(middle, from, to, of_upper);
  take(middle, of_upper ? Rim::upper : Rim::lower);
  find_between(from, middle, of_upper, depth - 1);
  find_between(middle, to, of_upper, depth - 1);
}

/// To a minimum: the overlap falls at the beginning, and rises at the end.
EdgeArc::At EdgeArc::down(At from, At begin, At end, bool of_upper) const {
  for (int step = 0; step < kArcStepsMax && !from.is_minimum; ++step) {
    (from.slope < 0 ? begin : end) = from;
    const double turn = from.bend > 0 ? -from.slope / from.bend : kArcLongest;
    double c = from.c - turn * from.s, s = from.s + turn * from.c;
    const bool is_between =
        std::abs(turn) < kArcLongest && begin.c * s > begin.s * c && c * end.s > s * end.c;
    if (!is_between) c = begin.c + end.c, s = begin.s + end.s;
    const double scale = 1 / std::sqrt(c * c + s * s);
    from = at(scale * c, scale * s, of_upper);
    from.is_minimum = is_between && std::abs(turn) < kArcStill;
  }
  return from;
}

}  // namespace cradle
