// Semi-implicit (symplectic) Euler.
//
// Source: Hairer, Lubich, Wanner 2006, "Geometric Numerical Integration", I.1.2; the paper does not
// have it. In our symbols, the loads at 0:
//   v1 = v + h F / m,  x1 = x + h v1,  W1 = W + h J^-1 (M - W x J W),  q1 = q exp(h W1)
// Where we differ: velocity-dependent loads are taken at 0, as engines do.
// Order: 1; in uniform gravity it is g h t / 2 too low. Stability: h omega < 2 for a spring without
// damping, h < 2 m / c for drag. Energy: symplectic, so bounded, for forces that depend on the
// position alone; in tumbling the gyroscopic term is explicit, and energy is gained as with
// explicit Euler. Cost: 1 evaluation, 85 ns.
#include "server/dynamics/rotation.h"
#include "server/dynamics/schemes/right_hand_side.h"

namespace cradle {

void semi_implicit_euler(Flight& body, const Inertia& inertia, const FlightLoads& loads, double h,
                         Work& work) {
  const Acceleration a = evaluate(body, inertia, loads, work);
  Vector w_B = body.q.conjugate() * body.w;
  body.v += h * a.linear_W;
  body.x += h * body.v;
  w_B += h * angular_acceleration(w_B, a.moment_B, inertia);
  body.q = normalised(body.q * rotation_exp(h * w_B));
  body.w = body.q * w_B;
}

}  // namespace cradle
