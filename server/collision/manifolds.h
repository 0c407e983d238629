/// All manifolds of two bodies: one of convex shapes, any number of compounds and surfaces.
#pragma once

#include <vector>

#include "server/collision/collider.h"
#include "server/collision/geometry.h"
#include "server/collision/manifold.h"

namespace cradle {

/// How two convex shapes meet, and the box of one shape: in space, or in a planar world.
struct PairMethods {
  Manifold (*collide)(const Collider&, const Collider&, double margin);
  Aabb (*bounds)(const Collider&);
};
const PairMethods& pair_methods(bool is_planar);

/// Shapes that may touch with more than one manifold.
bool is_composite(ShapeKind kind);

/// Appends the contacts of A and B that are closer than `margin` (m), one manifold for each two
/// convex parts, in the order of A's parts, then B's. `Manifold::part` names the two: A's number
/// times 2^44, B's times 2^32, and what a surface adds below. None as for `collide`. Returns the
/// work done: parts put to the pair table, and nodes of the compounds' trees.
std::int64_t add_manifolds(const Collider& A, const Collider& B, double margin,
                           std::vector<Manifold>& manifolds,
                           const PairMethods& methods = pair_methods(false));

/// m. A body and a mesh or a height field that `add_manifolds` found nothing for are at least so
/// far apart; it may be more than the margin. 0: not known.
double least_distance(const Collider& A, const Collider& B, double margin);

}  // namespace cradle
