/// From a direction near a local minimum of the overlap to that minimum. Private to this folder.
#pragma once

#include "server/collision/convex_pair.h"

namespace cradle {

/// Where corners of a rim are so far apart that the minimum is likely to be on the face in it.
enum class AtFace { go_on, give_up };

/// Begins at the unit vector `n`, with the corners and weights that closest points ended with, and
/// leaves those of the minimum. False if it does not arrive; then `least` is what it was.
bool polish(const ConvexPair& pair, const Vector& n, Simplex& simplex, SupportHints& hints,
            LeastOverlap& least, AtFace at_face = AtFace::go_on);

}  // namespace cradle
