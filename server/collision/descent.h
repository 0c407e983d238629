/// Down from a direction to a local minimum of the overlap, step by step. Private to this folder.
#pragma once

#include "server/collision/best_face.h"

namespace cradle {

/// What leads so near to a face leads to it: squared sine.
inline constexpr double kBesideFace2 = 1e-4;

/// The overlap found is no larger than where it began. Slow where shapes are round, but it arrives
/// wherever it begins, on faces and edges in a step or two.
LeastOverlap descend(const ConvexPair& pair, const Direction& from, SupportHints& hints);

}  // namespace cradle
