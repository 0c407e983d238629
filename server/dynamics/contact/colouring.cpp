#include "server/dynamics/contact/colouring.h"

#include <bit>

namespace cradle {

std::span<const std::uint8_t> Colouring::of(std::span<const ColouredPair> pairs,
                                            std::size_t bodies) {
  used_.assign(bodies, 0);
  colours_.clear();
  for (const auto [a, b] : pairs) {
    std::uint64_t none = 0;
    std::uint64_t& of_a = a >= 0 ? used_[static_cast<std::size_t>(a)] : none;
    std::uint64_t& of_b = b >= 0 ? used_[static_cast<std::size_t>(b)] : none;
    const int colour = std::countr_one(of_a | of_b);
    colours_.push_back(static_cast<std::uint8_t>(colour));
    if (colour == kColours) continue;
    of_a |= std::uint64_t{1} << colour;
    of_b |= std::uint64_t{1} << colour;
  }
  return colours_;
}

}  // namespace cradle
