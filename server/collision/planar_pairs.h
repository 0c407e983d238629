/// Contacts of planar worlds, by closed forms of the plane.
///
/// Shapes of the plane: disc (ShapeKind::sphere), rectangle (box: its first two half extents),
/// capsule along x_B, convex polygon (polygon, or as a hull the ConvexPolygon of a scene),
/// half-space with its normal in the plane, and compounds of the first four.
#pragma once

#include <string_view>

#include "server/collision/collider.h"
#include "server/collision/manifold.h"

namespace cradle {

/// Why a shape is none of the plane, to go on after the body's name; empty: it is one, or `none`.
std::string_view shape_out_of_plane(const Shape& shape, const StoredGeometry* geometry);

/// Why a shape is one of planar worlds alone; empty: it is none of them.
std::string_view shape_out_of_space(const Shape& shape, const StoredGeometry* geometry);

/// The box of a shape of the plane, without extent along z; empty for `none` and `half_space`.
Aabb bounds_in_plane(const Collider& collider);

/// As `collide`, for convex shapes of the plane at poses in z = 0 that are turned about z, and
/// half-spaces with normals in that plane: normal and points lie in it, and there are two points at
/// most. The deepest separation is the exact overlap along the normal, and the normal that of the
/// least overlap, or of the shortest distance.
Manifold collide_in_plane(const Collider& A, const Collider& B, double margin);
inline Manifold collide_in_plane(const Shape& shape_A, const Pose& X_WA, const Shape& shape_B,
                                 const Pose& X_WB, double margin) {
  return collide_in_plane({shape_A, X_WA}, {shape_B, X_WB}, margin);
}

}  // namespace cradle
