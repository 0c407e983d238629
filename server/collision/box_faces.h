/// The contact of two boxes along a face of one of them. Private to the box-box pair.
#pragma once

#include "server/collision/manifold.h"

namespace cradle {

struct PosedBox {
  const Vector& half_extents;
  const Pose& X_WB;
};

/// Where the box `incident` is over, or under, the face of `reference` along its axis `axis` that
/// looks to it: up to four points closer than `margin` (m). A corner up to `slack` (m) outside the
/// face counts as over it. `role` says which body is the reference: 0 for A, 1 for B; it is part of
/// the features, and the normal goes from A to B in both.
Manifold clip_faces(const PosedBox& reference, const PosedBox& incident, int axis,
                    std::uint32_t role, double margin, double slack);

/// A box's corners as numbers: bit k is set where coordinate k is positive. A corner, edge or face
/// is named by the bits that all its corners have in common, and the bits that any of them has.
constexpr std::uint32_t name_of(std::uint32_t common_bits, std::uint32_t any_bits) {
  return common_bits << 3 | any_bits;
}

}  // namespace cradle
