/// The time of impact of two convex parts, or of one and a half-space: the unit of
/// time_of_impact.h.
#pragma once

#include "server/collision/time_of_impact.h"

namespace cradle {

/// As time_of_impact, of what is one part each, with lengths of the caller's choice.
TimeOfImpact convex_impact(const MovingPart& A, const MovingPart& B, ImpactGoal goal,
                           const ImpactLengths& lengths, bool is_planar = false);

/// Leaves in `first` the earlier of both, with the work of both.
void keep_first(TimeOfImpact& first, TimeOfImpact found);

}  // namespace cradle
