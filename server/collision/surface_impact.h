/// The time of impact of a mesh or height field and a convex part.
#pragma once

#include "server/collision/time_of_impact.h"

namespace cradle {

/// As time_of_impact; the normal is from the surface to the part.
TimeOfImpact surface_impact(const MovingPart& surface, const MovingPart& part, ImpactGoal goal);

}  // namespace cradle
