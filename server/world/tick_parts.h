/// Ticks in two halves, each with contacts of its own: WorldSettings::collides_twice.
///
/// A contact's normal and points hold as long as bodies move little; what falls in on itself goes
/// centimetres in a tick, turns about what it strikes, and others are in its way that were not
/// before. So a tick in which contacts close fast, by more than contacts of what rests are made
/// ahead, is stepped as two ticks of half the length are, to the bit; commands, wrenches, sleep and
/// states know whole ticks alone. Known are the contacts of the tick before, and what comes near
/// that had none.
#pragma once

#include "server/world/world.h"

namespace cradle {

/// Of the coming tick, as far as its last contacts tell. One while accounts are kept, which are of
/// the tick as a whole.
int parts_of_tick(const World::State& s);
/// When the pairs of the tick as a whole are known: whether a body that had no contact is about to
/// strike one fast.
bool strikes_fast(const World::State& s);
/// When its contacts are known: notes whether they close fast.
void note_closing(World::State& s);

}  // namespace cradle
