/// Keeps one body's unusable numbers from reaching the others: it is put back to where it last was,
/// stopped, and neither moved nor collided with any more, until a command sets its pose and
/// velocities.
#pragma once

#include "server/world/state.h"

namespace cradle {

/// Before collision: bodies that the loads of this tick would throw beyond the limits, with neither
/// drag nor spring to hold them.
void quarantine_runaways(World::State& s);

/// Gives a body that does not touch its state at the tick's end. With a number that is not finite,
/// or beyond the limits, it stays where it was and is marked lost.
void end_tick(World::State& s, std::size_t i, Flight end);

/// After the solver: bodies in contact with a number that is not finite, or beyond the limits, go
/// back to where they were, as those in flight do, and are marked lost; nobody else is. Who only
/// spins too fast is slowed until it cannot tumble beyond the limit: what is a millimetre small and
/// hit at 1000 m/s would do so, and is still in the way of others.
void stop_unusable(World::State& s, Executor& executor);

/// After the step: bodies that are lost.
void quarantine_unusable(World::State& s);

}  // namespace cradle
