/// The direction of least overlap of boxes, capsules and cylinders, by closed forms. Private to
/// this folder.
#pragma once

#include <optional>

#include "server/collision/convex_pair.h"

namespace cradle {

/// As least_overlap (convex_pair.h), for a box or cylinder and a capsule or cylinder in any order.
/// Nothing for other kinds, and where rounding gets in the way.
std::optional<LeastOverlap> closed_overlap(const ConvexPair& pair, double limit,
                                           double lead_wanted);

}  // namespace cradle
