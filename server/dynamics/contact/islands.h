/// Who moves together: bodies that touch, directly or by others between them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/dynamics/contact/colouring.h"

namespace cradle {

/// By union and find, with path halving; near-linear.
class Islands {
 public:
  /// A body that does not yield is -1, and joins nobody.
  void find(std::span<const ColouredPair> pairs, std::size_t bodies);

  /// Numbered by their first bodies. Bodies without pairs are islands, too.
  std::size_t count() const { return count_; }
  std::size_t of(std::int32_t body) const {
    return static_cast<std::size_t>(island_[static_cast<std::size_t>(body)]);
  }
  std::span<const std::int32_t> by_body() const { return island_; }
  /// Bodies, by island.
  std::span<const int> sizes() const { return sizes_; }

 private:
  std::int32_t root(std::int32_t body);

  std::size_t count_ = 0;
  std::vector<std::int32_t> parent_;  // never after its child
  std::vector<std::int32_t> island_;
  std::vector<int> sizes_;
};

/// Calls `f(island, begin, end)` for runs of neighbours in `islands`, which are long in a heap.
template <class F>
void for_runs(std::span<const std::int32_t> islands, const F& f) {
  for (std::size_t begin = 0, end = 0; begin < islands.size(); begin = end) {
    while (end < islands.size() && islands[end] == islands[begin]) ++end;
    f(static_cast<std::size_t>(islands[begin]), begin, end);
  }
}

}  // namespace cradle
