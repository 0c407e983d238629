/// The world's springs: which bodies they join, and how these move.
#pragma once

#include "server/world/state.h"

namespace cradle {

/// Moves the bodies that springs join, group by group, each by one implicit step of
/// spring_step.h with its drag and loads, whatever the scheme: Course::moved tells which. In a
/// group with a body in contact only what is free moves; those in contact get the springs' mean
/// force over the tick among their loads, for the contact solver. Springs of a body in quarantine
/// rest.
void move_with_springs(World::State& s);

/// J
double energy_of_springs(const World::State& s);

}  // namespace cradle
