/// The last look at fast bodies (fast_bodies.h): no tick ends with one inside another, or beyond.
///
/// Bodies that stop change what others hit. So pairs are looked at anew until nothing changes, in
/// the order of slots; bodies whose pairs still change after kSweepsMax sweeps stay where the tick
/// began, and are counted. A stop only ever shortens a way. Static, kinematic and slow bodies never
/// stop: a slow one cannot get past a fast one that has stopped. What stops for a kinematic body
/// goes along with it from there: else that would pass over it.
///
/// A body that flew has the velocity it had when it stopped; one in contact, which has had its
/// impulses, keeps the one it has. Neither adds energy.
#pragma once

#include "server/collision/executor.h"
#include "server/world/world.h"

namespace cradle {

/// After all have moved.
void stop_at_impacts(World::State& s, Executor& executor);

}  // namespace cradle
