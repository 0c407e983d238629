// Two boxes, eight pairs at a time: compiled for AVX-512, and called only where there is AVX-512.
#ifdef CRADLE_WIDE_X86
#include "server/collision/box_method.h"

namespace cradle {
namespace {
using Eight = double __attribute__((vector_size(64)));
}
constinit const BoxKernels kBoxKernels8 = box_kernels<Eight>();
}  // namespace cradle
#endif
