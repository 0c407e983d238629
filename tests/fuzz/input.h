/// Draws values from a fuzzer's bytes. When they are used up, everything drawn is zero.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <type_traits>

#include "protocol/codec.h"

namespace cradle::fuzz {

/// The target's own finding: says what is broken, and ends as a crash does.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

class Input {
 public:
  explicit Input(ByteView bytes) : left_(bytes) {}

  bool is_empty() const { return left_.empty(); }

  /// The next `count` bytes, or as many as there are.
  ByteView take(std::size_t count) {
    const ByteView taken = left_.first(std::min(count, left_.size()));
    left_ = left_.subspan(taken.size());
    return taken;
  }

  /// Any bit pattern of a number.
  template <class Number>
  Number any() {
    static_assert(std::is_arithmetic_v<Number>);
    Number number{};
    const ByteView bytes = take(sizeof number);
    if (!bytes.empty()) std::memcpy(&number, bytes.data(), bytes.size());
    return number;
  }

  /// 0 .. end - 1, from one byte; `end` is at most 256.
  std::size_t below(std::size_t end) { return any<std::uint8_t>() % end; }
  bool one_in(std::size_t count) { return below(count) == count - 1; }

 private:
  ByteView left_;
};

}  // namespace cradle::fuzz
