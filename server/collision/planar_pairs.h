/// Contacts of planar worlds: of the cuts of two shapes through z = 0.
#pragma once

#include "server/collision/manifold.h"

namespace cradle {

/// False for shapes that touch nothing in a planar world.
bool can_collide_in_plane(ShapeKind kind);

/// As `collide`, for poses in z = 0 that are turned about z, and half-spaces with normals in that
/// plane: normal and points lie in it, and there are two points at most.
Manifold collide_in_plane(const Shape& shape_A, const Pose& X_WA, const Shape& shape_B,
                          const Pose& X_WB, double margin);

}  // namespace cradle
