#include "server/dynamics/contact/islands.h"

#include <algorithm>
#include <numeric>

namespace cradle {

std::int32_t Islands::root(std::int32_t body) {
  const auto parent = [this](std::int32_t i) -> std::int32_t& {
    return parent_[static_cast<std::size_t>(i)];
  };
  while (parent(body) != body) body = parent(body) = parent(parent(body));
  return body;
}

void Islands::find(std::span<const ColouredPair> pairs, std::size_t bodies) {
  parent_.resize(bodies);
  std::iota(parent_.begin(), parent_.end(), 0);
  for (const auto [a, b] : pairs) {
    if (a < 0 || b < 0) continue;
    if (parent_[static_cast<std::size_t>(a)] == parent_[static_cast<std::size_t>(b)]) continue;
    const std::int32_t one = root(a), other = root(b);
    parent_[static_cast<std::size_t>(std::max(one, other))] = std::min(one, other);
  }
  count_ = 0;
  island_.resize(bodies);
  for (std::size_t i = 0; i < bodies; ++i) {
    const auto parent = static_cast<std::size_t>(parent_[i]);  // its island is known by now
    island_[i] = parent == i ? static_cast<std::int32_t>(count_++) : island_[parent];
  }
  sizes_.assign(count_, 0);
  for_runs(island_, [this](std::size_t island, std::size_t begin, std::size_t end) {
    sizes_[island] += static_cast<int>(end - begin);
  });
}

}  // namespace cradle
