#include "server/dynamics/contact/newton/block_kernels.h"

#include "server/collision/machine_lanes.h"

namespace cradle {

const BlockKernels& block_kernels_of(int lanes) {
  if (lanes == 0) lanes = machine_lanes().back();
#ifdef CRADLE_WIDE_X86
  if (lanes >= kBlockKernels4.lanes) return kBlockKernels4;
#endif
  return lanes >= kBlockKernels2.lanes ? kBlockKernels2 : kBlockKernels1;
}

}  // namespace cradle
