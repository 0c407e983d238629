// Contacts one and two manifolds at a time, of floats four: on every machine.
#include "server/dynamics/contact/contact_method.h"

namespace cradle {
namespace {
using Two = double __attribute__((vector_size(16)));
using Four = float __attribute__((vector_size(16)));
}  // namespace
constinit const ContactKernels kContactKernels1 = contact_kernels<double, Four>();
constinit const ContactKernels kContactKernels2 = contact_kernels<Two, Four>();
}  // namespace cradle
