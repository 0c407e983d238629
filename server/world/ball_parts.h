/// The impacts of balls, found side by side in parts of space.
///
/// Impacts follow from each other in time, and so does what they change; but within a tick that
/// goes no farther than a ball or two. So each part finds the impacts of its own balls, its core,
/// and those of some cells beyond, which are as right as what is farther out is known. If two parts
/// tell the same of the balls between them, those of both cores that could meet, then no impact of
/// either core has followed from what its part did not know: what both say is what one would have
/// found. If not, one finds all.
///
/// Parts are cut across z, and only while all balls take part, some hundred impacts are expected,
/// nobody comes to rest within the tick, and there are cells enough.
///
/// Cost: cells beyond are seen twice; in a gas that fills 28 planes of cells two parts see 17 each.
/// Each has some numbers for all balls.
#pragma once

#include "server/world/world.h"

namespace cradle {

/// Of the pairs that are known: what is struck, the same on any number of threads.
/// `any_is_out`: some balls take no part.
void find_impacts(World::State& s, Executor& executor, bool any_is_out);

}  // namespace cradle
