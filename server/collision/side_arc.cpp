// The side of a cylinder or cone at a rim of another body of revolution.
//
// Symbols: a the axis of the side, its normals n = k a + l (cos phi u + sin phi e), with u across a
// in the plane of both axes, and e across both; D from the middle of the body to that of the rim,
// d_u = l D.u, d_e = l D.e; r the radius of the rim, b its axis, n . b = p + q cos phi. The overlap
// is a constant and
//   f(phi) = -d_u cos phi - d_e sin phi + r sqrt(1 - (p + q cos phi)^2).
// As d_e >= 0, a minimum has phi in [0, pi]. There, over x = cos phi,
//   f'' = d_e (1 - x^2)^(-3/2) - r q^2 (1 - (p + q x)^2)^(-3/2),
// which is 0 where (1 - (p + q x)^2) = k (1 - x^2), k = (r q^2 / d_e)^(2/3): at two places at most,
// between which f is concave. So f has one minimum, or one on either side of these. Each is found
// by Newton's method, between places where the slope has different signs.
//
// Cost: 20 ns, and 10 ns a step; 2 to 5 steps.
#include "server/collision/side_arc.h"

#include <algorithm>
#include <cmath>

namespace cradle {
namespace {

constexpr int kSideStepsMax = 40;
constexpr double kSideStill = 1e-7;  // rad, of a step: the error left is about its square
constexpr double kLeast = 1e-9;      // of d_e, beside r q^2: below, f bends at the ends only
constexpr double kSideAlong2 =
    1e-24;  // a squared sine: along its axis a rim has no point that counts

HalfAngle half_angle(double c, double s) { return between({c, s}, {c, s}); }

}  // namespace

double SideArc::overlap(const HalfAngle& at) const {
  const double along = from + turn * at.c;
  return r * std::sqrt(std::max(0.0, 1 - along * along)) - d_u * at.c - d_e * at.s;
}

double SideArc::ends_bound(double low, double high) const {
  const auto across2 = [this](double c) { return 1 - (from + turn * c) * (from + turn * c); };
  const double least2 = std::max(0.0, std::min(across2(low), across2(high)));
  return r * std::sqrt(least2) - std::sqrt(d_u * d_u + d_e * d_e);
}

double SideArc::point_bound(double low, double high, double up, double cosine) const {
  const double length = std::sqrt(d_u * d_u + d_e * d_e);
  if (!(length > 0)) return -length;
  const HalfAngle at = at_cosine(std::clamp(d_u / length, low, high));
  const double along = from + turn * at.c, across2 = 1 - along * along;
  if (!(across2 > kSideAlong2)) return -length;
  const double share = r / std::sqrt(across2), out2 = 1 - up * up;
  const double u = d_u - share * (out2 * at.c - along * turn), e = d_e - share * out2 * at.s;
  return up * share * (up - along * cosine) - std::sqrt(u * u + e * e);
}

double SideArc::to_u(const HalfAngle& at) const {
  const double along = from + turn * at.c, across2 = 1 - along * along;
  return d_u + (across2 > kSideAlong2 ? r * turn * along / std::sqrt(across2) : 0);
}
double SideArc::slope(const HalfAngle& at) const { return to_u(at) * at.s - d_e * at.c; }

std::size_t SideArc::minima(double low, double high, std::array<HalfAngle, 2>& found) const {
  const double square = turn * turn;
  // f'' > 0 where (k - q^2) x^2 - 2 p q x + 1 - p^2 - k > 0.
  if (r > d_e * std::abs(turn)) {  // k > q^2
    const double root = std::cbrt(r * square / std::max(d_e, kLeast * r * square)), k = root * root;
    const double opens = k - square, half = from * turn, left = 1 - from * from - k;
    const double under = half * half - opens * left;
    if (under > 0) {
      const double width = std::sqrt(under), x_1 = (half - width) / opens,
                   x_2 = (half + width) / opens;
      if (x_1 < high && x_2 > low) {
        const double first = std::max(x_1, low), last = std::min(x_2, high);
        std::size_t count = 0;
        // At the plane of the axes f goes on as its mirror image: there is a minimum if it falls.
        if (last < high || high == 1) {
          found[count++] = least_between(at_cosine(high), at_cosine(last));
        }
        if (first > low || low == -1) {
          found[count++] = least_between(at_cosine(first), at_cosine(low));
        }
        return count;
      }
    }
  }
  found[0] = least_between(at_cosine(high), at_cosine(low));
  return 1;
}

HalfAngle SideArc::least_between(HalfAngle begin, HalfAngle end) const {
  const double first = slope(begin);
  // In the plane of the axes either end is level: it may be a maximum.
  if (first > 0 || (first == 0 && to_u(begin) >= 0)) return begin;
  if (slope(end) <= 0) return end;
  const double length2 = d_u * d_u + d_e * d_e;
  HalfAngle at = length2 > 0 ? half_angle(d_u, d_e) : HalfAngle{0, 1};
  const auto is_inside = [&](double c, double s) {
    return begin.c * s > begin.s * c && c * end.s > s * end.c;
  };
  if (!is_inside(at.c, at.s)) at = between(begin, end);
  for (int step = 0; step < kSideStepsMax; ++step) {
    const double along = from + turn * at.c, across2 = 1 - along * along;
    double to_u = d_u, bend = 0;
    if (across2 > kSideAlong2) {
      const double share = r * turn / std::sqrt(across2);
      to_u += share * along;
      bend = share * turn * at.s * at.s / across2;
    }
    const double rise = to_u * at.s - d_e * at.c;
    bend = to_u * at.c + d_e * at.s - bend;
    (rise < 0 ? begin : end) = at;
    const double angle = bend > 0 ? -rise / bend : 2;
    double c = at.c - angle * at.s, s = at.s + angle * at.c;
    const bool is_between = std::abs(angle) < 1 && is_inside(c, s);
    if (!is_between && std::abs(angle) < kSideStill) break;
    at = is_between ? half_angle(c, s) : between(begin, end);
    if (is_between && std::abs(angle) < kSideStill) break;
  }
  return at;
}

}  // namespace cradle
