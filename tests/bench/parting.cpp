// Two searches, one in the other. D is the set of all b - a.
//
// The closest point of D to the origin: Wolfe, Finding the nearest point in a polytope,
// Mathematical Programming 11 (1976), with the corners that the support function gives. Least
// overlap: B is moved out along n, to a gap that is well measured. The closest points are then at
// least as near as along n, so their direction n' overlaps no more than n did: the search goes
// downhill until n' is n.
#include "tests/bench/parting.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace cradle::bench {
namespace {

using Corners = std::vector<Vector>;

/// The point of the segment, triangle or corner nearest to the origin if it is inside of it.
std::optional<Vector> foot_on(std::span<const Vector> s) {
  if (s.size() == 1) return s[0];
  const Vector e = s[1] - s[0];
  if (s.size() == 2) {
    const double length2 = e.squaredNorm();
    const double u = -s[0].dot(e) / length2;
    if (!(u > 0 && u < 1)) return std::nullopt;
    return s[0] + u * e;
  }
  const Vector n = e.cross(s[2] - s[0]);
  const double area2 = n.squaredNorm();
  if (!(area2 > 1e-24 * e.squaredNorm() * (s[2] - s[0]).squaredNorm())) return std::nullopt;
  const Vector foot = n * (n.dot(s[0]) / area2);
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector &from = s[k], &to = s[(k + 1) % 3];
    if (!((to - from).cross(foot - from).dot(n) > 0)) return std::nullopt;
  }
  return foot;
}

/// Keeps those of `corners` whose span holds the point nearest to the origin, and gives that point.
/// The last corner, which lies nearer than all spans of the others, is one of them.
Vector nearest_of(Corners& corners) {
  const Vector last = corners.back();
  const std::size_t others = corners.size() - 1;
  Vector best = last;
  Corners kept{last};
  for (unsigned subset = 1; subset < (1U << others); ++subset) {
    Corners span;
    for (std::size_t k = 0; k < others; ++k) {
      if ((subset >> k & 1) != 0) span.push_back(corners[k]);
    }
    span.push_back(last);
    if (span.size() > 3) continue;
    const auto foot = foot_on(span);
    if (!foot || !(foot->squaredNorm() < best.squaredNorm())) continue;
    best = *foot;
    kept = std::move(span);
  }
  corners = std::move(kept);
  return best;
}

/// A point of D + shift.
Vector corner(const Pair& pair, const Vector& shift, const Vector& d) {
  const auto point = [](const Solid& solid, const Pose& X, const Vector& along) {
    return Vector(X.x + X.R * support_point(solid, X.R.transpose() * along));
  };
  return point(pair.B, pair.X_WB, d) - point(pair.A, pair.X_WA, -d) + shift;
}

/// From A's to B's closest point, with B moved by `shift`: they must be apart then. `n` is where
/// the search begins.
Vector closest(const Pair& pair, const Vector& shift, const Vector& n) {
  Corners corners{corner(pair, shift, -n)};
  Vector v = corners.front();
  for (int k = 0; k < 200; ++k) {
    const double length2 = v.squaredNorm();
    if (!(length2 > 0)) break;
    const Vector w = corner(pair, shift, -v.normalized());
    if (length2 - v.dot(w) <= 1e-14 * length2) break;
    corners.push_back(w);
    const Vector next = nearest_of(corners);
    if (!(next.squaredNorm() < length2)) break;
    v = next;
  }
  return v;
}

/// Half the least width of a shape, about.
double half_width(const Solid& solid) {
  double least = std::numeric_limits<double>::infinity();
  if (solid.shape.kind == ShapeKind::half_space) return least;
  for (int k = 0; k < 3; ++k) {
    const Vector d = Vector::Unit(k);
    const Vector width = support_point(solid, d) - support_point(solid, -d);
    least = std::min(least, 0.5 * d.dot(width));
  }
  return least;
}

Parting descend(const Pair& pair, Parting from, double gap) {
  for (int k = 0; k < 100; ++k) {
    const Vector v = closest(pair, from.n * (from.overlap + gap), from.n);
    const double length = v.norm();
    if (!(length > 0)) return from;
    const Vector n = v / length;
    const double m = overlap(pair, n);
    if (!(m < from.overlap)) return from;
    const bool is_end = from.overlap - m < 1e-12 * gap;
    from = {n, m};
    if (is_end) return from;
  }
  return from;
}

/// Directions in which a shape may be left: its axes, the normals of its faces, those of a cone's
/// side about `towards`.
void add_directions(const Solid& solid, const Pose& X, const Vector& towards,
                    std::vector<Vector>& found) {
  for (int k = 0; k < 3; ++k) {
    found.push_back(X.R.col(k));
    found.push_back(-X.R.col(k));
  }
  const Vector t_B = X.R.transpose() * towards;
  const double across = std::hypot(t_B.x(), t_B.y());
  if (across > 0 && solid.shape.kind != ShapeKind::box) {
    const Vector aside(t_B.x() / across, t_B.y() / across, 0);
    found.push_back(X.R * aside);
    if (solid.shape.kind == ShapeKind::cone) {
      const double r = solid.shape.radius_m(), h = 2 * solid.shape.half_length_m();
      found.push_back(X.R * (h * aside + Vector(0, 0, r)).normalized());
    }
  }
  if (solid.shape.kind != ShapeKind::hull) return;
  const Polytope polytope(solid, X);
  found.insert(found.end(), polytope.normals.begin(), polytope.normals.end());
}

std::vector<Parting> starts(const Pair& pair) {
  const Vector between = pair.X_WB.x - pair.X_WA.x;
  std::vector<Vector> of_A, directions;
  add_directions(pair.A, pair.X_WA, between, of_A);
  add_directions(pair.B, pair.X_WB, -between, directions);
  for (Vector& d : directions) d = -d;
  directions.insert(directions.end(), of_A.begin(), of_A.end());
  if (between.norm() > 0) directions.push_back(between.normalized());
  for (int k = 0; k < 8; ++k) {
    directions.push_back(Vector(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1).normalized());
  }
  std::vector<Parting> found;
  for (const Vector& d : directions) found.push_back({d, overlap(pair, d)});
  std::ranges::sort(found, {}, &Parting::overlap);
  return found;
}

bool is_polytope(const Solid& solid) {
  return solid.shape.kind == ShapeKind::box || solid.shape.kind == ShapeKind::hull;
}

}  // namespace

Parting parting(const Pair& pair) {
  const bool is_A_space = pair.A.shape.kind == ShapeKind::half_space;
  if (is_A_space || pair.B.shape.kind == ShapeKind::half_space) {
    const Vector n = is_A_space ? Vector(pair.X_WA.R.col(2)) : Vector(-pair.X_WB.R.col(2));
    return {n, overlap(pair, n)};
  }
  const double gap = 0.5 * std::min(half_width(pair.A), half_width(pair.B));
  Parting best;
  std::vector<Vector> tried;
  for (const Parting& start : starts(pair)) {
    const bool is_near =
        std::ranges::any_of(tried, [&](const Vector& other) { return start.n.dot(other) > 0.9; });
    if (is_near) continue;
    tried.push_back(start.n);
    const Parting end = descend(pair, start, gap);
    if (end.overlap < best.overlap) best = end;
    if (best.overlap < 0 || tried.size() == 4) break;
  }
  if (best.overlap < 0) {
    const Vector v = closest(pair, Vector::Zero(), best.n);
    return {v.normalized(), -v.norm()};
  }
  return is_polytope(pair.A) && is_polytope(pair.B) ? best_axis_of_polytopes(pair) : best;
}

}  // namespace cradle::bench
