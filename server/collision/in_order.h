/// Lists that are made side by side, in the order of what they are made of.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/executor.h"

namespace cradle {

/// Indices that one thread takes at a time.
inline constexpr std::size_t kInOrder = 256;

/// Calls `f(k)` for those of begin .. end, at most kInOrder, that are marked by 1, others by 0.
/// Where marks are chance, a branch at each would cost more than all else.
template <class F>
void for_marked(std::span<const std::uint8_t> marks, std::size_t begin, std::size_t end,
                const F& f) {
  assert(end - begin <= kInOrder);
  std::array<std::size_t, kInOrder + 1> marked;
  std::size_t count = 0;
  for (std::size_t k = begin; k < end; ++k) {
    marked[count] = k;
    count += marks[k];
  }
  for (std::size_t n = 0; n < count; ++n) f(marked[n]);
}

/// Likewise, of any number of them.
template <class F>
void for_all_marked(std::span<const std::uint8_t> marks, const F& f) {
  for (std::size_t begin = 0; begin < marks.size(); begin += kInOrder) {
    for_marked(marks, begin, std::min(begin + kInOrder, marks.size()), f);
  }
}

/// Remembers where each part's entries begin; keeps its memory from list to list.
class InOrder {
 public:
  /// In parts of indices 0 .. count: first `number(begin, end)`, how many entries each has, then
  /// `room(entries)` for all of them, then `write(begin, end, first)`, a part's entries from that
  /// place on. Numbers and writes may go side by side.
  template <class Number, class Room, class Write>
  void list(Executor& executor, std::size_t count, const Number& number, const Room& room,
            const Write& write) {
    firsts_.resize(chunks_of(count, kInOrder));
    for_chunks(executor, count, kInOrder,
               [&](std::size_t part, std::size_t begin, std::size_t end) {
                 firsts_[part] = number(begin, end);
               });
    std::size_t entries = 0;
    for (std::size_t& first : firsts_) {
      const std::size_t of_part = first;
      first = entries;
      entries += of_part;
    }
    room(entries);
    for_chunks(executor, count, kInOrder,
               [&](std::size_t part, std::size_t begin, std::size_t end) {
                 write(begin, end, firsts_[part]);
               });
  }

 private:
  std::vector<std::size_t> firsts_;
};

}  // namespace cradle
