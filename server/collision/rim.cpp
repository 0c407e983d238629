// The nearest point of a quarter of an ellipse.
//
// Symbols: (r c, b s) a point of it, c and s cosine and sine of its parameter; K = r^2 - b^2. Half
// the squared distance from (x, y) has the derivative
//   f = r x s - b y c - K s c.
// For y >= 0 it has one root, a minimum; for y < 0 none or two, and the second is the minimum. It
// is found by Newton's method: for y >= 0 between places where the signs differ, for y < 0 for f /
// (s c), which is convex, from beyond the root, so that all steps go one way.
//
// Cost: 2 to 5 steps of 10 ns.
#include "server/collision/rim.h"

namespace cradle {
namespace {

constexpr int kStepsMax = 24;
constexpr double kStill = 1e-6;  // rad, of a step: the error left is its square

void normalise(double& c, double& s) {
  const double scale = 1 / std::sqrt(c * c + s * s);
  c *= scale;
  s *= scale;
}

}  // namespace

bool nearest_on_quarter(double r, double b, double x, double y, Vector2& n) {
  const double K = r * r - b * b, rx = r * x, by = b * y;
  double c, s;
  if (y >= 0) {
    c = b * x, s = r * y;
    if (!(c * c + s * s > 0)) c = K > 0 ? 0 : 1, s = 1;
    normalise(c, s);
    double low_c = 1, low_s = 0, high_c = 0, high_s = 1;
    for (int step = 0; step < kStepsMax; ++step) {
      const double f = rx * s - by * c - K * s * c;
      const double rise = rx * c + by * s - K * (c * c - s * s);
      if (f > 0) {
        high_c = c, high_s = s;
      } else {
        low_c = c, low_s = s;
      }
      const double turn = rise > 0 ? -f / rise : 2;
      double next_c = c - turn * s, next_s = s + turn * c;
      // Of tangents: beyond the bracket it is halved.
      const bool is_between = std::abs(turn) < 1 && next_s * low_c >= next_c * low_s &&
                              next_s * high_c <= next_c * high_s;
      if (!is_between) next_c = low_c + high_c, next_s = low_s + high_s;
      c = next_c, s = next_s;
      normalise(c, s);
      if (is_between && std::abs(turn) < kStill) break;
    }
  } else {
    if (!(rx < K)) return false;
    c = rx / K;
    if (c > 0) {
      s = std::sqrt(1 - c * c);
      for (int step = 0; step < kStepsMax; ++step) {
        const double g = rx / c - by / s - K;
        const double rise = rx * s / (c * c) + by * c / (s * s);
        if (!(rise > 0)) return false;
        const double turn = -g / rise;
        if (!(turn > -1)) return false;
        const double next_c = c - turn * s;
        s += turn * c;
        c = next_c;
        if (!(s > 0)) return false;
        normalise(c, s);
        if (std::abs(turn) < kStill) break;
      }
    } else {
      if (!(-by < K)) return false;
      s = 1;
    }
  }
  n = {b * c, r * s};
  const double length = n.norm();
  if (!(length > 0)) return false;
  n /= length;
  return true;
}

}  // namespace cradle
