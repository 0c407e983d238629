/// What the wide kernels that look for balls that may meet and their caller (ball_grid.cpp) agree
/// on. Plain numbers: the kernels' files are compiled for one instruction set each and must share
/// no inline code with others.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cradle {

/// Balls in the order of the cells that they are in; a read of four may begin at the last.
struct BallCells {
  const float* x;               ///< m; then y, z, v (m/s) and radius, an array each
  std::size_t stride;           ///< of these arrays
  const std::uint32_t* cells;   ///< of each ball in them
  const std::uint32_t* begins;  ///< of each cell in them, and the end
  std::uint32_t size[3];        ///< cells, with those at the rim, which are empty
  float slack;                  ///< m^2
  float twice_dt;               ///< s
};

/// Of the balls after one, in its cell and those around, four a row may meet it by a bit each:
/// bit 4 r + k is the k-th of row r. Its own row is the first, then those after it (row_after).
inline constexpr std::size_t kBallRows = 5;
/// Set where a row has more than four.
inline constexpr std::uint32_t kMoreBalls = 1U << 31;

/// By how many cells a row is further than that of the ball.
constexpr std::uint32_t row_after(const BallCells& cells, std::size_t r) {
  const std::uint32_t y = cells.size[0], z = cells.size[0] * cells.size[1];
  const std::uint32_t rows[kBallRows] = {0, y, z - y, z, z + y};
  return rows[r];
}

struct BallKernels {
  int lanes;  ///< doubles side by side; floats twice as many
  /// For the balls at begin .. end, to `hits`, by their places.
  void (*look)(const BallCells& cells, std::uint32_t begin, std::uint32_t end, std::uint32_t* hits);
};

extern const BallKernels kBallKernels1, kBallKernels2;
#ifdef CRADLE_WIDE_X86
extern const BallKernels kBallKernels4;  ///< needs AVX2
extern const BallKernels kBallKernels8;  ///< needs AVX-512 F, VL, DQ
#endif

}  // namespace cradle
