/// How many random poses a test walks through.
#pragma once

namespace cradle {

/// `full`; a tenth of it under a sanitizer, which takes fifty times as long, and looks
/// for other faults than wrong figures.
constexpr int trials(int full) {
#ifdef CRADLE_SANITIZED
  return full / 10;
#else
  return full;
#endif
}

}  // namespace cradle
