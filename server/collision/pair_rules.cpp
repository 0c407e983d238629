#include "server/collision/pair_rules.h"

#include <algorithm>
#include <numeric>

namespace cradle {

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
  std::vector<const Aabb*> sample;
  const std::size_t stride = boxes.size() / most + 1;
  for (std::size_t slot = 0; slot < boxes.size(); slot += stride) {
    if (is_usable(boxes[slot])) sample.push_back(&boxes[slot]);
  }
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

void PairSorter::sort(std::size_t slots, std::vector<BodyPair>& pairs) {
  if (std::is_sorted(pairs.begin(), pairs.end())) return;
  if (pairs.size() < slots / 8) {  // rows would cost more than comparisons
    std::sort(pairs.begin(), pairs.end());
    return;
  }
  row_ends_.assign(slots + 1, 0);
  for (const BodyPair& pair : pairs) ++row_ends_[static_cast<std::size_t>(pair.a) + 1];
  std::partial_sum(row_ends_.begin(), row_ends_.end(), row_ends_.begin());
  unsorted_.assign(pairs.begin(), pairs.end());
  for (const BodyPair& pair : unsorted_) {
    pairs[row_ends_[static_cast<std::size_t>(pair.a)]++] = pair;
  }
  auto row = pairs.begin();
  for (std::size_t slot = 0; slot < slots; ++slot) {
    const auto end = pairs.begin() + static_cast<std::ptrdiff_t>(row_ends_[slot]);
    std::sort(row, end);
    row = end;
  }
}

}  // namespace cradle
