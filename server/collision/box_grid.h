/// A uniform grid over boxes of similar size: all their pairs, quicker than by a tree.
///
/// A box belongs to the cell of its lower corner, and must not reach further than the next cell:
/// then those it may overlap are in the same cell or in one beside it. The few larger boxes are
/// left to others. The grid is wound up: beyond its last cell the first follows again, so it bears
/// bodies anywhere. Cost: O(n), where the cells are not crowded.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "server/collision/box_kernels.h"
#include "server/collision/box_lanes.h"

namespace cradle {

class BoxGrid {
 public:
  /// Over the boxes of these slots: `boxes` has one for every slot there is. False, and no use, if
  /// sizes are not similar or too many boxes share a cell: a rule that looks at nothing else.
  bool build(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots);

  /// Slots of boxes too large for the cells, ascending.
  std::span<const std::int32_t> large() const { return large_; }

  /// But for the large ones: a pair of boxes is found from one of them.
  std::size_t boxes() const { return begins_.back(); }
  /// Calls `visit(slot, slot)` for every pair of boxes that overlap, but for the large ones, found
  /// from these boxes by the order of their cells, until it returns false. Returns the cells looked
  /// at: those that begin with one of them.
  template <class F>
  std::int64_t join(std::size_t first_box, std::size_t end_box, F&& visit) const;

  /// Calls `visit(slot, other)` for every box that overlaps this one, of any size, but for the
  /// large ones, until it returns false. Returns the cells looked at.
  template <class F>
  std::int64_t query(const FloatBox& box, std::int32_t slot, F&& visit) const;

 private:
  using Range = GridRange;
  struct Axis {
    std::int32_t cells = 1;

    std::uint32_t wound(std::int32_t cell) const {
      if (cell >= 0 && cell < cells) return static_cast<std::uint32_t>(cell);
      const std::int32_t rest = cell % cells;
      return static_cast<std::uint32_t>(rest < 0 ? rest + cells : rest);
    }
    std::uint32_t size() const { return static_cast<std::uint32_t>(cells); }
  };

  using Cells = std::int32_t __attribute__((vector_size(16)));
  static constexpr float kCellReach = 1e9F;  // so that a cell is an int

  /// Never turns order around: of two coordinates the larger has no smaller cell.
  Cells cells_at(const std::array<float, 4>& corner) const;

  bool choose_axes(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots);
  bool count(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots);
  void scatter(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots);
  /// Of the boxes in cells of interest: two a row where that is wound around.
  struct Ranges {
    std::array<Range, 10> ranges;
    std::size_t count = 0;
    void add(Range range) { ranges[count++] = range; }
    std::size_t boxes() const {
      std::size_t sum = 0;
      for (std::size_t r = 0; r < count; ++r) sum += ranges[r].end - ranges[r].begin;
      return sum;
    }
  };
  /// The rows after (y, z) among those beside it, by their first cells.
  struct Rows {
    std::array<std::size_t, 4> firsts;
    std::size_t count = 0;
  };

  Rows rows_after(std::int32_t y, std::int32_t z) const;
  /// The cells x - 1 .. x + 1 of a row.
  void add_row(std::size_t first, std::int32_t x, Ranges& ranges) const;
  /// The cells after x of a row among those beside it, and of the others. The first range begins
  /// with the boxes of x.
  Ranges ranges_from(std::size_t first, std::int32_t x, const Rows& others) const;
  /// Overlaps of many boxes in one list: how many each has is chance, and to guess wrong where a
  /// list ends is dear.
  struct Found {
    static constexpr std::size_t kPiece = 256, kEnough = 256;
    std::array<std::uint32_t, kEnough + kPiece + kGridLanes> boxes, others;
    std::size_t count = 0;
  };
  template <class F>
  bool find_overlaps(std::uint32_t box, const Ranges& ranges, Found& found, F& visit) const;
  template <class F>
  bool visit_found(Found& found, F& visit) const;
  template <class F>
  bool visit_range(const Probe& probe, std::int32_t slot, Range range, F& visit) const;

