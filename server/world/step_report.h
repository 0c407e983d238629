/// What one step came to, of a tick in one part or in two.
#pragma once

#include "server/world/world.h"

namespace cradle {

/// Of the part that has just ended, but for who sleeps.
StepReport report_of(const World::State& s);
/// Of both: what is counted added up, of what is worst the worse; the rest is the second's.
StepReport joined(const StepReport& first, const StepReport& second);

}  // namespace cradle
