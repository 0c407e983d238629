// Contacts eight manifolds at a time, of floats sixteen: compiled for AVX-512, and called only
// where there is AVX-512.
#ifdef CRADLE_WIDE_X86
#include "server/dynamics/contact/contact_method.h"

namespace cradle {
namespace {
using Eight = double __attribute__((vector_size(64)));
using Sixteen = float __attribute__((vector_size(64)));
}  // namespace
constinit const ContactKernels kContactKernels8 = contact_kernels<Eight, Sixteen>();
}  // namespace cradle
#endif
