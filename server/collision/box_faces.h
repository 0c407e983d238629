/// The contact of two boxes along a face of one of them. Private to the box-box pair.
#pragma once

#include "server/collision/box_block.h"
#include "server/collision/manifold.h"

namespace cradle {

/// Where the incident box is over, or under, the reference face: up to four points. `X_WR`: of the
/// reference box. It is part of the features whether that is A, and the normal goes from A to B in
/// both cases. The manifold's lead is what the points bear. `separations`: of the candidates.
void set_manifold(const BoxFaceBlock& block, int lane, const Pose& X_WR,
                  const BoxFaceBlock::Row* separations, Manifold& manifold);

/// A box's corners as numbers: bit k is set where coordinate k is positive. A corner, edge or face
/// is named by the bits that all its corners have in common, and the bits that any of them has.
constexpr std::uint32_t name_of(std::uint32_t common_bits, std::uint32_t any_bits) {
  return common_bits << 3 | any_bits;
}
/// Of features that are none of a reference face and another: what is nearest, A's name times 2^6
/// and B's; the same whether the boxes are apart or overlap.
constexpr std::uint32_t kNoFace = 15u << 12;

}  // namespace cradle
