/// Boxes around shapes.
#pragma once

#include "server/collision/collider.h"

namespace cradle {

/// The box of a posed shape: tight, but of compounds of many parts, meshes and height fields; empty
/// for what has no end or nothing to collide with: `none` and `half_space`, what lacks its
/// geometry, and shapes of the plane.
Aabb bounds(const Collider& collider);
inline Aabb bounds(const Shape& shape, const Pose& X_WB) { return bounds(Collider{shape, X_WB}); }

/// The box around a box in B.
Aabb posed(const Aabb& box, const Pose& X_WB);

/// A compound's box is that of its parts' boxes up to so many, else that of its box in B.
inline constexpr std::size_t kPartsOfTightBox = 8;
Aabb bounds_of_parts(const Compound& compound, const Pose& X_WB,
                     Aabb (*bounds_of_part)(const Collider&));

/// `box` grown by `margin` (m) on all sides and stretched along `displacement` (m).
Aabb swept(const Aabb& box, const Vector& displacement, double margin);

/// Radius of the ball about Bo that holds the shape, m; infinite for `half_space`.
double bounding_radius(const Shape& shape);
/// Likewise of a stored one.
double bounding_radius(const StoredGeometry& geometry);

}  // namespace cradle
