// Free flight, "T8M6", for the kernels' files alone (see lanes.h).
//
// Translation: x += dt v + dt^2/2 a, v += dt a: exact for constant a.
//
// Rotation: Euler's equations J w' + w x J w = tau in P, the principal axes, by their Taylor series
// to order 8, and the attitude q' = q w / 2 by the sixth-order Magnus step on that series.
//   W_k = h^(k+1) w^(k)(0) / k!, so that h w(s h) = sum W_k s^k for s in [0, 1]; W_0 = h w.
//   W_(k+1) = ( c sum_j (W_j,y W_(k-j),z, W_j,z W_(k-j),x, W_j,x W_(k-j),y) + J^-1 T_k ) / (k+1),
//   c = ((Jy - Jz)/Jx, (Jz - Jx)/Jy, (Jx - Jy)/Jz)                     (Euler's equations)
//   T_k: the same series of h^2 tau seen from the turning body, T_(k+1) = sum_j T_j x W_(k-j) /
//   (k+1); a torque that turns with the body adds to T_0 where W_1 is made, and nowhere else.
//   a1, a2, a3: moments of the series about the middle of the step; then Omega as in Blanes, Casas,
//   Ros (2000), "Improved high order integrators based on the Magnus expansion", BIT 40, eq. 3.11,
//   with the bracket [a, b] = -a x b of right multiplication. q+ = q exp(Omega)
// In a planar world (z = 0, turns about z): x and y alone, and the angle in closed form,
//   angle = h w + h^2 tau / (2 J),  w += h tau / J
// which turns q by the sine and cosine of its half, less whole multiples of pi: q and -q are the
// same attitude. One step at any speed; what it leaves is rounding. 4.4 ns a body with 8 lanes, 19
// with 1. Steps: as many a tick as h |w| asks (free_flight.cpp), each body by itself; a block of
// lanes goes on until its slowest is done, and those that are done stay as they are. Order 6.
// Energy and angular momentum hold to 1e-13 over a minute of tumbling at h |w| = 0.08, and to 1e-8
// up to h |w| = 2. No projection: it would hide the error in the attitude. Cost, one step a tick:
// 640 operations. What limits a block is not their number but how long each waits for the one
// before (profiled: more than half of the cycles the floating point scheduler is full), hence sums
// and polynomials that join early what is known early, q made unit before it is turned, and a test
// of the limits that is one comparison. On a Zen 5: 11 ns a body with 8 lanes, 20 with 4, 38 with
// 2, 75 with 1.
#pragma once

#include "server/collision/lanes.h"
#include "server/dynamics/body_columns.h"
#include "server/dynamics/flight_kernel.h"

