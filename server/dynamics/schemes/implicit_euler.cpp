// Implicit Euler.
//
// Source: Rueth, "Rigid Body Physics", II.C.2. In our symbols, all of the right at 1:
//   x1 = x + h v1,  v1 = v + h F1 / m,  q1 = q exp(h W1),  W1 = W + h J^-1 (M1 - W1 x J W1)
// Where we differ: the paper prints a formula; it is a system of equations for (v1, W1), which is
// solved by Newton's method until its residual no longer falls, gyroscopic part, drag and springs
// included. (One Newton step, as engines take for the gyroscopic part, is another method.)
// Order: 1. Stability: at every h (L-stable). Energy: lost: an oscillator shrinks by
// 1 / sqrt(1 + (h omega)^2) a step, tumbling comes to turn about its axis of largest moment.
// Cost: about 30 evaluations, 4200 ns.
#include "server/dynamics/rotation.h"
#include "server/dynamics/schemes/right_hand_side.h"

namespace cradle {

void implicit_euler(Flight& body, const Inertia& inertia, const FlightLoads& loads, double h,
                    Work& work) {
  const Flight start = body;
  const Vector w0_B = start.q.conjugate() * start.w;
  const auto end_of = [&](const Vector6& u) {
    Flight end;
    end.v = u.head<3>();
    end.x = start.x + h * end.v;
    end.q = normalised(start.q * rotation_exp(h * u.tail<3>()));
    end.w = end.q * u.tail<3>();
    return end;
  };
  const auto residual = [&](const Vector6& u) {
    const Acceleration a = evaluate(end_of(u), inertia, loads, work);
    Vector6 r;
    r.head<3>() = u.head<3>() - start.v - h * a.linear_W;
    r.tail<3>() = u.tail<3>() - w0_B - h * angular_acceleration(u.tail<3>(), a.moment_B, inertia);
    return r;
  };
  Vector6 u;
  u << start.v, w0_B;
  body = end_of(solve(u, residual));
}

}  // namespace cradle
