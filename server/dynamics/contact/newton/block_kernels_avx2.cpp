// Products of blocks by four rows, then two: compiled for AVX2, and called only where there is
// AVX2.
#ifdef CRADLE_WIDE_X86
#include "server/dynamics/contact/newton/block_method.h"

namespace cradle {
namespace {
using Two = double __attribute__((vector_size(16)));
using Four = double __attribute__((vector_size(32)));
}  // namespace
constinit const BlockKernels kBlockKernels4 = block_kernels<Four, Two>();
}  // namespace cradle
#endif
