// Free flight eight bodies at a time: compiled for AVX-512, and called only where there is that.
#ifdef CRADLE_WIDE_X86
#include "server/dynamics/flight_method.h"

namespace cradle {
namespace {
using Eight = double __attribute__((vector_size(64)));
}
constinit const FlightKernels kFlightKernels8 = kernels<Eight>();
}  // namespace cradle
#endif
