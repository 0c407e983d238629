// Two boxes, four pairs at a time: compiled for AVX2, and called only where there is AVX2.
#ifdef CRADLE_WIDE_X86
#include "server/collision/box_method.h"

namespace cradle {
namespace {
using Four = double __attribute__((vector_size(32)));
}
constinit const BoxKernels kBoxKernels4 = box_kernels<Four>();
}  // namespace cradle
#endif
