#include "server/dynamics/contact/colouring.h"

#include <algorithm>
#include <bit>

namespace cradle {

int Colouring::colour(std::span<const ColouredPair> pairs, std::span<std::uint8_t> colours) {
  for (const auto [a, b] : pairs) {
    if (a >= 0) used_[static_cast<std::size_t>(a)] = 0;
    if (b >= 0) used_[static_cast<std::size_t>(b)] = 0;
  }
  int most = -1;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto [a, b] = pairs[k];
    std::uint64_t none = 0;
    std::uint64_t& of_a = a >= 0 ? used_[static_cast<std::size_t>(a)] : none;
    std::uint64_t& of_b = b >= 0 ? used_[static_cast<std::size_t>(b)] : none;
    const int colour = std::countr_one(of_a | of_b);
    colours[k] = static_cast<std::uint8_t>(colour);
    most = std::max(most, colour);
    if (colour == kColours) continue;
    of_a |= std::uint64_t{1} << colour;
    of_b |= std::uint64_t{1} << colour;
  }
  return most + 1;
}

}  // namespace cradle
