/// Springs by impulses along where they are: what is left when the equations of spring_step.h have
/// no solution that is found.
#pragma once

#include "server/dynamics/spring_step.h"

namespace cradle {

/// Moves `bodies` through `h` (s). Whatever it is given, energy does not rise.
void spring_impulses(std::span<SpringBody> bodies, std::span<const SpringLink> links, double h);

}  // namespace cradle
