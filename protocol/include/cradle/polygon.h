/// What a convex polygon must be, for client and server alike.
#pragma once

#include <cradle/limits.h>
#include <cradle/types.h>

#include <cmath>
#include <span>
#include <string_view>

namespace cradle {

/// What is wrong with the corners of a polygon, to go on after its name; empty: nothing. They must
/// run counter-clockwise, three or more, each corner turning left; within limits::kSizeMax_m, and
/// nowhere thinner than limits::kSizeMin_m.
inline std::string_view polygon_fault(std::span<const Vec2> corners) {
  const std::size_t n = corners.size();
  if (n < 3) return "needs three corners or more";
  if (n > static_cast<std::size_t>(limits::kCorners)) return "has too many corners";
  for (const Vec2& p : corners) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) return "has a corner that is not finite";
    if (std::abs(p.x) > limits::kSizeMax_m || std::abs(p.y) > limits::kSizeMax_m) {
      return "has a corner too far away";
    }
  }
  for (std::size_t k = 0; k < n; ++k) {
    const Vec2 &a = corners[k], &b = corners[(k + 1) % n];
    const double ex = b.x - a.x, ey = b.y - a.y, length = std::sqrt(ex * ex + ey * ey);
    if (length < limits::kSizeMin_m) return "has an edge that is too short";
    double widest = 0;
    for (std::size_t j = 2; j < n; ++j) {
      const Vec2& p = corners[(k + j) % n];
      // By more than rounding, so that an edge is not cut into two.
      const double beside = (ex * (p.y - a.y) - ey * (p.x - a.x)) / length;
      if (std::abs(beside) <= 1e-9 * length) {
        return "has three corners on one line; leave out the one between the others";
      }
      if (beside < 0) return "is not convex with its corners counter-clockwise";
      widest = std::fmax(widest, beside);
    }
    if (widest < limits::kSizeMin_m) return "is too thin";
  }
  return {};
}

}  // namespace cradle
