/// The vertex of a hull that is farthest along a direction, from the few that may be. Private to
/// this folder.
#pragma once

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

#include "server/collision/direction_grid.h"
#include "server/collision/stored_geometry.h"

namespace cradle {

/// Of two comparisons, each all ones or zero: a bit each.
inline unsigned bits(const std::int64_t __attribute__((vector_size(16))) & is_so) {
#ifdef __SSE2__
  return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(is_so)));
#else
  return static_cast<unsigned>(is_so[0] & 1) | static_cast<unsigned>(is_so[1] & 2);
#endif
}

/// Of the candidates of the cell that `d` is in, four at a time. Which is farthest is chance: to
/// guess it by branches would cost more than to find it.
inline std::uint16_t farthest_likely(const ConvexHull& hull, std::size_t cell, const Vector& d) {
  using Two = DirectionGrid::Two;
  const FoursOfCell fours = hull.likely_of[cell];
  const FourVertices* four = hull.likely.data() + fours.first;
  std::uint16_t farthest = 0;
  double most = -std::numeric_limits<double>::infinity();
  for (const FourVertices* const end = four + fours.count; four != end; ++four) {
    const auto reach = [&](std::size_t k) {
      const auto two = [k](const std::array<double, 4>& p) { return Two{p[k], p[k + 1]}; };
      return two(four->x) * d.x() + (two(four->y) * d.y() + two(four->z) * d.z());
    };
    const Two front = reach(0), back = reach(2);
    const double r = std::max(std::max(front[0], front[1]), std::max(back[0], back[1]));
    const unsigned farthest_of = bits(front == r) | bits(back == r) << 2 | 8u;
    if (r > most)
      farthest = four->numbers[static_cast<std::size_t>(std::countr_zero(farthest_of))], most = r;
  }
  return farthest;
}

}  // namespace cradle
