/// The least overlap of a pair by a plain search over all directions, by support functions alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/bench/solids.h"

namespace cradle {

/// Down from a direction by trial steps to all sides, ever shorter.
inline double descend(const Pair& pair, Vector n, double step) {
  double least = overlap(pair, n);
  while (step > 1e-6) {
    const Vector helper = std::abs(n.x()) < 0.6 ? Vector::UnitX() : Vector::UnitY();
    const Vector e = n.cross(helper).normalized(), f = n.cross(e);
    bool is_lower = false;
    for (int k = 0; k < 8; ++k) {
      const double angle = k * std::numbers::pi / 4 + 1e6 * step;  // turned anew for every step
      const Vector m = (n + step * (std::cos(angle) * e + std::sin(angle) * f)).normalized();
      const double there = overlap(pair, m);
      if (there < least - 1e-10) least = there, n = m, is_lower = true;
    }
    if (!is_lower) step *= 0.5;
  }
  return least;
}

/// One of `count` directions on a spiral from pole to pole, evenly.
inline Vector direction_of(int i, int count) {
  const double z = 1 - (2 * i + 1.0) / count, across = std::sqrt(1 - z * z);
  const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  return {across * std::cos(angle), across * std::sin(angle), z};
}

/// The least overlap over the sphere: of many directions the best few, followed down.
inline double least_overlap_by_search(const Pair& pair) {
  constexpr int kDirections = 1000;
  std::vector<std::pair<double, Vector>> tried;
  for (int i = 0; i < kDirections; ++i) {
    const Vector n = direction_of(i, kDirections);
    tried.emplace_back(overlap(pair, n), n);
  }
  std::ranges::sort(tried, {}, [](const auto& one) { return one.first; });
  double least = std::numeric_limits<double>::infinity();
  std::vector<Vector> begun;
  for (const auto& one : tried) {
    const Vector& n = one.second;
    if (std::ranges::any_of(begun, [&](const Vector& m) { return (m - n).norm() < 0.25; })) {
      continue;
    }
    begun.push_back(n);
    least = std::min(least, descend(pair, n, 0.05));
    if (begun.size() == 4) break;
  }
  return least;
}

/// Whether some direction parts them by at least `gap`: a proof if true.
inline bool are_apart(const Pair& pair, double gap) {
  constexpr int kDirections = 50;
  for (int i = 0; i < kDirections; ++i) {
    if (overlap(pair, direction_of(i, kDirections)) <= -gap) return true;
  }
  return least_overlap_by_search(pair) <= -gap;
}

}  // namespace cradle
