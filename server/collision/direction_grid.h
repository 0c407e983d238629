/// All directions in cells: the sides of an octahedron seen from above and from below, cut into
/// squares. Private to this folder.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "server/collision/geometry.h"

namespace cradle {

struct DirectionGrid {
  static constexpr int kAcross = 32;  ///< a power of two: no cell has parts of two sides
  static constexpr std::size_t kCells = 2 * kAcross * kAcross;  ///< half of them beside the sides

  using Two = double __attribute__((vector_size(16)));

  /// Of two directions of any length; zero and what is no number are in some cell, too.
  static std::array<std::size_t, 2> cells(const Vector& d, const Vector& e) {
    const Two x{d.x(), e.x()}, y{d.y(), e.y()}, z{d.z(), e.z()};
    const Two scale = kInside * kHalf / (size(x) + size(y) + size(z));
    const Whole i = place(x * scale), j = place(y * scale);
    const auto cell = [&](int k) {
      const int below = z[k] < 0;
      return static_cast<std::size_t>((below * kAcross + j[k]) * kAcross + i[k]);
    };
    return {cell(0), cell(1)};
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

 private:
  using Bits = std::int64_t __attribute__((vector_size(16)));
  using Whole = std::int32_t __attribute__((vector_size(8)));
  static constexpr double kHalf = 0.5 * kAcross;
  static constexpr double kInside = 1 - 1e-12;  ///< so that the last cells hold the grid's ends

  static Two size(const Two& x) {
    return reinterpret_cast<Two>(reinterpret_cast<Bits>(x) &
                                 std::numeric_limits<std::int64_t>::max());
  }
  static Whole place(const Two& along) {
    static_assert((kAcross & (kAcross - 1)) == 0);
    return __builtin_convertvector(along + kHalf, Whole) & (kAcross - 1);
  }
};

}  // namespace cradle
