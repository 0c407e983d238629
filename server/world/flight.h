/// How the world's bodies fly: which go through the wide kernels, and which one by one.
#pragma once

#include "server/collision/executor.h"
#include "server/world/state.h"

namespace cradle {

/// Who has drag: State::dragged.
void list_dragged(World::State& s);

/// Bodies in contact feel the mean of their drag over the tick, as it would be without contact: so
/// it brings them to rest at most, however strong it is.
void add_drag(World::State& s);

/// All bodies that move and do not touch: one step each. With the default scheme many at a time,
/// except those with drag; with another one by one.
void fly_free(World::State& s, Executor& executor);

}  // namespace cradle
