/// Boxes around shapes.
#pragma once

#include "server/collision/stored_geometry.h"

namespace cradle {

/// The tight box of a posed shape; empty for `none` and for `half_space`.
Aabb bounds(const Shape& shape, const Pose& X_WB);

/// `box` grown by `margin` (m) on all sides and stretched along `displacement` (m).
Aabb swept(const Aabb& box, const Vector& displacement, double margin);

/// Radius of the ball about Bo that holds the shape, m; infinite for `half_space`.
double bounding_radius(const Shape& shape);
/// Likewise of a stored one.
double bounding_radius(const StoredGeometry& geometry);

}  // namespace cradle
