/// How many doubles this machine can work on side by side.
#pragma once

#include <vector>

namespace cradle {

/// The widths that kernels are compiled for and this machine can run, ascending: 1, 2, and, of 4
/// (AVX2) and 8 (AVX-512 F, VL and DQ), what it has.
const std::vector<int>& machine_lanes();

}  // namespace cradle
