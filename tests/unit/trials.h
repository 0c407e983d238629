/// How many random poses a test walks through.
#pragma once

#if defined(__SANITIZE_ADDRESS__)
#define CRADLE_IS_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define CRADLE_IS_SANITIZED
#endif
#endif

namespace cradle {

/// `full`; a tenth of it under the address sanitizer, which takes fifty times as long, and looks
/// for other faults than wrong figures.
constexpr int trials(int full) {
#ifdef CRADLE_IS_SANITIZED
  return full / 10;
#else
  return full;
#endif
}

}  // namespace cradle
