/// Which four of many contact points to keep. Private to this folder.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "server/collision/geometry.h"
#include "server/collision/tolerances.h"

namespace cradle {

/// Swaps to place `first` the candidate from there on that scores highest. A later one must score
/// more than `tie` higher.
template <typename Candidate, typename Score>
void bring_best(std::span<Candidate> candidates, std::size_t first, double tie, Score score) {
  std::size_t best = first;
  double best_score = score(candidates[first].p);
  for (std::size_t k = first + 1; k < candidates.size(); ++k) {
    const double candidate_score = score(candidates[k].p);
    if (candidate_score > best_score + tie) best = k, best_score = candidate_score;
  }
  std::swap(candidates[first], candidates[best]);
}

/// Brings to the front the four that carry most: the deepest, the farthest from it, and those two
/// that then add most area, which are on both sides if there are points on both. Of a candidate p
/// only `p.p` counts: x and y its place across the normal, z its separation, all in m.
template <typename Candidate>
void bring_best_four(std::span<Candidate> candidates) {
  const auto area = [](const Vector& p, const Vector& q, const Vector& r) {
    return (q.x() - p.x()) * (r.y() - p.y()) - (q.y() - p.y()) * (r.x() - p.x());
  };
  constexpr double kTie = kTolerances.tie_m;
  bring_best(candidates, 0, kTie, [](const Vector& p) { return -p.z(); });
  const Vector p = candidates[0].p;
  const auto distance = [&](const Vector& q) { return (q - p).head<2>().norm(); };
  bring_best(candidates, 1, kTie, distance);
  const Vector q = candidates[1].p;
  const double area_tie = kTie * distance(q);
  bring_best(candidates, 2, area_tie, [&](const Vector& r) { return std::abs(area(p, q, r)); });
  const Vector r = candidates[2].p;
  const double turn = area(p, q, r) < 0 ? -1 : 1;
  bring_best(candidates, 3, area_tie, [&](const Vector& s) {
    return -std::min({turn * area(p, q, s), turn * area(q, r, s), turn * area(r, p, s)});
  });
}

}  // namespace cradle
