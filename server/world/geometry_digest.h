/// What a stored geometry adds to the world's hash.
#pragma once

#include <cstdint>

#include "server/collision/stored_geometry.h"

namespace cradle {

/// Of every number of it, so that two geometries with the same digest are taken for equal.
std::uint64_t digest(const StoredGeometry& geometry);

}  // namespace cradle
