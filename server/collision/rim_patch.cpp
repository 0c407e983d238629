// Two rims, by the angles of a point on each.
//
// Symbols: a and b unit vectors along the axes, out of each body at its rim; e across both; v_A
// across a, in the plane of both, with v_A . b > 0, and v_B likewise; d from the middle of A's rim
// to that of B's. The points are r_A (x_A v_A + y_A e) and r_B (x_B v_B - y_B e), with x and y the
// cosine and sine of an angle in [0, pi], and w = p_A - p_B - d is the point of M
// (revolved_pair.cpp) that they make. As v_A . v_B = -a . b,
//   |w|^2 / 2 = r_A r_B (a.b x_A x_B + y_A y_B) - r_A (d_A x_A + d_e y_A) + r_B (d_B x_B - d_e y_B)
// but for a constant. Where a ball about the origin touches M from inside, it is least. Newton's
// method finds a minimum; what leads off the arcs more than a few times is given up.
// (rim_pair.cpp has the same without arcs, in three dimensions, at twice the cost a step.)
//
// Cost: 15 ns a step; 2 to 5 steps.
#include "server/collision/rim_patch.h"

#include <algorithm>
#include <cmath>

namespace cradle {
namespace {

constexpr int kPatchStepsMax = 12;
constexpr int kStopsMax = 3;           // at the ends of arcs
constexpr double kPatchLongest = 0.5;  // rad, of a step
constexpr double kPatchStill = 1e-6;   // rad: the error left is its square
constexpr double kFlatPatch = 1e-6;    // of the product of the squared radii

double chord2(const HalfAngle& a, const HalfAngle& b) {
  const double c = a.c - b.c, s = a.s - b.s;
  return c * c + s * s;
}

/// Turned by about an angle, within the bounds; false if these were in the way.
bool turn(HalfAngle& at, double angle, double low, double high) {
  const double c = at.c - angle * at.s, s = at.s + angle * at.c;
  const double scale = 1 / std::sqrt(c * c + s * s);
  const HalfAngle next{scale * c, scale * s};
  if (next.s >= 0 && next.c >= low && next.c <= high) {
    at = next;
    return true;
  }
  const double end = angle > 0 ? low : high;
  at = at_cosine(end);
  return false;
}

}  // namespace

bool RimPatch::may_be_nearer(double most, const HalfAngle& at_A, const HalfAngle& at_B) const {
  const double w2 = r_A * r_A + r_B * r_B + d_squared +
                    2 * r_A * r_B * (cosine * at_A.c * at_B.c + at_A.s * at_B.s) -
                    2 * r_A * (d_A * at_A.c + d_e * at_A.s) +
                    2 * r_B * (d_B * at_B.c - d_e * at_B.s);
  const double reach = most + r_A * std::sqrt(chord2(at_A, at_cosine(low_A))) +
                       r_B * std::sqrt(chord2(at_B, at_cosine(low_B)));
  return w2 < reach * reach;
}

bool RimPatch::polish(HalfAngle& at_A, HalfAngle& at_B) const {
  const double both = r_A * r_B, square_A = r_A * r_A, square_B = r_B * r_B;
  int stops = 0;
  for (int step = 0; step < kPatchStepsMax; ++step) {
    const double x_A = at_A.c, y_A = at_A.s, x_B = at_B.c, y_B = at_B.s;
    const double slope_A = both * (x_A * y_B - cosine * y_A * x_B) + r_A * (d_A * y_A - d_e * x_A);
    const double slope_B = both * (y_A * x_B - cosine * x_A * y_B) - r_B * (d_B * y_B + d_e * x_B);
    const double common = both * (cosine * x_A * x_B + y_A * y_B);
    double AA = r_A * (d_A * x_A + d_e * y_A) - common;
    double BB = r_B * (d_e * y_B - d_B * x_B) - common;
    const double AB = both * (cosine * y_A * y_B + x_A * x_B);
    double determinant = AA * BB - AB * AB;
    const bool is_valley = determinant > kFlatPatch * square_A * square_B && AA > 0;
    if (!is_valley) {  // down as if w were 0
      AA = 1.01 * square_A;
      BB = 1.01 * square_B;
      determinant = AA * BB - AB * AB;
    }
    double turn_A = (AB * slope_B - BB * slope_A) / determinant;
    double turn_B = (AB * slope_A - AA * slope_B) / determinant;
    const double most = std::max(std::abs(turn_A), std::abs(turn_B));
    if (most > kPatchLongest) {
      turn_A *= kPatchLongest / most;
      turn_B *= kPatchLongest / most;
    }
    const bool is_in_A = turn(at_A, turn_A, low_A, high_A);
    const bool is_in_B = turn(at_B, turn_B, low_B, high_B);
    if (most < kPatchStill) return true;
    if (!(is_in_A && is_in_B) && ++stops > kStopsMax) return false;
  }
  return true;
}

}  // namespace cradle
