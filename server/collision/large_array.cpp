#include "server/collision/large_array.h"

#include <sys/mman.h>

namespace cradle {

void prefer_large_pages(void* begin, std::size_t size) {
  static_cast<void>(madvise(begin, size, MADV_HUGEPAGE));
}

}  // namespace cradle
