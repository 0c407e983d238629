// Balls beside a row of four: on every machine.
#include "server/dynamics/impact/ball_method.h"

namespace cradle {
constinit const BallKernels kBallKernels1 = {1, look<FourBalls>};
constinit const BallKernels kBallKernels2 = {2, look<FourBalls>};
}  // namespace cradle
