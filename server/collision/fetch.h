#pragma once

#include <cstddef>

namespace cradle {

/// Memory comes in lines of so many bytes.
inline constexpr std::size_t kCacheLine = 64;

/// Fetches what is about to be read or written: where it lies anywhere, to wait for it takes longer
/// than all else that is done with it.
inline void fetch(const void* begin, std::size_t size = 1) {
  asm volatile("");  // else g++ 12 takes callers for functions without effect, and drops the calls
  const auto* const bytes = static_cast<const char*>(begin);
  for (std::size_t at = 0; at < size; at += kCacheLine) __builtin_prefetch(bytes + at);
  if (size % kCacheLine > 1) __builtin_prefetch(bytes + size - 1);  // it may lie across lines
}

}  // namespace cradle
