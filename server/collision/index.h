/// Names and places of bodies, vertices, contacts: kept as std::int32_t, which takes half the
/// memory and has -1 for none; arrays are entered by std::size_t.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cradle {

/// The place in an array. `i` is not negative.
constexpr std::size_t index(std::int32_t i) { return static_cast<std::size_t>(i); }

}  // namespace cradle
