/// A shape and where it is: what the narrow phase sees of a body.
#pragma once

#include "server/collision/stored_geometry.h"

namespace cradle {

struct SurfaceTriangle;

/// Refers to what it is made of, which must outlive it.
struct Collider {
  const Shape& shape;
  const Pose& X_WB;
  const StoredGeometry* geometry = nullptr;  ///< of what is stored
  /// One triangle of a surface as a flat convex shape, in the frame of the surface; the shape's
  /// kind is `mesh` then. Null for all else.
  const SurfaceTriangle* triangle = nullptr;

  /// Null for other shapes, and for a hull whose geometry is not given.
  const ConvexHull* hull() const {
    return geometry == nullptr ? nullptr : std::get_if<ConvexHull>(&geometry->value);
  }
};

}  // namespace cradle
