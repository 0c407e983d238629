/// A cylinder or cone at a box or hull: the direction of least overlap. Private to this folder.
#pragma once

#include <optional>

#include "server/collision/convex_pair.h"

namespace cradle {

/// As for `least_overlap`. Nothing: it is another pair, a hull with very many faces, or rounding
/// got in the way.
std::optional<LeastOverlap> revolved_overlap(const ConvexPair& pair, double limit,
                                             double lead_wanted, SupportHints& hints);

}  // namespace cradle
