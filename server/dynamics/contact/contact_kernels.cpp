#include "server/dynamics/contact/contact_kernels.h"

#include <algorithm>
#include <cassert>

#include "server/dynamics/free_flight.h"

namespace cradle {

const ContactKernels& contact_kernels_of(int lanes) {
  static const int most = flight_lanes().back();
  if (lanes == 0) lanes = most;
  assert(lanes <= most && "lanes are one of flight_lanes()");
#ifdef CRADLE_WIDE_X86
  if (lanes == 8) return kContactKernels8;
  if (lanes == 4) return kContactKernels4;
#endif
  return lanes == 2 ? kContactKernels2 : kContactKernels1;
}

}  // namespace cradle
