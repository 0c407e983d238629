/// The wide kernels that this machine can run.
#pragma once

#include "server/dynamics/contact/contact_block.h"

namespace cradle {

/// Of so many lanes, one of machine_lanes(); or 0: the most.
const ContactKernels& contact_kernels_of(int lanes);

}  // namespace cradle
