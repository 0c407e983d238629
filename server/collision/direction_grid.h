/// All directions in cells: the sides of an octahedron seen from above and from below, cut into
/// squares. Private to this folder.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "server/collision/geometry.h"

namespace cradle {

struct DirectionGrid {
  static constexpr int kAcross = 32;  ///< even, so that no cell has parts of two sides
  static constexpr std::size_t kCells = 2 * kAcross * kAcross;  ///< half of them beside the sides

  /// Of a direction of any length; zero and what is no number are in some cell, too.
  static std::size_t cell(const Vector& d) {
    const double sum = std::abs(d.x()) + std::abs(d.y()) + std::abs(d.z());
    const double scale = 0.5 * kAcross / sum;
    const auto place = [&](double x) {
      return static_cast<int>(
          std::min<double>(kAcross - 1, std::max(0.0, x * scale + 0.5 * kAcross)));
    };
    const int below = d.z() < 0;
    return static_cast<std::size_t>((below * kAcross + place(d.y())) * kAcross + place(d.x()));
  }

  /// Unit vectors between which all directions of the cell are.
  static std::array<Vector, 4> corners(std::size_t cell) {
    const auto i = static_cast<int>(cell % kAcross), j = static_cast<int>(cell / kAcross % kAcross);
    std::array<Vector, 4> corners;
    for (std::size_t k = 0; k < 4; ++k) {
      const double x = 2.0 * (i + static_cast<int>(k & 1u)) / kAcross - 1;
      const double y = 2.0 * (j + static_cast<int>(k >> 1)) / kAcross - 1;
      const double z = 1 - std::abs(x) - std::abs(y);
      corners[k] = Vector(x, y, cell < kCells / 2 ? z : -z).normalized();
    }
    return corners;
  }
};

}  // namespace cradle
