#include "server/collision/box_kernels.h"

#include "server/collision/machine_lanes.h"

namespace cradle {

const BoxKernels& box_kernels_of(int lanes) {
#ifdef CRADLE_WIDE_X86
  return kernels_of_width<BoxKernels>(lanes,
                                      {&kBoxKernels1, &kBoxKernels2, &kBoxKernels4, &kBoxKernels8});
#else
  return kernels_of_width<BoxKernels>(lanes, {&kBoxKernels1, &kBoxKernels2});
#endif
}

}  // namespace cradle