namespace cradle {
namespace {

constexpr int kOrder = 8;

/// Weights of W_k in a1, a2, a3, from the moments A_m = integral of (s - 1/2)^m s^k over [0, 1].
struct MagnusWeights {
  double a1[kOrder + 1], a2[kOrder + 1], a3[kOrder + 1];
};
constexpr MagnusWeights magnus_weights() {
  MagnusWeights weights{};
  for (int k = 0; k <= kOrder; ++k) {
    const double A0 = 1.0 / (k + 1);
    const double A1 = 1.0 / (k + 2) - 1.0 / (2 * (k + 1));
    const double A2 = 1.0 / (k + 3) - 1.0 / (k + 2) + 1.0 / (4 * (k + 1));
    weights.a1[k] = 9.0 / 4 * A0 - 15 * A2;
    weights.a2[k] = 12 * A1;
    weights.a3[k] = 180 * A2 - 15 * A0;
  }
  return weights;
}
constexpr MagnusWeights kMagnus = magnus_weights();

// Quaternions.

template <class V>
CRADLE_LANES Quadruple<V> multiply(const Quadruple<V>& a, const Quadruple<V>& b) {
  return {
      a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z,
      a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

template <class V>
CRADLE_LANES V square(const Triple<V>& a) {
  return dot(a, a);
}
template <class V>
CRADLE_LANES V square(const Quadruple<V>& q) {
  return (q.x * q.x + q.y * q.y) + (q.z * q.z + q.w * q.w);
}

template <class V>
CRADLE_LANES V off_unit(const Quadruple<V>& q) {
  return square(q) - 1.0;
}

/// One Newton step for 1 / |q|: q stays within 1e-15 of unit length, without a root. Done before q
/// is turned, while the turn is not known yet.
template <class V>
CRADLE_LANES Quadruple<V> renormalised(const Quadruple<V>& q) {
  const V scale = 1.5 - 0.5 * square(q);
  return {scale * q.x, scale * q.y, scale * q.z, scale * q.w};
}

/// From P to W, and from W to P.
template <class V>
CRADLE_LANES Triple<V> rotate(const Quadruple<V>& q, const Triple<V>& a) {
  const Triple<V> u{q.x, q.y, q.z};
  const Triple<V> t = 2.0 * cross(u, a);
  return (a + q.w * t) + cross(u, t);
}
template <class V>
CRADLE_LANES Triple<V> rotate_back(const Quadruple<V>& q, const Triple<V>& a) {
  const Triple<V> u{q.x, q.y, q.z};
  const Triple<V> t = 2.0 * cross(u, a);
  return (a - q.w * t) + cross(u, t);
}

/// exp(r/2) = (cos(|r|/2), sin(|r|/2) r/|r|) for |r| <= 0.2, truncated below 3e-17.
template <class V>
CRADLE_LANES Quadruple<V> small_exp(const Triple<V>& r) {
  const V p = 0.25 * dot(r, r);
  const V pp = p * p;
  const V cosine = (1.0 - 0.5 * p) + pp * ((1.0 / 24 - (1.0 / 720) * p) + (1.0 / 40320) * pp);
  const V half_sinc =
      (0.5 - (1.0 / 12) * p) + pp * ((1.0 / 240 - (1.0 / 10080) * p) + (1.0 / 725760) * pp);
  return {half_sinc * r.x, half_sinc * r.y, half_sinc * r.z, cosine};
}

/// exp(r/2) for any r: halved until it is small, and squared as often.
template <class V>
CRADLE_LANES Quadruple<V> any_exp(Triple<V> r) {
  V halvings{};
  for (auto large = dot(r, r) > 0.04; any<V>(large); large = dot(r, r) > 0.04) {
    r = select(large, 0.5 * r, r);
    halvings = large ? halvings + 1.0 : halvings;
  }
  Quadruple<V> q = small_exp(r);
  const auto is_halved = halvings > 0.0;
  for (auto left = is_halved; any<V>(left); left = halvings > 0.0) {
    q = select(left, multiply(q, q), q);
    halvings = halvings - 1.0;
  }
  return select(is_halved, renormalised(q), q);  // each square doubled what it was off
}

// Turning.

/// What turns a body, in P and scaled by the step: h^2 J^-1 and the torques.
template <class V>
struct Twist {
  Triple<V> inverse_J;
  Triple<V> T0;      // h^2 tau of the torque that is constant in W
  Triple<V> T_body;  // of the one that is constant in P
};

/// W_j,y W_(k-j),z and so on: the products of Euler's equations.
template <class V>
CRADLE_LANES Triple<V> crosswise(const Triple<V>& a, const Triple<V>& b) {
  return {a.y * b.z, a.z * b.x, a.x * b.y};
}

/// Sum over j = 0 .. k of f(j), outwards from the middle: what is known last is added last, since
/// waiting for it is what a step costs.
template <int k, class F>
CRADLE_LANES auto outward_sum(F&& f) {
  auto sum = k % 2 == 0 ? f(k / 2) : f(k / 2) + f(k - k / 2);
#pragma GCC unroll 8
  for (int j = (k + 1) / 2 - 1; j >= 0; --j) {
    if (k % 2 == 0 || j != k / 2) sum = sum + (f(j) + f(k - j));
  }
  return sum;
}

/// What of the equations is there: torque, and the gyroscopic term, which equal moments have not.
template <bool torque, bool gyroscopic>
struct Terms {
  static constexpr bool has_torque = torque, has_gyroscopic = gyroscopic;
};

/// W_(k+1), and with torque T_(k+1), from those before.
template <class terms, int k, class V>
CRADLE_LANES void next_term(Triple<V> (&W)[kOrder + 1], Triple<V> (&T)[kOrder + 1],
                            const Triple<V>& c, const Twist<V>& twist) {
  constexpr double scale = 1.0 / (k + 1);
  if constexpr (terms::has_gyroscopic) {
    W[k + 1] = (scale * c) *
               outward_sum<k>([&](int j) CRADLE_LAMBDA { return crosswise(W[j], W[k - j]); });
  }
  if constexpr (terms::has_torque) {
    const Triple<V> moment = k == 0 ? T[0] + twist.T_body : T[k];
    const Triple<V> pushed = (scale * twist.inverse_J) * moment;
    W[k + 1] = terms::has_gyroscopic ? W[k + 1] + pushed : pushed;
    T[k + 1] = scale * outward_sum<k>([&](int j) CRADLE_LAMBDA { return cross(T[j], W[k - j]); });
  }
}

/// W_1 .. W_8 from W_0.
template <class terms, class V, int... k>
CRADLE_LANES void euler_series(Triple<V> (&W)[kOrder + 1], const Triple<V>& c,
                               const Twist<V>& twist, std::integer_sequence<int, k...>) {
  Triple<V> T[kOrder + 1];
  if constexpr (terms::has_torque) T[0] = twist.T0;
  (next_term<terms, k>(W, T, c, twist), ...);
}

/// The rotation vector of the whole step, in P at its start.
template <class V>
CRADLE_LANES Triple<V> magnus_step(const Triple<V> (&W)[kOrder + 1]) {
  Triple<V> a1 = kMagnus.a1[0] * W[0] + kMagnus.a1[1] * W[1];
  Triple<V> a2 = kMagnus.a2[1] * W[1] + kMagnus.a2[2] * W[2];
  Triple<V> a3 = kMagnus.a3[2] * W[2] + kMagnus.a3[3] * W[3];
#pragma GCC unroll 8
  for (int k = 2; k <= kOrder; ++k) a1 = a1 + kMagnus.a1[k] * W[k];
#pragma GCC unroll 8
  for (int k = 3; k <= kOrder; ++k) a2 = a2 + kMagnus.a2[k] * W[k];
#pragma GCC unroll 8
  for (int k = 4; k <= kOrder; ++k) a3 = a3 + kMagnus.a3[k] * W[k];
  const Triple<V> C1 = cross(a2, a1);
  const Triple<V> C2 = cross((1.0 / 60) * a1, 2.0 * a3 + C1);
  const Triple<V> C3 = (1.0 / 240) * (C1 - (20.0 * a1 + a3));
  return (a1 + (1.0 / 12) * a3) + cross(a2 + C2, C3);
}

enum class Turning { none, steady, tumbling, tumbling_fast, twisted, twisted_round, planar };

/// hw, the step times the angular velocity in P, and the attitude through one step.
template <class terms, class V>
CRADLE_LANES void step(const Triple<V>& c, const Twist<V>& twist, Quadruple<V>& q, Triple<V>& hw) {
  Triple<V> W[kOrder + 1];
  W[0] = hw;
  euler_series<terms>(W, c, twist, std::make_integer_sequence<int, kOrder>{});
  q = multiply(renormalised(q), small_exp(magnus_step(W)));
  hw = W[kOrder];
#pragma GCC unroll 8
  for (int k = kOrder - 1; k >= 0; --k) hw = hw + W[k];
}

/// Attitude and angular velocity (W) of a block through the tick.
template <Turning turning, class V, class Block>
CRADLE_LANES void turn(const FlightPointers& bodies, const Block& block, const double* steps_of,
                       Quadruple<V>& q, Triple<V>& w) {
  if constexpr (turning == Turning::steady) {
    q = multiply(any_exp(bodies.dt * w), renormalised(q));
    return;
  }
  constexpr bool is_round = turning == Turning::twisted_round;
  constexpr bool has_torque = turning == Turning::twisted || is_round;
  using terms = Terms<has_torque, !is_round>;
  const Triple<V> J = load3<V>(bodies.inertia, block);
  const Triple<V> c{(J.y - J.z) / J.x, (J.z - J.x) / J.y, (J.x - J.y) / J.z};
  Twist<V> twist;
  if constexpr (turning == Turning::tumbling) {
    Triple<V> hw = bodies.dt * rotate_back(q, w);
    step<terms>(c, twist, q, hw);
    w = rotate(q, (1 / bodies.dt) * hw);
    return;
  }

  const V steps = load<V>(steps_of);
  const V h = bodies.dt / steps;
  Triple<V> torque_W;
  if constexpr (has_torque) {
    twist.inverse_J = load3<V>(bodies.inverse_inertia, block);
    twist.T_body = (h * h) * load3<V>(bodies.torque_P, block);
    torque_W = (h * h) * load3<V>(bodies.torque_W, block);
  }
  Triple<V> hw = h * rotate_back(q, w);
  V done{};
  for (auto left = done < steps; any<V>(left); left = done < steps) {
    if constexpr (has_torque) twist.T0 = rotate_back(q, torque_W);
    Quadruple<V> q_next = q;
    Triple<V> hw_next = hw;
    step<terms>(c, twist, q_next, hw_next);
    q = select(left, q_next, q);
    hw = select(left, hw_next, hw);
    done = done + 1.0;
  }
  w = rotate(q, (steps / bodies.dt) * hw);
}

// In the plane.

/// Sum of c_k p^k, k < n, even and odd powers side by side.
template <class V, std::size_t n>
CRADLE_LANES V polynomial(const double (&c)[n], const V& p) {
  static_assert(n % 2 == 0);
  const V pp = p * p;
  V even = fill<V>(c[n - 2]), odd = fill<V>(c[n - 1]);
#pragma GCC unroll 8
  for (std::size_t k = n - 2; k >= 2; k -= 2) {
    even = c[k - 2] + pp * even;
    odd = c[k - 1] + pp * odd;
  }
  return even + p * odd;
}

/// (-1)^k / (2k + first)!, the series of the sine of r over r and of the cosine, in r^2.
struct CircleSeries {
  double sine[12], cosine[12];
};
constexpr CircleSeries circle_series() {
  CircleSeries series{};
  double factorial = 1;
  for (int k = 0; k < 12; ++k) {
    const double sign = k % 2 == 0 ? 1 : -1;
    series.cosine[k] = sign / factorial;
    series.sine[k] = sign / (factorial * (2 * k + 1));
    factorial *= (2 * k + 1) * (2 * k + 2);
  }
  return series;
}
constexpr CircleSeries kCircle = circle_series();

/// (cos a, sin a) or (-cos a, -sin a) as (w, z) of a quaternion, for |a| <= 1e6.
template <class V>
CRADLE_LANES Quadruple<V> half_turn(const V& a) {
  constexpr double kPi_1 = 0x1.921fb544p+1, kPi_2 = 0x1.0b4611a4p-33, kPi_3 = 0x1.13198a2e03707p-64;
  constexpr double kRound = 0x1.8p+52;  // adding it leaves no fraction
  const V turns = (a * 0.3183098861837907 + kRound) - kRound;
  const V r = ((a - turns * kPi_1) - turns * kPi_2) - turns * kPi_3;
  const V p = r * r;
  return {V{}, V{}, r * polynomial(kCircle.sine, p), polynomial(kCircle.cosine, p)};
}

/// Attitude and angular velocity about z through the tick; `falls`: without torque.
template <class V, class Block>
CRADLE_LANES void turn_in_plane(const FlightPointers& bodies, const Block& block, bool falls,
                                Quadruple<V>& q, Triple<V>& w) {
  V half_angle = (0.5 * bodies.dt) * w.z;
  if (!falls) {
    const V torque = load3<V>(bodies.torque_W, block).z + load3<V>(bodies.torque_P, block).z;
    const V change = bodies.dt * (load3<V>(bodies.inverse_inertia, block).z * torque);
    half_angle = half_angle + (0.25 * bodies.dt) * change;
    w.z = w.z + change;
  }
  const Quadruple<V> turn = half_turn(half_angle);
  const Quadruple<V> unit = renormalised(Quadruple<V>{V{}, V{}, q.z, q.w});
  q = {V{}, V{}, unit.z * turn.w + unit.w * turn.z, unit.w * turn.w - unit.z * turn.z};
  w.x = w.y = V{};
}

// A block, a list.

template <class V>
CRADLE_LANES auto is_within(const Triple<V>& a, double limit) {
  return (a.x <= limit) & (a.x >= -limit) & (a.y <= limit) & (a.y >= -limit) & (a.z <= limit) &
         (a.z >= -limit);
}

/// By how much |q|^2 may differ from 1. More is not rounding: the steps were too long for the
/// spin (kFlightStepsMax). Test: "a spin that cannot be followed ends in quarantine and in no false
/// attitude".
constexpr double kNotUnit = 2e-9;

/// Bodies whose new numbers are not usable stay where they are, and are marked.
template <class V, class Block>
[[gnu::noinline, gnu::cold]] void keep_lost(const FlightPointers& bodies, const Block& block,
                                            Triple<V>& x, const Triple<V>& v, Quadruple<V>& q,
                                            const Triple<V>& w) {
  const auto is_usable = is_within(x, bodies.position_max) & is_within(v, bodies.speed_max) &
                         is_within(w, bodies.angular_speed_max) & (off_unit(q) <= kNotUnit) &
                         (off_unit(q) >= -kNotUnit);
  x = select(is_usable, x, load3<V>(bodies.x, block));
  q = select(is_usable, q, load4<V>(bodies.q, block));
  for (int l = 0; l < kLanes<V>; ++l) {
    if (lane(is_usable, l) == 0) bodies.lost[block.slot(l)] = 1;
  }
}

template <Turning turning, class V, class Block>
CRADLE_LANES void fly_block(const FlightPointers& bodies, const Block& block, const double* steps,
                            bool falls) {
  // Below 1 for everything that is within its limits, far from them: the exact test is rare.
  V largest{};
  const auto watch = [&](const auto& a, double limit)
                         CRADLE_LAMBDA { largest = largest + (1 / (limit * limit)) * square(a); };
  Quadruple<V> q;
  Triple<V> w;
  if constexpr (turning != Turning::none) {
    q = load4<V>(bodies.q, block);
    w = load3<V>(bodies.w, block);
    if constexpr (turning == Turning::planar) {
      turn_in_plane(bodies, block, falls, q, w);
    } else {
      turn<turning>(bodies, block, steps, q, w);
    }
    watch(w, bodies.angular_speed_max);
    const V off = (1 / kNotUnit) * off_unit(q);
    largest = largest + off * off;
  }
  const Triple<V> gravity{fill<V>(bodies.gravity_W[0]), fill<V>(bodies.gravity_W[1]),
                          fill<V>(bodies.gravity_W[2])};
  const Triple<V> a = falls ? gravity : load3<V>(bodies.acceleration, block);
  Triple<V> x = load3<V>(bodies.x, block);
  Triple<V> v = load3<V>(bodies.v, block);
  x = x + bodies.dt * v + (0.5 * bodies.dt * bodies.dt) * a;
  v = v + bodies.dt * a;
  if constexpr (turning == Turning::planar) x.z = v.z = V{};
  watch(x, bodies.position_max);
  watch(v, bodies.speed_max);
  if (!all<V>(largest < 0.9)) [[unlikely]] {
    if constexpr (turning == Turning::none) {
      q = load4<V>(bodies.q, block);
      w = load3<V>(bodies.w, block);
    }
    keep_lost(bodies, block, x, v, q, w);
  }
  store3(bodies.x, block, x);
  store3(bodies.v, block, v);
  if constexpr (turning != Turning::none) {
    store4(bodies.q, block, q);
    store3(bodies.w, block, w);
  }
}

template <Turning turning, class V>
void fly_list(const FlightPointers& bodies, const FlightList& list) {
  static_assert(kFlightLanesMax % kLanes<V> == 0);
  for (int i = 0; i < list.count; i += kLanes<V>) {
    const std::int32_t* slots = list.slots + i;
    if constexpr (kLanes < V >> 1) {
      if (are_in_a_row<V>(slots)) {
        fly_block<turning, V>(bodies, Row{slots[0]}, list.steps + i, list.falls);
        continue;
      }
    }
    fly_block<turning, V>(bodies, Scattered{slots}, list.steps + i, list.falls);
  }
}

/// The common cases without a list: neighbours of which none turns, or all tumble, one step each.
/// What counts are the same comparisons as in free_flight.cpp, lane by lane.
template <class V>
bool free_row(const FlightPointers& bodies, std::int32_t first, double step_angle) {
  if constexpr (kLanes<V> == 1) {
    return false;
  } else {
    const Row row{first};
    const Triple<V> w = load3<V>(bodies.w, row);
    const V speed2 = dot(w, w);
    if (all<V>(speed2 == 0.0)) {
      fly_block<Turning::none, V>(bodies, row, nullptr, true);
      return true;
    }
    const Triple<V> J = load3<V>(bodies.inertia, row);
    const auto is_slow =
        (speed2 > 0.0) & (speed2 * (bodies.dt * bodies.dt) <= step_angle * step_angle);
    const auto is_round = (J.x == J.y) & (J.y == J.z);
    if (!all<V>(is_slow & (is_round == 0))) return false;
    fly_block<Turning::tumbling, V>(bodies, row, nullptr, true);
    return true;
  }
}

/// The common case of a planar world, likewise.
template <class V>
bool planar_row(const FlightPointers& bodies, std::int32_t first) {
  if constexpr (kLanes<V> == 1) {
    return false;
  } else {
    const Row row{first};
    const V w_z = load3<V>(bodies.w, row).z;
    const Quadruple<V> q = load4<V>(bodies.q, row);
    if (!all<V>((w_z != 0.0) & (q.x == 0.0) & (q.y == 0.0))) return false;
    fly_block<Turning::planar, V>(bodies, row, nullptr, true);
    return true;
  }
}

template <class V>
constexpr FlightKernels kernels() {
  return {kLanes<V>,
          free_row<V>,
          planar_row<V>,
          fly_list<Turning::none, V>,
          fly_list<Turning::steady, V>,
          fly_list<Turning::tumbling, V>,
          fly_list<Turning::tumbling_fast, V>,
          fly_list<Turning::twisted, V>,
          fly_list<Turning::twisted_round, V>,
          fly_list<Turning::planar, V>};
}

}  // namespace
}  // namespace cradle
