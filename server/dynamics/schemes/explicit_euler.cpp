// Explicit Euler.
//
// Source: Rueth, "Rigid Body Physics", II.C.1; Euler 1768. In our symbols, all of the right at 0:
//   x1 = x + h v,  v1 = v + h F / m,  q1 = q exp(h W),  W1 = W + h J^-1 (M - W x J W)
// Where we differ: the paper has an angle vector phi' = w, which does not exist (rotations do not
// commute), and J w' = T without the gyroscopic term W x J W; here the attitude is a quaternion
// that turns by the exponential of h W, and the term is there.
// Order: 1. Stability: an undamped oscillator grows by sqrt(1 + (h omega)^2) a step, at every h;
// drag c needs h c / m < 2, and h c / m < 1 not to swing.
// Energy: gained, in translation and in tumbling. Cost: 1 evaluation, 75 ns.
#include "server/dynamics/rotation.h"
#include "server/dynamics/schemes/right_hand_side.h"

namespace cradle {

void explicit_euler(Flight& body, const Inertia& inertia, const FlightLoads& loads, double h,
                    Work& work) {
  const Acceleration a = evaluate(body, inertia, loads, work);
  const Vector w_B = body.q.conjugate() * body.w;
  body.x += h * body.v;
  body.v += h * a.linear_W;
  body.q = normalised(body.q * rotation_exp(h * w_B));
  body.w = body.q * (w_B + h * angular_acceleration(w_B, a.moment_B, inertia));
}

}  // namespace cradle
