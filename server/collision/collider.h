/// A shape and where it is: what the narrow phase sees of a body.
#pragma once

#include "server/collision/stored_geometry.h"

namespace cradle {

/// Refers to what it is made of, which must outlive it.
struct Collider {
  const Shape& shape;
  const Pose& X_WB;
  const StoredGeometry* geometry = nullptr;  ///< of a hull, mesh or compound

  /// Null for other shapes, and for a hull whose geometry is not given.
  const ConvexHull* hull() const {
    return geometry == nullptr ? nullptr : std::get_if<ConvexHull>(&geometry->value);
  }
};

}  // namespace cradle
