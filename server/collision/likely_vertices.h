/// The vertex of a hull that is farthest along a direction, from the few that may be. Private to
/// this folder.
#pragma once

#include <cstdint>

#include "server/collision/stored_geometry.h"

namespace cradle {

/// Of a hull that knows its likely vertices.
std::uint16_t farthest_likely(const ConvexHull& hull, const Vector& d);

}  // namespace cradle
