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

constexpr int kRimStepsMax = 24;
constexpr double kRimStill = 1e-6;  // rad, of a step: the error left is its square

/// Cosine and sine of a parameter.
struct Angle {
  double c, s;

  void normalise() {
    const double scale = 1 / std::sqrt(c * c + s * s);
    c *= scale;
    s *= scale;
  }
};

/// For y >= 0: by Newton's method between places where f has different signs. `by` is b times y, as
/// all over here.
Angle nearest_inside(double rx, double by, double K, Angle at) {
  Angle low{1, 0}, high{0, 1};
  for (int step = 0; step < kRimStepsMax; ++step) {
    const double f = rx * at.s - by * at.c - K * at.s * at.c;
    const double rise = rx * at.c + by * at.s - K * (at.c * at.c - at.s * at.s);
    (f > 0 ? high : low) = at;
    const double turn = rise > 0 ? -f / rise : 2;
    Angle next{at.c - turn * at.s, at.s + turn * at.c};
    // Of tangents: beyond the bracket it is halved.
    const bool is_between = std::abs(turn) < 1 && next.s * low.c >= next.c * low.s &&
                            next.s * high.c <= next.c * high.s;
    if (!is_between) next = {low.c + high.c, low.s + high.s};
    at = next;
    at.normalise();
    if (is_between && std::abs(turn) < kRimStill) break;
  }
  return at;
}

/// For y < 0: by Newton's method for f / (s c), from beyond the root. False if there is none.
bool nearest_beyond(double rx, double by, double K, Angle& at) {
  if (!(rx < K)) return false;
  at.c = rx / K;
  if (!(at.c > 0)) {
    at.s = 1;
    return -by < K;
  }
  at.s = std::sqrt(1 - at.c * at.c);
  for (int step = 0; step < kRimStepsMax; ++step) {
    const double g = rx / at.c - by / at.s - K;
    const double rise = rx * at.s / (at.c * at.c) + by * at.c / (at.s * at.s);
    if (!(rise > 0)) return false;
    const double turn = -g / rise;
    if (!(turn > -1)) return false;
    at = {at.c - turn * at.s, at.s + turn * at.c};
    if (!(at.s > 0)) return false;
    at.normalise();
    if (std::abs(turn) < kRimStill) break;
  }
  return true;
}

}  // namespace

bool nearest_on_quarter(double r, double b, double x, double y, Vector2& n) {
  const double K = r * r - b * b, rx = r * x, by = b * y;
  Angle at{b * x, r * y};
  if (y >= 0) {
    if (!(at.c * at.c + at.s * at.s > 0)) at = {K > 0 ? 0.0 : 1.0, 1};
    at.normalise();
    at = nearest_inside(rx, by, K, at);
  } else if (!nearest_beyond(rx, by, K, at)) {
    return false;
  }
  n = {b * at.c, r * at.s};
  const double length = n.norm();
  if (!(length > 0)) return false;
  n /= length;
  return true;
}

}  // namespace cradle
