/// Corners of two cores by number, so that a search may begin with those where the last one ended.
/// Private to this folder.
///
/// A corner of a hull has the number of its vertex, of other cores the signs of its coordinates
/// tell it. Numbers from 31 on have no name: 10 bits for two of them leave room for three names in
/// what a pair remembers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "server/collision/convex_pair.h"

namespace cradle {

inline constexpr unsigned kCornerBits = 5;

/// `p`: a corner of the shape; `vertex`: its number, of hulls.
inline unsigned corner_number(const ConvexShape& shape, const Vector& p, std::int32_t vertex) {
  if (shape.hull != nullptr) return static_cast<unsigned>(vertex);
  return (p.x() > 0 ? 1u : 0u) | (p.y() > 0 ? 2u : 0u) | (p.z() > 0 ? 4u : 0u);
}
inline std::uint16_t corner_name(unsigned of_A, unsigned of_B) {
  const unsigned A = of_A + 1, B = of_B + 1;
  return static_cast<std::uint16_t>((A | B) < 1u << kCornerBits ? A | B << kCornerBits : 0);
}

/// Of one to three; 0: some of them has no name.
std::uint32_t names_of(std::span<const Difference> corners);

/// Their corners as they are now; false if there are none, or not all of them are there.
bool find_corners(const ConvexPair& pair, std::uint32_t names, Simplex& simplex);

}  // namespace cradle
