// Products of blocks by one row and two rows at a time: on every machine.
#include "server/dynamics/contact/newton/block_method.h"

namespace cradle {
namespace {
using Two = double __attribute__((vector_size(16)));
}
constinit const BlockKernels kBlockKernels1 = block_kernels<double>();
constinit const BlockKernels kBlockKernels2 = block_kernels<Two>();
}  // namespace cradle
