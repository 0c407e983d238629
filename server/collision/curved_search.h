/// The direction of least overlap of two cores of which one at least is curved, and neither flat.
/// Private to this folder.
#pragma once

#include "server/collision/convex_pair.h"

namespace cradle {

/// As for `least_overlap`.
LeastOverlap curved_overlap(const ConvexPair& pair, double limit, double lead_wanted,
                            SupportHints& hints);

}  // namespace cradle
