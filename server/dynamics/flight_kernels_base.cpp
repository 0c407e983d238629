// Free flight one and two bodies at a time: on every machine.
#include "server/dynamics/flight_method.h"

namespace cradle {
namespace {
using Two = double __attribute__((vector_size(16)));
}
constinit const FlightKernels kFlightKernels1 = kernels<double>();
constinit const FlightKernels kFlightKernels2 = kernels<Two>();
}  // namespace cradle
