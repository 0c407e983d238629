/// The contact of two boxes along a face of one of them. Private to the box-box pair.
#pragma once

#include "server/collision/manifold.h"

namespace cradle {

/// Two boxes as the one sees them that has the reference face.
struct FacingBoxes {
  const Vector& h_reference;  ///< half extents, m
  const Vector& h_incident;
  const Matrix& C;   ///< axes of the incident box in the reference box, as columns
  Vector t;          ///< from the reference box's centre to that of the incident one
  const Pose& X_WR;  ///< of the reference box
};

/// Where the incident box is over, or under, the face of the reference box along its axis `axis`
/// that looks to it: up to four points closer than `margin` (m). A corner up to `slack` (m) outside
/// the face counts as over it. `role` says which body is the reference: 0 for A, 1 for B; it is
/// part of the features, and the normal goes from A to B in both. The manifold's lead is what the
/// points bear: until all have left the face, or one has slid far.
Manifold clip_faces(const FacingBoxes& boxes, int axis, std::uint32_t role, double margin,
                    double slack);

/// A box's corners as numbers: bit k is set where coordinate k is positive. A corner, edge or face
/// is named by the bits that all its corners have in common, and the bits that any of them has.
constexpr std::uint32_t name_of(std::uint32_t common_bits, std::uint32_t any_bits) {
  return common_bits << 3 | any_bits;
}

}  // namespace cradle
