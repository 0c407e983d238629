/// All manifolds of two bodies: one of convex shapes, any number of compounds and surfaces.
#pragma once

#include <vector>

#include "server/collision/collider.h"
#include "server/collision/manifold.h"

namespace cradle {

/// Shapes that may touch with more than one manifold.
bool is_composite(ShapeKind kind);

/// Appends the contacts of A and B that are closer than `margin` (m), one manifold for each two
/// convex parts, in the order of A's parts, then B's. `Manifold::part` names the two: A's number
/// times 2^44, B's times 2^32, and what a surface adds below. None as for `collide`.
void add_manifolds(const Collider& A, const Collider& B, double margin,
                   std::vector<Manifold>& manifolds);

}  // namespace cradle
