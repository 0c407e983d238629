// Two shapes as A sees them, and their support points at once. Two hulls, the commonest case, do
// without calls, and find the cells of both directions side by side.
#include "server/collision/convex_pair.h"
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

void find_support(const ConvexPair& pair, const Vector& n, SupportHints& hints, Difference& found) {
  const Split along = product(pair.toward_B, n);
  const Vector m(along.xy[0], along.xy[1], along.z);
  Vector a, b;
  if (pair.are_quick_hulls) {
    const ConvexHull &A = *pair.A.hull, &B = *pair.B.hull;
    const auto cells = DirectionGrid::cells(n, m);
    hints.A = farthest_likely(A, cells[0], n);
    hints.B = farthest_likely(B, cells[1], m);
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
}

}  // namespace cradle
