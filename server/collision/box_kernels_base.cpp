// Two boxes, one and two pairs at a time: on every machine.
#include "server/collision/box_method.h"

namespace cradle {
namespace {
using Two = double __attribute__((vector_size(16)));
}
constinit const BoxKernels kBoxKernels1 = box_kernels<double>();
constinit const BoxKernels kBoxKernels2 = box_kernels<Two>();
}  // namespace cradle
