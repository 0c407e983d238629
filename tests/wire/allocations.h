/// How much this program has asked the allocator for, and how much a decoder may.
#pragma once

#include <cstddef>

namespace cradle::test {

/// Bytes since the start, in all threads.
std::size_t allocated_bytes();

/// The most that decoding a payload may ask for in all: the generated structs and the values, each
/// not much larger than on the wire, and names beside them.
constexpr std::size_t decoder_limit(std::size_t payload_bytes) { return 4 * payload_bytes; }

}  // namespace cradle::test
