/// Cylinders and cones among themselves: the direction of least overlap. Private to this folder.
#pragma once

#include <optional>

#include "server/collision/convex_pair.h"

namespace cradle {

/// As for `least_overlap`. Nothing: it is another pair, or which points are closest is not certain.
std::optional<LeastOverlap> revolved_pair_overlap(const ConvexPair& pair, double limit,
                                                  double lead_wanted);

}  // namespace cradle
