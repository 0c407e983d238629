/// The direction of least overlap of a core with corners only and one triangle. Private to this
/// folder.
#pragma once

#include <array>
#include <optional>

#include "server/collision/convex_pair.h"

namespace cradle {

/// Of the core of A, and a triangle as A sees it; as for `least_overlap`, without a lead. Nothing
/// where it takes that: where they kiss, a segment passes through, or rounding gets in the way.
std::optional<LeastOverlap> triangle_overlap(const ConvexShape& A,
                                             const std::array<Vector, 3>& triangle, double limit);

}  // namespace cradle
