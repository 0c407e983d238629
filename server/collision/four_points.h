/// Which four of many contact points to keep. Private to this folder.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "server/collision/geometry.h"
#include "server/collision/tolerances.h"

namespace cradle {

/// Places of candidates side by side, the chosen ones first.
class Ranking {
 public:
  template <typename Candidate>
  explicit Ranking(std::span<const Candidate> candidates) : count(candidates.size()) {
    for (std::size_t k = 0; k < count; ++k) {
      const Vector& p = candidates[k].p;
      x[k] = p.x(), y[k] = p.y(), z[k] = p.z();
      number[k] = static_cast<std::uint8_t>(k);
    }
  }

  /// Swaps to place `first` the candidate from there on that scores highest: the first of those
  /// that are no less than `enough(highest)`.
  template <typename Enough, typename Score>
  void choose(std::size_t first, Enough enough, Score score) {
    std::array<double, kMost> scores;
    double highest = -std::numeric_limits<double>::infinity();
    for (std::size_t k = first; k < count; ++k) {
      scores[k] = score(k);
      highest = std::max(highest, scores[k]);
    }
    std::size_t best = first;
    const double least = enough(highest);
    while (best + 1 < count && !(scores[best] >= least)) ++best;
    std::swap(x[first], x[best]);
    std::swap(y[first], y[best]);
    std::swap(z[first], z[best]);
    std::swap(number[first], number[best]);
  }

  static constexpr std::size_t kMost = 128;
  std::array<double, kMost> x, y, z;
  std::array<std::uint8_t, kMost> number;
  std::size_t count;
};

/// Brings to the front the four that carry most: the deepest, the farthest from it, and those two
/// that then add most area, which are on both sides if there are points on both. Of a candidate p
/// only `p.p` counts: x and y its place across the normal, z its separation, all in m. More than
/// four are given, and no more than 128. The first gets the least separation of all, from which it
/// is no farther than a tie.
template <typename Candidate>
void bring_best_four(std::span<Candidate> candidates) {
  Ranking r{std::span<const Candidate>(candidates)};
  constexpr double kTie = kTolerances.tie_m;
  const auto by_tie = [](double highest) { return highest - kTie; };
  r.choose(0, by_tie, [&](std::size_t k) { return -r.z[k]; });
  const double x = r.x[0], y = r.y[0];
  const auto by_tie_of_root = [](double highest) {
    const double least = std::max(std::sqrt(highest) - kTie, 0.0);
    return least * least;
  };
  r.choose(1, by_tie_of_root, [&](std::size_t k) {
    const double dx = r.x[k] - x, dy = r.y[k] - y;
    return dx * dx + dy * dy;
  });
  const double q_x = r.x[1] - x, q_y = r.y[1] - y;
  const double area_tie = kTie * std::sqrt(q_x * q_x + q_y * q_y);
  const auto by_area_tie = [&](double highest) { return highest - area_tie; };
  // Areas are those of triangles, twice.
  r.choose(2, by_area_tie,
           [&](std::size_t k) { return std::abs(q_x * (r.y[k] - y) - q_y * (r.x[k] - x)); });
  // The fourth is beyond a side of the triangle of the others.
  const double r_x = r.x[2] - x, r_y = r.y[2] - y;
  const double area = q_x * r_y - q_y * r_x, turn = area < 0 ? -1 : 1;
  r.choose(3, by_area_tie, [&](std::size_t k) {
    const double s_x = r.x[k] - x, s_y = r.y[k] - y;
    const double of_q = turn * (q_x * s_y - q_y * s_x), of_r = turn * (s_x * r_y - s_y * r_x);
    return -std::min(std::min(of_q, of_r), turn * area - of_q - of_r);
  });
  std::array<Candidate, 4> best = {candidates[r.number[0]], candidates[r.number[1]],
                                   candidates[r.number[2]], candidates[r.number[3]]};
  best[0].p.z() = *std::min_element(r.z.begin(), r.z.begin() + r.count);
  std::ranges::copy(best, candidates.begin());
}

}  // namespace cradle
