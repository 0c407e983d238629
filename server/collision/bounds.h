/// Boxes around shapes.
#pragma once

#include "server/collision/collider.h"

namespace cradle {

/// The tight box of a posed shape; empty for what has no end or nothing to collide with: `none`,
/// `half_space` and `mesh`, and what lacks its geometry.
Aabb bounds(const Collider& collider);
inline Aabb bounds(const Shape& shape, const Pose& X_WB) { return bounds(Collider{shape, X_WB}); }

/// `box` grown by `margin` (m) on all sides and stretched along `displacement` (m).
Aabb swept(const Aabb& box, const Vector& displacement, double margin);

/// Radius of the ball about Bo that holds the shape, m; infinite for `half_space`.
double bounding_radius(const Shape& shape);
/// Likewise of a stored one.
double bounding_radius(const StoredGeometry& geometry);

}  // namespace cradle
