#include "server/collision/corner_names.h"

namespace cradle {
namespace {

constexpr unsigned kNameBits = 2 * kCornerBits;
constexpr std::size_t kNamesMax = 3;
constexpr unsigned kCountAt = kNamesMax * kNameBits;  // two bits

/// False: there is none of this number, as the shape is another one than it was.
bool find_corner(const ConvexShape& shape, unsigned number, Vector& p) {
  if (shape.hull != nullptr) {
    if (number >= shape.hull->vertices.size()) return false;
    p = shape.hull->vertices[number];
    return true;
  }
  std::int32_t none = 0;
  const auto sign = [number](unsigned bit) { return (number & bit) != 0 ? 1.0 : -1.0; };
  p = shape.support({sign(1), sign(2), sign(4)}, none);
  return true;
}

}  // namespace

std::uint32_t names_of(std::span<const Difference> corners) {
  if (corners.empty() || corners.size() > kNamesMax) return 0;
  auto names = static_cast<std::uint32_t>(corners.size()) << kCountAt;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    if (corners[k].name == 0) return 0;
    names |= static_cast<std::uint32_t>(corners[k].name) << k * kNameBits;
  }
  return names;
}

bool find_corners(const ConvexPair& pair, std::uint32_t names, Simplex& simplex) {
  constexpr unsigned kOne = (1u << kCornerBits) - 1;
  simplex.count = names >> kCountAt;
  for (std::size_t k = 0; k < simplex.count; ++k) {
    const unsigned name = names >> k * kNameBits;
    const unsigned of_A = (name & kOne) - 1, of_B = (name >> kCornerBits & kOne) - 1;
    Difference& corner = simplex.corners[k];
    Vector b;
    if (!find_corner(pair.A, of_A, corner.a) || !find_corner(pair.B, of_B, b)) return false;
    corner.w = corner.a - (pair.R * b + pair.t);
    corner.name = corner_name(of_A, of_B);
  }
  return simplex.count > 0;
}

}  // namespace cradle
