/// Who may touch in a tick.
#pragma once

#include "server/collision/executor.h"
#include "server/world/world.h"

namespace cradle {

/// Boxes that hold each body over the whole tick, and the pairs of them that overlap: `s.pairs`.
void find_pairs(World::State& s, Executor& executor);

}  // namespace cradle
