/// What commands do to the state.
#pragma once

#include "server/world/state.h"

namespace cradle {

/// An event about the body in slot `i`, now.
Event event_of(const World::State& s, std::size_t i, EventKind kind);

}  // namespace cradle
