#include "server/large_pages.h"

#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace cradle {
namespace {

constexpr std::size_t kLargePage = std::size_t{1} << 21;

/// Not a sanitizer's, which would fill what it is asked for.
bool is_heap_of_libc() { return mallinfo2().arena > 0; }

/// What the heap may grow to in large pages: more than a world takes where there is room for one.
std::size_t quarter_of_memory() {
  const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page <= 0) return 0;
  return static_cast<std::size_t>(pages) / 4 * static_cast<std::size_t>(page);
}

}  // namespace

/// One heap for all threads and sizes, which never shrinks. It is made as large as it may become
/// once, while little is in it, and told to lie in large pages; what comes before the first of
/// these is left out.
void keep_memory_in_large_pages() {
  if (!is_heap_of_libc() || mallopt(M_MMAP_MAX, 0) == 0 || mallopt(M_TRIM_THRESHOLD, -1) == 0 ||
      mallopt(M_ARENA_MAX, 1) == 0) {
    return;
  }
  const std::size_t size = quarter_of_memory();
  void* const room = std::malloc(size);
  if (room == nullptr) return;
  const auto begin = reinterpret_cast<std::uintptr_t>(room);
  const std::size_t before = (kLargePage - begin % kLargePage) % kLargePage;
  if (before < size) {
    madvise(reinterpret_cast<void*>(begin + before), size - before, MADV_HUGEPAGE);
  }
  std::free(room);
  [[maybe_unused]] static void* const left_out = std::malloc(before);
}

bool take_memory(std::size_t size) {
  constexpr std::size_t kSmallestPage = 4096;
  if (!is_heap_of_libc()) return true;
  void* const room = std::malloc(size);
  if (room == nullptr) return false;
  for (std::size_t at = 0; at < size; at += kSmallestPage) {
    static_cast<volatile char*>(room)[at] = 0;  // volatile: or it is left out, as nobody reads it
  }
  std::free(room);
  return true;
}

}  // namespace cradle
