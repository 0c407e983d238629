/// How much this program has asked the allocator for.
#pragma once

#include <cstddef>

namespace cradle::test {

/// Bytes since the start, in all threads.
std::size_t allocated_bytes();

}  // namespace cradle::test
