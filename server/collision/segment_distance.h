/// The distance of a segment from a box or a cylinder: what capsules ask for that have not sunk in
/// by their radius. Private to this folder.
#pragma once

#include "server/collision/geometry.h"

namespace cradle {

/// In the frame of a solid about the origin, m. `along` is a unit vector.
struct Segment {
  Vector middle, along;
  double half_length;
};

/// From the solid to the segment.
struct SegmentDistance {
  double distance = 0;        ///< 0: they meet, or nearly; then there is no more to it
  Vector n = Vector::Zero();  ///< unit
  Vector p = Vector::Zero();  ///< closest point of the solid
  /// m. n turns with the bodies alone until the closest points have moved by this much; 0: it turns
  /// as they move.
  double inside = 0;
  double sine = 1;  ///< of the angle between the edges that n is across; 1: not across two
};

SegmentDistance segment_box(const Segment& segment, const Vector& half_extents);
SegmentDistance segment_cylinder(const Segment& segment, double radius, double half_length);

}  // namespace cradle
