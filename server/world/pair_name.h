#pragma once

#include <compare>
#include <cstdint>

namespace cradle {

/// A pair by the ids of its bodies, a < b.
struct PairName {
  std::int64_t a = 0, b = 0;

  auto operator<=>(const PairName&) const = default;
};
static_assert(sizeof(PairName) == 2 * 8);

}  // namespace cradle
