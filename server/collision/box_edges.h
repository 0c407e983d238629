/// Two boxes that meet with an edge each. Private to the box-box pair.
#pragma once

#include "server/collision/box_batch.h"

namespace cradle {

/// One point midway between the edges that meet along the axis. None if only their lines meet: if
/// the edges are apart, and farther from each other than along the axis. Overwrites the manifold.
void meet_edges(const BoxAxes& boxes, const Pose& X_WA, Manifold& manifold);

}  // namespace cradle
