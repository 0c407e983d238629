/// A uniform grid over boxes of similar size: all their pairs, quicker than by a tree.
///
/// A box belongs to the cell of its lower corner, and must not reach further than the next cell:
/// then those it may overlap are in the same cell or in one beside it. The few larger boxes are
/// left to others. The grid is wound up: beyond its last cell the first follows again, so it bears
/// bodies anywhere. Cost: O(n), where the cells are not crowded.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/box_lanes.h"

namespace cradle {

class BoxGrid {
 public:
  /// Over the boxes of these slots: `boxes` has one for every slot there is. False, and no use, if
  /// sizes are not similar or too many boxes share a cell: a rule that looks at nothing else.
  bool build(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots);

  /// Slots of boxes too large for the cells, ascending.
  std::span<const std::int32_t> large() const { return large_; }

  /// Calls `visit(slot, slot)` for every pair of boxes that overlap, but for the large ones, until
  /// it returns false. Returns the cells looked at.
  template <class F>
  std::int64_t join(F&& visit) const;

 private:
  struct Range {
    std::uint32_t begin, end;  // of boxes
  };
  struct Axis {
    float origin = 0, cells_per_m = 0;
    std::int32_t cells = 1;

    std::int32_t cell(float x) const;
    std::uint32_t wound(std::int32_t cell) const;
  };

  bool choose_axes(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots);
  bool count(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots);
  void scatter(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots);
  std::size_t add_row(std::int32_t x, std::int32_t y, std::int32_t z, std::int32_t x_first,
                      Range* ranges) const;
  template <class F>
  bool visit_range(const Probe& probe, std::int32_t slot, Range range, F& visit) const;

  std::array<Axis, 3> axes_;
  std::vector<std::int32_t> large_;
  std::vector<std::uint32_t> cells_of_;  // by place in `slots`; kLarge: none
  std::vector<std::uint32_t> begins_;    // of each cell in the arrays below, and the end
  std::vector<std::int32_t> slots_;      // in the order of the cells
  std::vector<float> bounds_;            // lower x, y, z, upper x, y, z of them, an array each
  std::size_t stride_ = 0;               // of bounds_
};

/// The cells x_first, .. 1 beside (x, y, z) in its row, as ranges of boxes. Returns their number.
inline std::size_t BoxGrid::add_row(std::int32_t x, std::int32_t y, std::int32_t z,
                                    std::int32_t x_first, Range* ranges) const {
  const auto wind = [](std::int32_t cell, std::int32_t cells) {
    return cell < 0 ? cell + cells : cell >= cells ? cell - cells : cell;
  };
  const std::int32_t nx = axes_[0].cells;
  const std::int32_t row =
      (wind(z, axes_[2].cells) * axes_[1].cells + wind(y, axes_[1].cells)) * nx;
  const auto range = [&](std::int32_t first, std::int32_t last) {
    return Range{begins_[static_cast<std::size_t>(row + first)],
                 begins_[static_cast<std::size_t>(row + last) + 1]};
  };
  if (nx == 1) {
    if (x_first > 0) return 0;
    ranges[0] = range(0, 0);
    return 1;
  }
  const std::int32_t first = x + x_first, last = x + 1;
  if (first >= 0 && last < nx) {
    ranges[0] = range(first, last);
    return 1;
  }
  if (first < 0) {
    ranges[0] = range(nx - 1, nx - 1);
    ranges[1] = range(0, last);
  } else {
    ranges[0] = range(0, 0);
    ranges[1] = first < nx ? range(first, nx - 1) : Range{0, 0};
  }
  return 2;
}

template <class F>
bool BoxGrid::visit_range(const Probe& probe, std::int32_t slot, Range range, F& visit) const {
  const float* const lower = bounds_.data();
  const float* const upper = lower + 3 * stride_;
  for (std::uint32_t at = range.begin; at < range.end; at += kLanes) {
    unsigned hits = probe.overlaps(lower + at, upper + at, stride_);
    if (range.end - at < kLanes) hits &= (1U << (range.end - at)) - 1;
    for (; hits != 0; hits &= hits - 1) {
      if (!visit(slot, slots_[at + static_cast<unsigned>(std::countr_zero(hits))])) return false;
    }
  }
  return true;
}

template <class F>
std::int64_t BoxGrid::join(F&& visit) const {
  std::int64_t looked_at = 0;
  const auto [nx, ny, nz] = std::array{axes_[0].cells, axes_[1].cells, axes_[2].cells};
  std::size_t cell = 0;
  for (std::int32_t z = 0; z < nz; ++z) {
    for (std::int32_t y = 0; y < ny; ++y) {
      for (std::int32_t x = 0; x < nx; ++x, ++cell) {
        const Range own{begins_[cell], begins_[cell + 1]};
        if (own.begin == own.end) continue;
        ++looked_at;
        std::array<Range, 12> ranges;
        std::size_t rows = add_row(x, y, z, 1, ranges.data());
        if (ny > 1) rows += add_row(x, y + 1, z, -1, ranges.data() + rows);
        if (nz > 1) {
          for (std::int32_t dy = ny > 1 ? -1 : 0; dy <= (ny > 1 ? 1 : 0); ++dy) {
            rows += add_row(x, y + dy, z + 1, -1, ranges.data() + rows);
          }
        }
        for (std::uint32_t i = own.begin; i < own.end; ++i) {
          const float* const at = bounds_.data() + i;
          const Probe probe(at[0], at[stride_], at[2 * stride_], at[3 * stride_], at[4 * stride_],
                            at[5 * stride_]);
          if (!visit_range(probe, slots_[i], {i + 1, own.end}, visit)) return looked_at;
          for (std::size_t r = 0; r < rows; ++r) {
            if (!visit_range(probe, slots_[i], ranges[r], visit)) return looked_at;
          }
        }
      }
    }
  }
  return looked_at;
}

}  // namespace cradle
