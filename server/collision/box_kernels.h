/// The wide kernels of boxes that this machine can run.
#pragma once

#include "server/collision/box_block.h"

namespace cradle {

/// Of so many lanes, one of machine_lanes(); or 0: the most.
const BoxKernels& box_kernels_of(int lanes);

}  // namespace cradle