  const BoxKernels* kernels_ = &box_kernels_of(0);
  std::array<Axis, 3> axes_;
  alignas(16) std::array<float, 4> origin_{}, cells_per_m_{};  // of the axes
  std::vector<std::int32_t> large_;
  std::vector<std::uint32_t> cells_of_;  // by place in `slots`; kLarge: none
  std::vector<std::uint32_t> begins_;    // of each cell in the arrays below, and the end
  std::vector<std::int32_t> slots_;      // in the order of the cells
  std::vector<float> bounds_;            // lower x, y, z, upper x, y, z of them, an array each
  std::size_t stride_ = 0;               // of bounds_
};

inline BoxGrid::Cells BoxGrid::cells_at(const std::array<float, 4>& corner) const {
  using Four = float __attribute__((vector_size(16)));
  Four x, origin, scale;
  std::memcpy(&x, corner.data(), sizeof x);
  std::memcpy(&origin, origin_.data(), sizeof origin);
  std::memcpy(&scale, cells_per_m_.data(), sizeof scale);
  const Four least = {-kCellReach, -kCellReach, -kCellReach, 0}, most = -least;
  x = (x - origin) * scale;
  x = x < least ? least : x;
  x = x > most ? most : x;
  return __builtin_convertvector(x, Cells);
}

inline BoxGrid::Rows BoxGrid::rows_after(std::int32_t y, std::int32_t z) const {
  const std::int32_t ny = axes_[1].cells, nz = axes_[2].cells;
  Rows rows;
  const auto add = [&](std::int32_t at_y, std::int32_t at_z) {
    const std::uint32_t row = axes_[2].wound(at_z) * axes_[1].size() + axes_[1].wound(at_y);
    rows.firsts[rows.count++] = std::size_t{row} * axes_[0].size();
  };
  if (ny > 1) add(y + 1, z);
  if (nz > 1 && ny > 1) add(y - 1, z + 1);
  if (nz > 1) add(y, z + 1);
  if (nz > 1 && ny > 1) add(y + 1, z + 1);
  return rows;
}

inline void BoxGrid::add_row(std::size_t first, std::int32_t x, Ranges& ranges) const {
  const std::int32_t nx = axes_[0].cells;
  const std::uint32_t* const begins = begins_.data() + first;
  ranges.add({begins[std::max(x - 1, 0)], begins[std::min(x + 2, nx)]});
  if (nx == 1) return;
  if (x == 0) ranges.add({begins[nx - 1], begins[nx]});
  if (x == nx - 1) ranges.add({begins[0], begins[1]});
}

inline BoxGrid::Ranges BoxGrid::ranges_from(std::size_t first, std::int32_t x,
                                            const Rows& others) const {
  const std::int32_t nx = axes_[0].cells;
  const std::uint32_t* const begins = begins_.data() + first;
  Ranges ranges;
  ranges.add({begins[x], begins[std::min(x + 2, nx)]});
  if (x + 1 == nx && nx > 1) ranges.add({begins[0], begins[1]});
  for (std::size_t r = 0; r < others.count; ++r) add_row(others.firsts[r], x, ranges);
  return ranges;
}

/// Of crowded cells in pieces: there is room for all that may be found at a time.
template <class F>
bool BoxGrid::find_overlaps(std::uint32_t box, const Ranges& ranges, Found& found, F& visit) const {
  const auto find = [&](const Range* in, std::size_t ranges_in) {
    const std::size_t count = kernels_->find_overlaps({bounds_.data(), stride_}, box, in, ranges_in,
                                                      found.others.data() + found.count);
    std::size_t k = 0;
    do {  // once, nearly always
      std::fill_n(found.boxes.begin() + found.count + k, kGridLanes, box);
      k += kGridLanes;
    } while (k < count);
    found.count += count;
    return found.count < Found::kEnough || visit_found(found, visit);
  };
  if (ranges.boxes() <= Found::kPiece) return find(ranges.ranges.data(), ranges.count);
  for (std::size_t r = 0; r < ranges.count; ++r) {
    for (Range piece = ranges.ranges[r]; piece.begin < ranges.ranges[r].end;
         piece.begin = piece.end) {
      piece.end =
          std::min(piece.begin + static_cast<std::uint32_t>(Found::kPiece), ranges.ranges[r].end);
      if (!find(&piece, 1)) return false;
    }
  }
  return true;
}

template <class F>
bool BoxGrid::visit_found(Found& found, F& visit) const {
  for (std::size_t k = 0; k < found.count; ++k) {
    if (!visit(slots_[found.boxes[k]], slots_[found.others[k]])) return false;
  }
  found.count = 0;
  return true;
}

template <class F>
bool BoxGrid::visit_range(const Probe& probe, std::int32_t slot, Range range, F& visit) const {
  const float* const lower = bounds_.data();
  const float* const upper = lower + 3 * stride_;
  for (std::uint32_t at = range.begin; at < range.end; at += kFloatLanes) {
    unsigned hits = probe.overlaps(lower + at, upper + at, stride_);
    if (range.end - at < kFloatLanes) hits &= (1U << (range.end - at)) - 1;
    for (; hits != 0; hits &= hits - 1) {
      if (!visit(slot, slots_[at + static_cast<unsigned>(std::countr_zero(hits))])) return false;
    }
  }
  return true;
}

template <class F>
std::int64_t BoxGrid::query(const FloatBox& box, std::int32_t slot, F&& visit) const {
  const Cells low = cells_at(box.lower), high = cells_at(box.upper);
  std::array<std::int32_t, 3> first, count;
  for (std::size_t k = 0; k < 3; ++k) {
    first[k] = static_cast<std::int32_t>(axes_[k].wound(low[k] - 1));
    count[k] = std::min(high[k] - low[k] + 2, axes_[k].cells);
  }
  const Probe probe(box);
  const std::int32_t past = std::max(first[0] + count[0] - axes_[0].cells, 0);
  std::int64_t looked_at = 0;
  for (std::int32_t z = 0; z < count[2]; ++z) {
    for (std::int32_t y = 0; y < count[1]; ++y) {
      const std::uint32_t row =
          axes_[2].wound(first[2] + z) * axes_[1].size() + axes_[1].wound(first[1] + y);
      const std::uint32_t* const begins = begins_.data() + row * axes_[0].size();
      looked_at += count[0];
      const Range ahead{begins[first[0]], begins[first[0] + count[0] - past]};
      if (!visit_range(probe, slot, ahead, visit)) return looked_at;
      if (past > 0 && !visit_range(probe, slot, {begins[0], begins[past]}, visit)) return looked_at;
    }
  }
  return looked_at;
}

template <class F>
std::int64_t BoxGrid::join(std::size_t first_box, std::size_t end_box, F&& visit) const {
  const auto begin = static_cast<std::uint32_t>(first_box),
             end = static_cast<std::uint32_t>(end_box);
  const std::size_t ny = axes_[1].size(), nx = axes_[0].size(), cells = begins_.size() - 1;
  const auto after = std::ranges::upper_bound(begins_, begin) - begins_.begin();
  std::int64_t looked_at = 0;
  Found found;
  for (std::size_t row = static_cast<std::size_t>(after - 1) / nx;
       row * nx < cells && begins_[row * nx] < end; ++row) {
    const Rows others =
        rows_after(static_cast<std::int32_t>(row % ny), static_cast<std::int32_t>(row / ny));
    for (std::int32_t x = 0; x < axes_[0].cells; ++x) {
      const std::uint32_t* const own = begins_.data() + row * nx + x;
      const std::uint32_t first = std::max(own[0], begin), last = std::min(own[1], end);
      if (first >= last) continue;
      looked_at += own[0] >= begin ? 1 : 0;
      Ranges ranges = ranges_from(row * nx, x, others);
      for (std::uint32_t i = first; i < last; ++i) {
        ranges.ranges[0].begin = i + 1;
        if (!find_overlaps(i, ranges, found, visit)) return looked_at;
      }
    }
  }
  visit_found(found, visit);
  return looked_at;
}

}  // namespace cradle
