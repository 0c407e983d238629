/// Pairs that are found side by side, in parts that do not depend on threads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/collision/broad_phase.h"
#include "server/collision/executor.h"

namespace cradle {

class PairParts {
 public:
  /// Appends to `pairs` what `find(begin, end, found)` finds for 0 .. count. `find` returns the
  /// nodes or cells it has seen; their sum is returned.
  template <class F>
  std::int64_t find(Executor& executor, std::size_t count, std::vector<BodyPair>& pairs,
                    const F& find) {
    for_each_index(executor, kParts, 1, [&](std::size_t k) {
      Part& part = parts_[k];
      part.found.clear();
      part.seen = find(k * count / kParts, (k + 1) * count / kParts, part.found);
    });
    std::int64_t seen = 0;
    for (const Part& part : parts_) {
      pairs.insert(pairs.end(), part.found.begin(), part.found.end());
      seen += part.seen;
    }
    return seen;
  }

 private:
  static constexpr std::size_t kParts = 16;
  struct alignas(64) Part {  // a line of the cache each: threads write them side by side
    std::vector<BodyPair> found;
    std::int64_t seen = 0;
  };
  std::array<Part, kParts> parts_;
};

}  // namespace cradle
