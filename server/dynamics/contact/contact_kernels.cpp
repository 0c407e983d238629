#include "server/dynamics/contact/contact_kernels.h"

#include <cassert>

#include "server/collision/machine_lanes.h"

namespace cradle {

const ContactKernels& contact_kernels_of(int lanes) {
  if (lanes == 0) lanes = machine_lanes().back();
  assert(lanes <= machine_lanes().back() && "lanes are one of machine_lanes()");
#ifdef CRADLE_WIDE_X86
  if (lanes == 8) return kContactKernels8;
  if (lanes == 4) return kContactKernels4;
#endif
  return lanes == 2 ? kContactKernels2 : kContactKernels1;
}

}  // namespace cradle
