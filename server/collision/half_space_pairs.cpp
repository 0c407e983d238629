// Convex shapes against the half-space: the corners of the face, edge or point that looks into the
// solid.
//
// Symbols: h half extents of the box, u the outward normal of the half-space, s height of a corner
// over its boundary.
// Box. Where we differ: of the eight corners only those four are candidates. The deepest corner is
// always among them, and so is all that can carry the box: a face, an edge or a corner at rest.
// So nothing need be reduced, and a plate thinner than the margin does not get the corners of its
// upper side. The feature is the corner's number: bit k is set where its coordinate k is positive.
// Cost at -O2: 60 ns.
// The others: a capsule has its two ends or one, a cylinder four points of a rim or two of its
// side, a cone likewise, an ellipsoid the point whose normal is n, a hull up to four corners of a
// face. The deepest point of the shape is always among them. The feature is the name of the corner.
#include <algorithm>
#include <cmath>

#include "server/collision/four_points.h"
#include "server/collision/pair_functions.h"
#include "server/collision/support_feature.h"

namespace cradle {

Manifold box_half_space(const Collider& box, const Collider& half_space, double margin) {
  const Pose& X_WA = box.X_WB;
  const Pose& X_WB = half_space.X_WB;
  const Vector h = to_eigen(box.shape.half_extents_m());
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

namespace {

struct Corner {
  Vector p;  // x and y across the normal, z the separation: m
  std::size_t number;
};

}  // namespace

Manifold convex_half_space(const Collider& convex, const Collider& half_space, double margin) {
  const Pose& X_WA = convex.X_WB;
  const Matrix R_A = half_space.X_WB.R.transpose() * X_WA.R;  // from A into the half-space's frame
  const double height = half_space.X_WB.R.col(2).dot(X_WA.x - half_space.X_WB.x);
  if (!(std::isfinite(height) && R_A.allFinite())) return {};
  const ConvexShape shape(convex);
  std::int32_t hint = 0;
  const SupportFeature feature = support_feature(shape, -R_A.row(2).transpose(), hint);

  std::array<Corner, SupportFeature::kCornersMax> corners;
  std::size_t count = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(feature.count); ++k) {
    Vector p = R_A * feature.corners[k];
    p.z() += height - shape.radius;
    if (p.z() <= margin) corners[count++] = {p, k};
  }
  std::span<Corner> points(corners.data(), count);
  if (points.size() > kManifoldPoints) {
    bring_best_four(points);
    points = points.first(kManifoldPoints);
  }
  if (feature.is_round && !points.empty()) {  // of a level disc, between two corners
    const Vector down = -R_A.row(2).transpose();
    double& least =
        std::ranges::min_element(points, {}, [](const Corner& c) { return c.p.z(); })->p.z();
    least = std::min(least, height - shape.radius - down.dot(shape.support(down, hint)));
  }
  Manifold manifold;
  const Vector u_W = half_space.X_WB.R.col(2);
  manifold.normal_W = -u_W;
  manifold.count = static_cast<int>(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double s = points[k].p.z();
    const Vector p_W = X_WA.x + X_WA.R * feature.corners[points[k].number];
    manifold.points[k] = {p_W - u_W * (shape.radius + 0.5 * s), s,
                          feature.corner_names[points[k].number]};
  }
  return manifold;
}

}  // namespace cradle
