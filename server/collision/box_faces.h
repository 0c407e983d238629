/// The contact of two boxes along a face of one of them. Private to the box-box pair.
#pragma once

#include <array>

#include "server/collision/box_block.h"
#include "server/collision/manifold.h"

namespace cradle {

/// Two boxes as the one sees them that has the reference face.
struct FacingBoxes {
  const Vector& h_reference;  ///< half extents, m
  const Vector& h_incident;
  const Matrix& C;  ///< axes of the incident box in the reference box, as columns
  Vector t;         ///< from the reference box's centre to that of the incident one
};

/// What the points of a face contact are called, and where the face is.
class BoxFaces {
 public:
  static constexpr std::size_t kSides = 4;

  /// To be called first. Puts the face of the reference box along its axis `axis` that looks to the
  /// incident box, and the incident face, into a lane. `margin`: points farther than this (m) do
  /// not count; `slack`: a corner up to so much (m) outside the face counts as over it.
  void begin(const FacingBoxes& boxes, int axis, double margin, double slack, BoxFaceBlock& block,
             int lane);

  /// Where the incident box is over, or under, the face: up to four points. `role` says which body
  /// is the reference: 0 for A, 1 for B; it is part of the features, and the normal goes from A to
  /// B in both. The manifold's lead is what the points bear: until all have left the face, or one
  /// has slid far.
  void set_manifold(const BoxFaceBlock& block, int lane, const Pose& X_WR, std::uint32_t role,
                    Manifold& manifold) const;

 private:
  std::uint32_t feature(const BoxFaceBlock& block, int lane, std::size_t candidate) const;

  int x_, y_, z_;  // axes of the reference box that are those of F
  double turn_;    // of z: -1 on the lower side
  double height_, slack_;
  std::array<std::uint32_t, 1 + 2 * kSides> side_bits_;  // of none, of x+, x-, y+, y-, of corners
  std::array<std::uint32_t, kSides> corner_bits_;        // of the incident face
};

/// A box's corners as numbers: bit k is set where coordinate k is positive. A corner, edge or face
/// is named by the bits that all its corners have in common, and the bits that any of them has.
constexpr std::uint32_t name_of(std::uint32_t common_bits, std::uint32_t any_bits) {
  return common_bits << 3 | any_bits;
}

}  // namespace cradle
