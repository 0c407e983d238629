// Contacts four manifolds at a time, of floats eight: compiled for AVX2, and called only where
// there is AVX2.
#ifdef CRADLE_WIDE_X86
#include "server/dynamics/contact/contact_method.h"

namespace cradle {
namespace {
using Four = double __attribute__((vector_size(32)));
using Eight = float __attribute__((vector_size(32)));
}  // namespace
constinit const ContactKernels kContactKernels4 = contact_kernels<Four, Eight>();
}  // namespace cradle
#endif
