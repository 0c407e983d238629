#include "server/collision/box_kernels.h"

#include <cassert>

#include "server/collision/machine_lanes.h"

namespace cradle {

const BoxKernels& box_kernels_of(int lanes) {
  if (lanes == 0) lanes = machine_lanes().back();
  assert(lanes <= machine_lanes().back() && "lanes are one of machine_lanes()");
#ifdef CRADLE_WIDE_X86
  if (lanes == 8) return kBoxKernels8;
  if (lanes == 4) return kBoxKernels4;
#endif
  return lanes == 2 ? kBoxKernels2 : kBoxKernels1;
}

}  // namespace cradle
