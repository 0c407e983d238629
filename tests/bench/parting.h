/// The least way that parts any two convex shapes, by a search of its own: it shares no code with
/// the engine's collision detection.
#pragma once

#include "tests/bench/solids.h"

namespace cradle::bench {

/// The direction of least overlap; of shapes apart, that from A's to B's closest point, where the
/// overlap is minus the distance. Of two boxes or hulls it is the best of all axes, of others a
/// local minimum reached from the best of many directions: never less than what is true, since
/// every direction's overlap is a way to part them. Half-spaces may be one of the two.
/// 10 to 500 us.
Parting parting(const Pair& pair);

}  // namespace cradle::bench
