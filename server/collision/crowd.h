/// The pairs of a scene with more of them than pairs_max: too many bodies in too little space.
#pragma once

#include "server/collision/broad_phase.h"

namespace cradle {

/// BroadPhase::find_pairs for such scenes, by the rule that is stated there; right for any other,
/// too. Takes memory for O(pairs_max) pairs, and time for O(pairs_max log n).
BroadPhaseReport find_crowd_pairs(const BroadPhaseInput& input, std::vector<BodyPair>& pairs);

}  // namespace cradle
