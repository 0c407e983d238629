/// From a direction near a local minimum of the overlap to that minimum. Private to this folder.
#pragma once

#include "server/collision/convex_pair.h"

namespace cradle {

/// Begins at the unit vector `n`, with the corners and weights that closest points ended with, and
/// leaves those of the minimum. False if it does not arrive; then `least` is what it was.
bool polish(const ConvexPair& pair, const Vector& n, Simplex& simplex, SupportHints& hints,
            LeastOverlap& least);

}  // namespace cradle
