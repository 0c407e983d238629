/// The closed forms behind the pair table. Private to this folder.
#pragma once

#include "server/collision/manifold.h"

namespace cradle {

/// Contacts of A and B that are closer than `margin` (m), with the normal from A to B.
/// Poses that are not finite give none.
using PairFunction = Manifold (*)(const Shape& shape_A, const Pose& X_WA, const Shape& shape_B,
                                  const Pose& X_WB, double margin);

Manifold sphere_sphere(const Shape&, const Pose&, const Shape&, const Pose&, double margin);
Manifold sphere_box(const Shape&, const Pose&, const Shape&, const Pose&, double margin);
Manifold sphere_half_space(const Shape&, const Pose&, const Shape&, const Pose&, double margin);
Manifold box_half_space(const Shape&, const Pose&, const Shape&, const Pose&, double margin);
Manifold box_box(const Shape&, const Pose&, const Shape&, const Pose&, double margin);

}  // namespace cradle
