#include "server/collision/pair_rules.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace cradle {
namespace {

/// Pairs of a slot: rows of more are sorted by counting, too.
constexpr std::size_t kLongRow = 1;

}  // namespace

void add_plane_pairs(const BroadPhaseInput& input, std::size_t most, std::vector<BodyPair>& pairs) {
  for (const Plane& plane : input.planes) {
    const bool plane_moves = input.moves[static_cast<std::size_t>(plane.slot)] != 0;
    for (std::size_t slot = 0; slot < input.boxes.size(); ++slot) {
      const Aabb& box = input.boxes[slot];
      if (!is_usable(box) || !overlap(box, plane)) continue;
      if (!plane_moves && input.moves[slot] == 0) continue;
      const auto other = static_cast<std::int32_t>(slot);
      pairs.push_back({std::min(plane.slot, other), std::max(plane.slot, other)});
      if (pairs.size() > most) return;
    }
  }
}

Vector median_of(std::span<const Aabb> boxes) {
  constexpr std::size_t most = 61;
  std::array<const Aabb*, most> sampled;
  std::size_t count = 0;
  const std::size_t stride = boxes.size() / most + 1;
  for (std::size_t slot = 0; slot < boxes.size(); slot += stride) {
    if (is_usable(boxes[slot])) sampled[count++] = &boxes[slot];
  }
  const std::span sample(sampled.data(), count);
  Vector median = Vector::Zero();
  if (sample.empty()) return median;
  const auto half = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
  for (int k = 0; k < 3; ++k) {
    std::nth_element(sample.begin(), half, sample.end(),
                     [k](const Aabb* a, const Aabb* b) { return a->lower[k] < b->lower[k]; });
    median[k] = (*half)->lower[k];
  }
  return median;
}

template <class F>
void PairSorter::scatter(std::size_t slots, const std::vector<BodyPair>& from,
                         std::vector<BodyPair>& to, F&& row_of) {
  row_ends_.assign(slots + 1, 0);
  for (const BodyPair& pair : from) ++row_ends_[row_of(pair) + 1];
  std::partial_sum(row_ends_.begin(), row_ends_.end(), row_ends_.begin());
  for (const BodyPair& pair : from) to[row_ends_[row_of(pair)]++] = pair;
}

void PairSorter::sort(std::size_t slots, std::vector<BodyPair>& pairs) {
  if (std::is_sorted(pairs.begin(), pairs.end())) return;
  if (pairs.size() < slots / 8) {  // rows would cost more than comparisons
    std::sort(pairs.begin(), pairs.end());
    return;
  }
  unsorted_.reserve(pairs.capacity());  // resizing would ask for no more than it needs now
  unsorted_.resize(pairs.size());
  if (pairs.size() > kLongRow * slots) {
    const auto by_b = [](const BodyPair& pair) { return static_cast<std::size_t>(pair.b); };
    scatter(slots, pairs, unsorted_, by_b);
  } else {
    std::swap(unsorted_, pairs);
  }
  scatter(slots, unsorted_, pairs,
          [](const BodyPair& pair) { return static_cast<std::size_t>(pair.a); });
  if (pairs.size() > kLongRow * slots) return;
  auto row = pairs.begin();
  for (std::size_t slot = 0; slot < slots; ++slot) {
    const auto end = pairs.begin() + static_cast<std::ptrdiff_t>(row_ends_[slot]);
    if (end - row > 1) std::sort(row, end);
    row = end;
  }
}

}  // namespace cradle
