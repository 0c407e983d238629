/// What every broad phase agrees on: which boxes count, what a plane meets, the order of pairs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/collision/broad_phase.h"

namespace cradle {

inline constexpr double kBroadReach_m = 1e100;

/// Not empty, and all of it within reach; a box with a NaN is neither.
inline bool is_usable(const Aabb& box) {
  const auto along = [&](int k) {
    return box.lower[k] <= box.upper[k] && box.lower[k] >= -kBroadReach_m &&
           box.upper[k] <= kBroadReach_m;
  };
  return along(0) && along(1) && along(2);
}

/// The lowest corner of the box along the plane's normal is in the solid, or on its boundary.
inline bool overlap(const Aabb& box, const Plane& plane) {
  const auto& n = plane.normal_W.array();
  return (n * box.lower.array()).min(n * box.upper.array()).sum() <= plane.offset;
}

/// Appends the pairs of planes and usable boxes, in no order of use. Ends early when `pairs` has
/// more than `most`.
void add_plane_pairs(const BroadPhaseInput& input, std::size_t most, std::vector<BodyPair>& pairs);

/// A place in the midst of the usable boxes, by the median of a sample: origin for FloatBox.
Vector median_of(std::span<const Aabb> boxes);

/// Sorts by (a, b) in linear time.
class PairSorter {
 public:
  void sort(std::size_t slots, std::vector<BodyPair>& pairs);

 private:
  /// Puts each pair where its row is; pairs of a row keep their order.
  template <class F>
  void scatter(std::size_t slots, const std::vector<BodyPair>& from, std::vector<BodyPair>& to,
               F&& row_of);

  std::vector<BodyPair> unsorted_;
  std::vector<std::uint32_t> row_ends_;
};

}  // namespace cradle
