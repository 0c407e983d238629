// Morton order (G. M. Morton, 1966); trees in its order: C. Lauterbach et al., Fast BVH
// construction on GPUs, 2009. Here all nodes have four children side by side in memory, as in
// Jolt's quad tree.
#include "server/collision/box_tree.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <utility>

namespace cradle {
namespace {

constexpr int kBitsPerAxis = 16;
constexpr std::size_t kRadixFrom = 1024;  // below, comparing is quicker than counting
constexpr int kDigitBits = 12;

using TreePoint = std::array<float, 3>;

TreePoint middle(const FloatBox& box) {
  TreePoint point;
  for (std::size_t k = 0; k < 3; ++k) point[k] = 0.5F * box.lower[k] + 0.5F * box.upper[k];
  return point;
}

/// Spreads 16 bits, two zeros behind each.
std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 16) & 0x0000ff0000ffULL;
  x = (x | x << 8) & 0x00f00f00f00fULL;
  x = (x | x << 4) & 0x0c30c30c30c3ULL;
  x = (x | x << 2) & 0x249249249249ULL;
  return x;
}

}  // namespace

MortonCurve::MortonCurve(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots) {
  constexpr std::size_t most = 61;
  const std::size_t count = std::min(most, slots.size());
  if (count == 0) return;
  float width = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    std::array<float, most> sample;
    for (std::size_t i = 0; i < count; ++i) {
      const std::int32_t slot = slots[i * slots.size() / count];
      sample[i] = middle(boxes[static_cast<std::size_t>(slot)])[k];
    }
    std::sort(sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(count));
    centre_[k] = sample[count / 2];
    width = std::max(width, 0.5F * sample[count - 1 - count / 20] - 0.5F * sample[count / 20]);
  }
  scale_ = 1 / std::clamp(width, 1e-30F, 1e30F);
}

std::uint64_t MortonCurve::place(const FloatBox& box) const {
  constexpr float half = 1 << (kBitsPerAxis - 1);
  constexpr float limit = 1e30F;  // so that t / (1 + |t|) is a number
  const TreePoint p = middle(box);
  std::uint64_t result = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const float t = std::clamp((0.5F * p[k] - 0.5F * centre_[k]) * scale_, -limit, limit);
    const float cell = half + half * (t / (1 + std::abs(t)));
    result |= spread(static_cast<std::uint64_t>(std::min(cell, 2 * half - 1))) << k;
  }
  return result;
}

void BoxTree::sort(std::span<const FloatBox> boxes, const MortonCurve& curve) {
  keys_.resize(slots_.size());
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    keys_[i] = {curve.place(boxes[static_cast<std::size_t>(slots_[i])]), slots_[i]};
  }
  if (keys_.size() < kRadixFrom) {
    std::sort(keys_.begin(), keys_.end(), [](const Key& a, const Key& b) {
      return a.code != b.code ? a.code < b.code : a.slot < b.slot;
    });
  } else {
    spare_.resize(keys_.size());
    std::array<std::uint32_t, 1 << kDigitBits> place;
    for (int shift = 0; shift < 3 * kBitsPerAxis; shift += kDigitBits) {
      const auto digit = [shift](const Key& key) {
        return static_cast<std::size_t>(key.code >> shift) & ((1 << kDigitBits) - 1);
      };
      place.fill(0);
      for (const Key& key : keys_) ++place[digit(key)];
      std::uint32_t sum = 0;
      for (std::uint32_t& p : place) sum += std::exchange(p, sum);
      for (const Key& key : keys_) spare_[place[digit(key)]++] = key;
      keys_.swap(spare_);
    }
  }
  for (std::size_t i = 0; i < slots_.size(); ++i) slots_[i] = keys_[i].slot;
}

void BoxTree::build(std::span<const FloatBox> boxes, std::span<const std::int32_t> slots,
                    const MortonCurve& curve) {
  slots_.assign(slots.begin(), slots.end());
  if (!slots_.empty()) sort(boxes, curve);
  refit(boxes);
}

void BoxTree::refit(std::span<const FloatBox> boxes) {
  nodes_.clear();
  levels_.clear();
  if (slots_.empty()) return;
  for (std::size_t below = slots_.size();;) {
    const std::size_t count = (below + kFloatLanes - 1) / kFloatLanes;
    const std::size_t begin = nodes_.size();
    const std::size_t children = levels_.empty() ? 0 : levels_.back();
    nodes_.resize(begin + count);
    for (std::size_t i = 0; i < below; ++i) {
      nodes_[begin + i / kFloatLanes].set(
          i % kFloatLanes, levels_.empty() ? boxes[static_cast<std::size_t>(slots_[i])]
                                           : nodes_[children + i].bounds());
    }
    levels_.push_back(begin);
    if (count == 1) return;
    below = count;
  }
}

void BoxTree::renumber(std::span<const std::int32_t> now) {
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (slots_[i] < 0) continue;
    assert(static_cast<std::size_t>(slots_[i]) < now.size());
    slots_[i] = now[static_cast<std::size_t>(slots_[i])];
    if (slots_[i] < 0) remove(static_cast<std::int32_t>(i));
  }
}

void BoxTree::index_oldest() {
  oldest_.assign(nodes_.size(), {});
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    const std::size_t below = level == 0 ? slots_.size() : nodes_in(level - 1);
    for (std::size_t i = 0; i < below; ++i) {
      std::int32_t oldest = slots_[i];
      if (level > 0) {
        const auto& child = oldest_[levels_[level - 1] + i];
        oldest = *std::min_element(child.begin(), child.end());
      }
      oldest_[levels_[level] + i / kFloatLanes][i % kFloatLanes] = oldest;
    }
    for (std::size_t i = below; i % kFloatLanes != 0; ++i) {
      oldest_[levels_[level] + i / kFloatLanes][i % kFloatLanes] =
          std::numeric_limits<std::int32_t>::max();
    }
  }
}

}  // namespace cradle
