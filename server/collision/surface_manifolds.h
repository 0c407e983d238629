/// A convex shape, or a half-space, and a mesh or a height field. Private to this folder.
#pragma once

#include <vector>

#include "server/collision/collider.h"
#include "server/collision/manifold.h"

namespace cradle {

/// Appends the contacts that are closer than `margin` (m), with normals out of the surface. Below
/// 2^32 `Manifold::part` of each is `part` and which way its normal points, roughly: that a body
/// went on to other triangles changes nothing.
void add_surface_manifolds(const Collider& surface, const Collider& convex, double margin,
                           std::uint64_t part, std::vector<Manifold>& manifolds);

/// m. A pair that `add_surface_manifolds` found nothing for is at least so far apart, as its boxes
/// tell, and comes no nearer in any other way than by closing that gap. It looks some way beyond
/// the margin.
double surface_gap(const Collider& surface, const Collider& convex, double margin);

/// Like `add_surface_manifolds`, the vertices of a mesh that are in a half-space.
void add_surface_half_space(const Collider& surface, const Collider& half_space, double margin,
                            std::uint64_t part, std::vector<Manifold>& manifolds);

}  // namespace cradle
