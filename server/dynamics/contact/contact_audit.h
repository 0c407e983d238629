// What became of a manifold's impulses, for the kernels' files alone: equations in
// contact_balance.h, symbols in contact_method.h. Order of the sums: block by block in each of the
// block's lanes, so that they are the same at every width.
#pragma once

#include "server/dynamics/contact/contact_twist.h"

namespace cradle {
namespace {

template <class V>
CRADLE_LANES void add_to(RowOf<V>& row, int lane, const V& value) {
  store(row + lane, at<V>(row, lane) + value);
}
template <class V>
CRADLE_LANES void raise(RowOf<V>& row, int lane, const V& value) {
  store(row + lane, larger<V>(at<V>(row, lane), value));
}

/// By the velocities at the tick's end.
template <class V, int points>
CRADLE_LANES void judge_lanes(const BlockOf<V>& c, int lane, const SubStep& step,
                              const BodyLine* velocities, ContactTally<NumberOf<V>>& tally) {
  const Frame<V> f = frame_at<V>(c, lane);
  const Bodies<V, Round<V>> bodies = bodies_at<V, Round<V>>(c, lane, velocities);
  const auto [Vn, V1, V2, Wn, W1, W2] = twist_of(f, bodies);
  const V haste = fill<V>(step.rate) * at<V>(c.gap_haste, lane), friction = at<V>(c.friction, lane);
  const V share = 1 / (1 + friction * friction);
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const V u = at<V>(point.u, lane), v = at<V>(point.v, lane), yields = at<V>(point.yields, lane);
    const auto is_there = yields > V{};
    const V K = select(is_there, 1 / yields, V{});
    const V vn = Vn + v * W1 - u * W2, u1 = V1 - v * Wn, u2 = V2 + u * Wn;
    const V un = vn + larger<V>(at<V>(point.s, lane), V{}) * haste;
    const V pn = K * at<V>(point.lambda, lane);
    const V p1 = K * at<V>(point.lambda_1, lane), p2 = K * at<V>(point.lambda_2, lane);
    const V un_cone = un + friction * root<V>(u1 * u1 + u2 * u2);

    const V zn = pn - un_cone, z1 = p1 - u1, z2 = p2 - u2, t = root<V>(z1 * z1 + z2 * z2);
    const V n = (zn + friction * t) * share, pull = select(t > V{}, friction * n / t, V{});
    const auto is_inside = t <= friction * zn, is_apart = friction * t <= -zn;
    const V cn = select(is_inside, zn, select(is_apart, V{}, n));
    const V c1 = select(is_inside, z1, select(is_apart, V{}, pull * z1));
    const V c2 = select(is_inside, z2, select(is_apart, V{}, pull * z2));
    const V dn = pn - cn, d1 = p1 - c1, d2 = p2 - c2;
    const V natural2 = select(is_there, dn * dn + d1 * d1 + d2 * d2, V{});
    const V least = smaller<V>(pn, un), beyond = root<V>(p1 * p1 + p2 * p2) - friction * pn;
    const V product = yields * (pn * un_cone + p1 * u1 + p2 * u2);

    raise(tally.natural2, lane, natural2);
    raise(tally.signorini, lane, select(is_there, larger<V>(least, -least), V{}));
    raise(tally.cone, lane, select(is_there, beyond, V{}));
    raise(tally.complementarity, lane, larger<V>(product, -product));
    add_to(tally.natural2_sum, lane, natural2);
    add_to(tally.impulse2_sum, lane, pn * pn + p1 * p1 + p2 * p2);
    add_to(tally.velocity2_sum, lane, select(is_there, un * un + u1 * u1 + u2 * u2, V{}));
  }
}

/// By the mean velocities of a sub-step.
template <class V, int points>
CRADLE_LANES void work_lanes(const BlockOf<V>& c, int lane, const BodyLine* means,
                             ContactWork<NumberOf<V>>& work) {
  const Frame<V> f = frame_at<V>(c, lane);
  const Twist<V> A = load_lines<V>(means, c.a + lane), B = load_lines<V>(means, c.b + lane);
  const Triple<V> VA = A.linear + cross(A.angular, at3<V>(c.arm_A, lane));
  const Triple<V> VB = B.linear + cross(B.angular, at3<V>(c.arm_B, lane));
  V Pn{}, P1{}, P2{}, Tn{}, T1{}, T2{};
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const V u = at<V>(point.u, lane), v = at<V>(point.v, lane), l = at<V>(point.lambda, lane);
    const V f1 = at<V>(point.lambda_1, lane), f2 = at<V>(point.lambda_2, lane);
    Pn = Pn + l;
    T1 = T1 + v * l;
    T2 = T2 - u * l;
    P1 = P1 + f1;
    P2 = P2 + f2;
    Tn = Tn + (u * f2 - v * f1);
  }
  const Triple<V> N = Pn * f.n, M = T1 * f.t1 + T2 * f.t2;  // along n, and its twist
  const Triple<V> F = P1 * f.t1 + P2 * f.t2, R = Tn * f.n;
  const V normal = dot(N, VB - VA) + dot(M, B.angular - A.angular);
  const V friction = dot(F, VB - VA) + dot(R, B.angular - A.angular);
  // On a body that yields, by one that does not: what it did beyond the above.
  const V by_A = select(A.inverse_mass > V{}, V{}, fill<V>(1));
  const V by_B = select(B.inverse_mass > V{}, V{}, fill<V>(1));
  const Triple<V> P = N + F, T = M + R;
  const V driven =
      by_A * (dot(P, VA) + dot(T, A.angular)) - by_B * (dot(P, VB) + dot(T, B.angular));
  add_to(work.friction, lane, friction);
  add_to(work.normal, lane, normal);
  add_to(work.driven, lane, driven);
  add_to(work.momentum[0], lane, (by_A - by_B) * P.x);
  add_to(work.momentum[1], lane, (by_A - by_B) * P.y);
  add_to(work.momentum[2], lane, (by_A - by_B) * P.z);
}

}  // namespace
}  // namespace cradle
