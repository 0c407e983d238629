// Balls beside two rows of four, with more registers (four rows at once measured slower): compiled
// for AVX-512, and called only where there is AVX-512.
#ifdef CRADLE_WIDE_X86
#include "server/dynamics/impact/ball_method.h"

namespace cradle {
constinit const BallKernels kBallKernels8 = {8, look<EightBalls>};
}  // namespace cradle
#endif
