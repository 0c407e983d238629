/// Which contacts can be solved side by side: those of one colour share no body that yields.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace cradle {

/// Two lines of bodies; a body that does not yield is -1, and joins nothing.
struct ColouredPair {
  std::int32_t a, b;
};

inline constexpr int kColours = 64;

/// The lowest colour that none of the pairs before has at either body (greedy, in order); or
/// kColours where there is none: such pairs are for one after another. Pairs of one group of bodies
/// get the same colours whatever other groups there are.
class Colouring {
 public:
  /// Room for so many bodies.
  void begin(std::size_t bodies) {
    if (used_.size() < bodies) used_.resize(bodies);
  }
  /// Into `colours`, one a pair. Returns how many colours there are. Pairs that share no body with
  /// these may be coloured meanwhile.
  int colour(std::span<const ColouredPair> pairs, std::span<std::uint8_t> colours);

 private:
  std::vector<std::uint64_t> used_;  // by body: a bit a colour
};

}  // namespace cradle
