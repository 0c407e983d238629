// Balls beside two rows of four: compiled for AVX2, and called only where there is AVX2.
#ifdef CRADLE_WIDE_X86
#include "server/dynamics/impact/ball_method.h"

namespace cradle {
constinit const BallKernels kBallKernels4 = {4, look<EightBalls>};
}  // namespace cradle
#endif
