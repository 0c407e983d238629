// Two shapes as A sees them, and their support points at once. Two hulls, the commonest case, do
// without calls, and find the cells of both directions side by side.
#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

#include "server/collision/convex_pair.h"
#include "server/collision/corner_names.h"
#include "server/collision/direction_grid.h"
#include "server/collision/lanes.h"
#include "server/collision/likely_vertices.h"

namespace cradle {

ConvexPair::ConvexPair(const ConvexShape& shape_A, const Pose& X_WA, const ConvexShape& shape_B,
                       const Pose& X_WB)
    : A(shape_A),
      B(shape_B),
      R(X_WA.R.transpose() * X_WB.R),
      t(X_WA.R.transpose() * (X_WB.x - X_WA.x)),
      centre(t + R * B.centre - A.centre),
      toward_B(-R.transpose()) {}

ConvexPair::ConvexPair(const Collider& collider_A, const Collider& collider_B)
    : ConvexPair(ConvexShape(collider_A), collider_A.X_WB, ConvexShape(collider_B),
                 collider_B.X_WB) {}

namespace {

using Two = DirectionGrid::Two;

/// Of the candidates of the cell that `d` is in, four at a time. Which is farthest is chance: to
/// guess it by branches would cost more than to find it.
std::uint16_t farthest_in(const ConvexHull& hull, std::size_t cell, const Vector& d) {
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
    const unsigned farthest_of = bits_of(front == r) | bits_of(back == r) << 2 | 8u;
    if (r > most)
      farthest = four->numbers[static_cast<std::size_t>(std::countr_zero(farthest_of))], most = r;
  }
  return farthest;
}

/// x and y side by side.
struct Split {
  Two xy;
  double z;
};

Split product(const Matrix& M, const Vector& v) {
  const auto column = [&](Eigen::Index k) { return Two{M(0, k), M(1, k)} * v[k]; };
  return {column(0) + column(1) + column(2), M(2, 0) * v.x() + M(2, 1) * v.y() + M(2, 2) * v.z()};
}

}  // namespace

std::uint16_t farthest_likely(const ConvexHull& hull, const Vector& d) {
  return farthest_in(hull, DirectionGrid::cells(d, d)[0], d);
}

void find_support(const ConvexPair& pair, const Vector& n, SupportHints& hints, Difference& found) {
  const Split along = product(pair.toward_B, n);
  const Vector m(along.xy[0], along.xy[1], along.z);
  Vector a, b;
  if (pair.are_quick_hulls) {
    const ConvexHull &A = *pair.A.hull, &B = *pair.B.hull;
    const auto cells = DirectionGrid::cells(n, m);
    hints.A = farthest_in(A, cells[0], n);
    hints.B = farthest_in(B, cells[1], m);
    a = A.vertices[static_cast<std::size_t>(hints.A)];
    b = B.vertices[static_cast<std::size_t>(hints.B)];
  } else {
    a = pair.A.support(n, hints.A);
    b = pair.B.support(m, hints.B);
  }
  const Split b_A = product(pair.R, b);
  const Two xy = Two{a.x(), a.y()} - (b_A.xy + Two{pair.t.x(), pair.t.y()});
  found.w = Vector(xy[0], xy[1], a.z() - (b_A.z + pair.t.z()));
  found.a = a;
  found.name = corner_name(corner_number(pair.A, a, hints.A), corner_number(pair.B, b, hints.B));
}

}  // namespace cradle
