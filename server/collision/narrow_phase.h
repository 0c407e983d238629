/// Turns a pair of shapes into a manifold, by closed forms, chosen from a table by the two kinds.
#pragma once

#include "server/collision/manifold.h"

namespace cradle {

/// Contacts of A and B that are closer than `margin` (m). Symmetric in its arguments up to the
/// sign of the normal. Pairs without a closed form, or with a shape `none`, give none.
Manifold collide(const Shape& shape_A, const Pose& X_WA, const Shape& shape_B, const Pose& X_WB,
                 double margin);

}  // namespace cradle
