#include "server/dynamics/contact/contact_kernels.h"

#include "server/collision/machine_lanes.h"

namespace cradle {

const ContactKernels& contact_kernels_of(int lanes) {
#ifdef CRADLE_WIDE_X86
  return kernels_of_width<ContactKernels>(
      lanes, {&kContactKernels1, &kContactKernels2, &kContactKernels4, &kContactKernels8});
#else
  return kernels_of_width<ContactKernels>(lanes, {&kContactKernels1, &kContactKernels2});
#endif
}

}  // namespace cradle
