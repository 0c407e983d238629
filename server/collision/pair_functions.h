/// The closed forms behind the pair table. Private to this folder.
#pragma once

#include "server/collision/collider.h"
#include "server/collision/manifold.h"

namespace cradle {

/// Contacts of A and B that are closer than `margin` (m), with the normal from A to B.
/// Poses that are not finite give none.
using PairFunction = Manifold (*)(const Collider& A, const Collider& B, double margin);

Manifold sphere_sphere(const Collider&, const Collider&, double margin);
Manifold sphere_box(const Collider&, const Collider&, double margin);
Manifold sphere_capsule(const Collider&, const Collider&, double margin);
Manifold sphere_cylinder(const Collider&, const Collider&, double margin);
Manifold sphere_cone(const Collider&, const Collider&, double margin);
Manifold capsule_capsule(const Collider&, const Collider&, double margin);
Manifold sphere_half_space(const Collider&, const Collider&, double margin);
Manifold box_half_space(const Collider&, const Collider&, double margin);
Manifold convex_half_space(const Collider&, const Collider&, double margin);
Manifold convex_convex(const Collider&, const Collider&, double margin);
Manifold box_box(const Collider&, const Collider&, double margin);

}  // namespace cradle
