// Balls beside a row of four: on every machine.
#include "server/dynamics/impact/ball_method.h"

namespace cradle {
constinit const BallKernels kBallKernels1 = {1, look_along_row<FourBalls>};
constinit const BallKernels kBallKernels2 = {2, look_along_row<FourBalls>};
}  // namespace cradle
