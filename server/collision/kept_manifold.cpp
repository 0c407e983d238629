#include "server/collision/kept_manifold.h"

#include <algorithm>
#include <cmath>

#include "server/collision/convex_shape.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

bool is_closed_form(ShapeKind A, ShapeKind B) {
  if (A == ShapeKind::sphere) return B != ShapeKind::ellipsoid && B != ShapeKind::hull;
  return A == ShapeKind::capsule && B == ShapeKind::capsule;
}

}  // namespace

bool is_worth_keeping(ShapeKind A, ShapeKind B) {
  return has_inside(A) && has_inside(B) && !is_closed_form(A, B) && !is_closed_form(B, A);
}

double bearable_motion(const Manifold& manifold, double reach) {
  if (manifold.count == 0) return manifold.lead;
  return std::min(manifold.lead / 2, most_bearable_motion(reach));
}

double most_bearable_motion(double reach) { return kTolerances.kept_motion * std::min(reach, 1.0); }

void keep(const Manifold& manifold, const Pose& X_WA, const Pose& X_WB, KeptManifold& kept) {
  kept.n_A = X_WA.R.transpose() * manifold.normal_W;
  const auto count = static_cast<std::size_t>(manifold.count);
  for (std::size_t k = 0; k < count; ++k) {
    const ContactPoint& point = manifold.points[k];
    const Vector half = 0.5 * point.separation * manifold.normal_W;
    kept.points[k] = {X_WA.R.transpose() * (point.p_W - half - X_WA.x),
                      X_WB.R.transpose() * (point.p_W + half - X_WB.x), point.feature};
  }
  for (std::size_t k = count; k < kept.points.size(); ++k) kept.points[k] = {};
}

void pose(const KeptManifold& kept, int count, const Pose& X_WA, const Pose& X_WB,
          Manifold& manifold) {
  const Vector normal_W = X_WA.R * kept.n_A;
  manifold.part = 0;
  manifold.normal_W = normal_W;
  manifold.count = count;
  manifold.lead = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    const Vector on_A = X_WA.x + X_WA.R * kept.points[k].p_A;
    const Vector on_B = X_WB.x + X_WB.R * kept.points[k].p_B;
    manifold.points[k] = {0.5 * (on_A + on_B), normal_W.dot(on_B - on_A),
                          static_cast<std::uint32_t>(kept.points[k].feature)};
  }
}

}  // namespace cradle
