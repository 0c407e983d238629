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
    const std::int32_t one = root(a), other = root(b);
    parent_[static_cast<std::size_t>(std::max(one, other))] = std::min(one, other);
  }
  count_ = 0;
  island_.resize(bodies);
  for (std::size_t i = 0; i < bodies; ++i) {
    const auto first = static_cast<std::size_t>(root(static_cast<std::int32_t>(i)));
    island_[i] = first == i ? static_cast<std::int32_t>(count_++) : island_[first];
  }
}

std::size_t Islands::take(const Islands& all, std::span<const std::uint8_t> are_taken,
                          std::vector<std::int32_t>& renumbered) {
  number_here_.resize(all.count_);
  count_ = 0;
  for (std::size_t i = 0; i < all.count_; ++i) {
    number_here_[i] = are_taken[i] != 0 ? static_cast<std::int32_t>(count_++) : -1;
  }
  island_.clear();
  renumbered.resize(all.island_.size());
  for (std::size_t k = 0; k < renumbered.size(); ++k) {
    const std::int32_t here = number_here_[static_cast<std::size_t>(all.island_[k])];
    renumbered[k] = here < 0 ? -1 : static_cast<std::int32_t>(island_.size());
    if (here >= 0) island_.push_back(here);
  }
  return island_.size();
}

}  // namespace cradle
