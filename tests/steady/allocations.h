/// How often this program has asked for memory.
#pragma once

#include <cstddef>

namespace cradle::test {

/// Calls of malloc and its kin since the start, in all threads, whoever made them: operator new is
/// one of them. Under sanitizers, which have a malloc of their own, of operator new alone.
std::size_t allocations();

}  // namespace cradle::test
