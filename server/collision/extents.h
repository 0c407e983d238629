/// How thin a collider is and how far it reaches: what a tick's motion is measured by.
#pragma once

#include "server/collision/collider.h"
#include "server/collision/stored_geometry.h"

namespace cradle {

/// Null for what is no compound.
inline const Compound* compound_of(const Collider& collider) {
  if (collider.shape.kind != ShapeKind::compound || collider.geometry == nullptr) return nullptr;
  return std::get_if<Compound>(&collider.geometry->value);
}
/// Whether it is a convex shape of space or a triangle.
bool is_convex(const Collider& collider);
/// Whether it is a whole mesh or height field.
bool has_surface(const Collider& collider);

/// Half the least width of a convex shape, or of the thinnest part, m; of a closed mesh its volume
/// by its area, which is less; of other surfaces a small share of their size; infinite where there
/// is none to keep.
double thickness(const Collider& collider, bool is_planar = false);
/// Radius of the ball about `centre` (m, in the frame of the shape) that holds it; infinite for
/// half-spaces.
double reach(const Collider& collider, const Vector& centre);

}  // namespace cradle
