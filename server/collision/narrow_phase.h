/// Turns a pair of shapes into a manifold, by closed forms, chosen from a table by the two kinds.
#pragma once

#include "server/collision/collider.h"
#include "server/collision/manifold.h"

namespace cradle {

/// False for shapes that no pair of the table knows yet; true for `none`, which wants no contact.
bool can_collide(ShapeKind kind);

/// Contacts of A and B that are closer than `margin` (m). Symmetric in its arguments up to the
/// sign of the normal, but for two boxes whose best faces are equally good: then A's gives it.
/// Pairs without a closed form, with a shape `none` or with a pose that is not finite give none.
Manifold collide(const Collider& A, const Collider& B, double margin);

/// The same for shapes without stored geometry.
inline Manifold collide(const Shape& shape_A, const Pose& X_WA, const Shape& shape_B,
                        const Pose& X_WB, double margin) {
  return collide({shape_A, X_WA}, {shape_B, X_WB}, margin);
}

}  // namespace cradle
