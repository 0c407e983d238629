/// Boxes apart that are nearest to each other at a corner, or where two edges cross beside what the
/// axes tell. Private to the box-box pair.
#pragma once

#include "server/collision/box_batch.h"

namespace cradle {

/// Sets `manifold`: one point, or none and how far the boxes are apart (`lead`). False, and nothing
/// is set, where more than one point may touch soon, edges are nearly parallel, or they nearly
/// touch: that is left to a search.
bool meet_corners(const BoxAxes& boxes, const Pose& X_WA, double margin, Manifold& manifold);

/// Whether the nearest points of boxes apart are on the two edges that `boxes` tells, where their
/// lines are nearest. No if these are nearly parallel.
bool edges_are_nearest(const BoxAxes& boxes);

}  // namespace cradle
