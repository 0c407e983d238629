#include "server/collision/box_grid.h"

#include <algorithm>
#include <cmath>

#include "server/collision/index.h"

namespace cradle {
namespace {

constexpr std::uint32_t kLarge = ~0U;
// Sizes are similar if 19 of 20 are at most this many times the median, along each axis.
constexpr float kSimilar = 3;
constexpr float kRoomier = 1.25;         // boxes up to so much larger than those 19 fit a cell, too
constexpr std::size_t kLargeMost = 16;   // one box in ... may be too large for the cells
constexpr std::size_t kCellsPerBox = 2;  // at most: beyond, the grid is wound up more often
constexpr std::size_t kSharedPerBox = 32;  // places in a box's cell, on average, at most
constexpr std::int32_t kNarrow = 4;        // cells: narrower than that, one cell is as good

}  // namespace

/// Cells as large as nearly all boxes of a sample, and as many as cover nearly all of it.
bool BoxGrid::choose_axes(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots) {
  constexpr std::size_t most = 61;
  const std::size_t count = std::min(most, slots.size());
  const std::size_t last = count - 1 - count / 20;
  std::array<double, 3> widths;
  for (std::size_t k = 0; k < 3; ++k) {
    std::array<float, most> extents, corners;
    for (std::size_t i = 0; i < count; ++i) {
      const FloatBox& box = boxes[index(slots[i * slots.size() / count])];
      extents[i] = box.upper[k] - box.lower[k];
      corners[i] = box.lower[k];
    }
    const auto end = static_cast<std::ptrdiff_t>(count);
    std::sort(extents.begin(), extents.begin() + end);
    std::sort(corners.begin(), corners.begin() + end);
    const float most_extent = extents[last];
    if (!(most_extent > 0 && most_extent < kCellReach &&
          most_extent <= kSimilar * extents[count / 2])) {
      return false;
    }
    const float extent =
        *(std::upper_bound(extents.begin(), extents.begin() + end, kRoomier * most_extent) - 1);
    origin_[k] = corners[count / 20];
    cells_per_m_[k] = 1 / extent;
    widths[k] = 1 + 1.1 * (double{corners[last]} - corners[count / 20]) / double{extent};
  }
  const double cells_max = static_cast<double>(kCellsPerBox * slots.size()) + 64;
  for (std::size_t k = 0; k < 3; ++k) widths[k] = widths[k] < kNarrow ? 1 : widths[k];
  while (widths[0] * widths[1] * widths[2] > cells_max) {
    double& widest = *std::max_element(widths.begin(), widths.end());
    widest = std::max(0.5 * widest, std::min<double>(widest, cells_max) / 2);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    axes_[k].cells = static_cast<std::int32_t>(widths[k]);
    if (axes_[k].cells < kNarrow) axes_[k].cells = 1;
  }
  return true;
}

/// Which cell each box is in, and how many are in each.
bool BoxGrid::count(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots) {
  const auto [nx, ny, nz] = std::array{axes_[0].cells, axes_[1].cells, axes_[2].cells};
  begins_.assign(index(nx) * index(ny) * index(nz) + 1, 0);
  cells_of_.resize(slots.size());
  large_.clear();
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const FloatBox& box = boxes[index(slots[i])];
    const Cells low = cells_at(box.lower), high = cells_at(box.upper);
    const bool fits = high[0] <= low[0] + 1 && high[1] <= low[1] + 1 && high[2] <= low[2] + 1;
    const std::uint32_t cell =
        (axes_[2].wound(low[2]) * axes_[1].size() + axes_[1].wound(low[1])) * axes_[0].size() +
        axes_[0].wound(low[0]);
    cells_of_[i] = fits ? cell : kLarge;
    if (fits) {
      ++begins_[cell];
    } else {
      large_.push_back(slots[i]);
    }
  }
  std::size_t shared = 0;
  std::uint32_t sum = 0;
  for (std::uint32_t& cell : begins_) {
    shared += std::size_t{cell} * cell;
    const std::uint32_t boxes_in = cell;
    cell = sum;
    sum += boxes_in;
  }
  return large_.size() * kLargeMost <= slots.size() && shared <= kSharedPerBox * slots.size();
}

void BoxGrid::scatter(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots) {
  slots_.resize(slots.size());
  stride_ = slots.size() + kGridLanes;  // a read of so many may begin at the last
  bounds_.resize(6 * stride_);
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (cells_of_[i] == kLarge) continue;
    const std::uint32_t place = begins_[cells_of_[i]]++;
    const FloatBox& box = boxes[index(slots[i])];
    slots_[place] = slots[i];
    for (std::size_t k = 0; k < 3; ++k) {
      bounds_[k * stride_ + place] = box.lower[k];
      bounds_[(3 + k) * stride_ + place] = box.upper[k];
    }
  }
  // Each now tells where its cell ends.
  std::copy_backward(begins_.begin(), begins_.end() - 1, begins_.end());
  begins_[0] = 0;
}

bool BoxGrid::build(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots) {
  if (slots.empty() || !choose_axes(boxes, slots) || !count(boxes, slots)) return false;
  scatter(boxes, slots);
  return true;
}

}  // namespace cradle
