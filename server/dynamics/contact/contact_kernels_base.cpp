// Contacts one and two manifolds at a time, of floats sixteen: on every machine.
#include "server/dynamics/contact/contact_method.h"

namespace cradle {
namespace {
using Two = double __attribute__((vector_size(16)));
using Four = float __attribute__((vector_size(16)));
using Sixteen = Twin<Twin<Four>>;
}  // namespace
constinit const ContactKernels kContactKernels1 = contact_kernels<double, Four, double, Sixteen>();
constinit const ContactKernels kContactKernels2 = contact_kernels<Two, Four, Two, Sixteen>();
}  // namespace cradle
