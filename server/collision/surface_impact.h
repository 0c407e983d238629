/// The time of impact of a mesh or height field and a convex part.
#pragma once

#include "server/collision/time_of_impact.h"

namespace cradle {

/// Leaves in `first` the earlier of both, with the work of both.
void keep_first(TimeOfImpact& first, TimeOfImpact found);

/// As time_of_impact; the normal is from the surface to the part.
TimeOfImpact surface_impact(const MovingPart& surface, const MovingPart& part, ImpactGoal goal);

}  // namespace cradle
