// The masses that the impulses of a manifold meet, for the kernels' files alone. Equations and
// symbols: contact_method.h.
#pragma once

#include <type_traits>

#include "server/dynamics/contact/manifold_lanes.h"

namespace cradle {
namespace {

/// Of a symmetric matrix, by its upper triangle: 00 01 11, or 00 01 02 03 11 12 13 22 23 33.
template <class V>
struct Inverse2 {
  V xx, xy, yy;
};
template <class V>
CRADLE_LANES Inverse2<V> inverse(const V& xx, const V& xy, const V& yy) {
  const V d = 1 / (xx * yy - xy * xy);
  return {yy * d, -xy * d, xx * d};
}
template <class V>
CRADLE_LANES void invert_into(RowOf<V>* to, int lane, const V* K, const V* diagonal,
                              std::integral_constant<int, 2>) {
  const Inverse2<V> m = inverse<V>(diagonal[0], K[0], diagonal[1]);
  store(to[0] + lane, m.xx);
  store(to[1] + lane, m.xy);
  store(to[2] + lane, m.yy);
}
/// [A B; B^T D] by the inverse of A and of D - B^T A^-1 B.
template <class V>
CRADLE_LANES void invert_into(RowOf<V>* to, int lane, const V* K, const V* diagonal,
                              std::integral_constant<int, 4>) {
  const V b00 = K[1], b01 = K[2], b10 = K[3], b11 = K[4];
  const Inverse2<V> A = inverse<V>(diagonal[0], K[0], diagonal[1]);
  const V e00 = A.xx * b00 + A.xy * b10, e01 = A.xx * b01 + A.xy * b11;
  const V e10 = A.xy * b00 + A.yy * b10, e11 = A.xy * b01 + A.yy * b11;
  const Inverse2<V> S =
      inverse<V>(diagonal[2] - (b00 * e00 + b10 * e10), K[5] - (b00 * e01 + b10 * e11),
                 diagonal[3] - (b01 * e01 + b11 * e11));
  const V f00 = e00 * S.xx + e01 * S.xy, f01 = e00 * S.xy + e01 * S.yy;
  const V f10 = e10 * S.xx + e11 * S.xy, f11 = e10 * S.xy + e11 * S.yy;
  store(to[0] + lane, A.xx + f00 * e00 + f01 * e01);
  store(to[1] + lane, A.xy + f00 * e10 + f01 * e11);
  store(to[2] + lane, -f00);
  store(to[3] + lane, -f01);
  store(to[4] + lane, A.yy + f10 * e10 + f11 * e11);
  store(to[5] + lane, -f10);
  store(to[6] + lane, -f11);
  store(to[7] + lane, S.xx);
  store(to[8] + lane, S.xy);
  store(to[9] + lane, S.yy);
}

/// Which element joins points i <= j.
template <int points>
constexpr int joined(int i, int j) {
  return points == 2 ? i + j : i == 0 ? j : i == 1 ? j + 3 : i == 2 ? j + 5 : 9;
}

/// The matrices of joint solving; after `yields` and `coupling`.
template <class V, int points>
CRADLE_LANES void invert(BlockOf<V>& c, int lane, const V* is_there, const Softness& softness) {
  const V mass_scale = fill<V>(softness.mass_scale);
  const V impulse_scale = fill<V>(softness.impulse_scale);
  V K[6], own[points], soft[points], hard[points], sum{}, number{};
  CRADLE_UNROLLED
  for (int i = 0; i < points * (points - 1) / 2; ++i) K[i] = at<V>(c.coupling[i], lane);
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    const V yields = at<V>(c.points[i].yields, lane);
    own[i] = select(is_there[i] > V{}, 1 / yields, V{});
    sum = sum + own[i];
    number = number + is_there[i];
  }
  const V eps = fill<V>(1e-6) * sum / larger<V>(number, fill<V>(1));
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    hard[i] = select(is_there[i] > V{}, own[i] + eps, fill<V>(1));
    soft[i] = hard[i] + impulse_scale / mass_scale * own[i];
  }
  constexpr std::integral_constant<int, points> size{};
  invert_into<V>(c.inverse_soft, lane, K, soft, size);
  invert_into<V>(c.inverse_hard, lane, K, hard, size);
}

/// After `response_t`.
template <class V, int points>
CRADLE_LANES void invert_t(BlockOf<V>& c, int lane, const V* is_there) {
  V number{}, lever2{};
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const V u = at<V>(point.u, lane), v = at<V>(point.v, lane);
    number = number + is_there[i];
    lever2 = lever2 + (u * u + v * v);
  }
  const auto is_used = number > V{};
  const Symmetric<V> m = symmetric_at<V>(c.response_t, lane);
  const V yy_zz = m.yy * m.zz - m.yz * m.yz, xy_zz = m.xz * m.yz - m.xy * m.zz;
  const V xy_yz = m.xy * m.yz - m.xz * m.yy;
  const V determinant = m.xx * yy_zz + m.xy * xy_zz + m.xz * xy_yz;
  const V d = select(is_used, 1 / determinant, V{});
  store(c.inverse_t[0] + lane, d * yy_zz);
  store(c.inverse_t[1] + lane, d * xy_zz);
  store(c.inverse_t[2] + lane, d * xy_yz);
  store(c.inverse_t[3] + lane, d * (m.xx * m.zz - m.xz * m.xz));
  store(c.inverse_t[4] + lane, d * (m.xy * m.xz - m.xx * m.yz));
  store(c.inverse_t[5] + lane, d * (m.xx * m.yy - m.xy * m.xy));
  store(c.share + lane, select(is_used, 1 / number, V{}));
  store(c.lever_share + lane, select(lever2 > V{}, 1 / lever2, V{}));
}

/// The masses that impulses meet.
template <class V, int points, class Inertia>
CRADLE_LANES void prepare_lanes(BlockOf<V>& c, int lane, bool joint, const Softness& soft,
                                const BodyLine* velocities) {
  const Frame<V> f = frame_at<V>(c, lane);
  const Bodies<V, Inertia> bodies = bodies_at<V, Inertia>(c, lane, velocities);
  const V m = bodies.A.inverse_mass + bodies.B.inverse_mass;
  const Inertia &IA = bodies.inverse_inertia_A, &IB = bodies.inverse_inertia_B;
  const Triple<V>&arm_A = bodies.arm_A, &arm_B = bodies.arm_B;
  const Triple<V> nA = cross(arm_A, f.n), nB = cross(arm_B, f.n);
  const Triple<V> InA = IA * nA, InB = IB * nB;
  const V g00 = m + dot(nA, InA) + dot(nB, InB);
  const V g01 = dot(f.t1, InA + InB), g02 = dot(f.t2, InA + InB);
  const Triple<V> I1 = IA * f.t1 + IB * f.t1, I2 = IA * f.t2 + IB * f.t2;
  const V g11 = dot(f.t1, I1), g12 = dot(f.t2, I1), g22 = dot(f.t2, I2);

  V x0[points], x1[points], x2[points], is_there[points];
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const V u = at<V>(point.u, lane), v = at<V>(point.v, lane);
    x0[i] = g00 + g01 * v - g02 * u;
    x1[i] = g01 + g11 * v - g12 * u;
    x2[i] = g02 + g12 * v - g22 * u;
    const V K = x0[i] + x1[i] * v - x2[i] * u;
    is_there[i] = at<V>(point.yields, lane);  // 1 or 0
    store(point.yields + lane, select(is_there[i] > V{}, 1 / K, V{}));
  }
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    CRADLE_UNROLLED
    for (int j = i + 1; j < points; ++j) {
      const V K = x0[i] + x1[i] * at<V>(c.points[j].v, lane) - x2[i] * at<V>(c.points[j].u, lane);
      store(c.coupling[coupled(i, j)] + lane, select(is_there[i] * is_there[j] > V{}, K, V{}));
    }
  }
  if constexpr (points > 1 && kMayJoin<NumberOf<V>>) {
    if (joint) invert<V, points>(c, lane, is_there, soft);
  }

  const Triple<V> t1A = cross(arm_A, f.t1), t1B = cross(arm_B, f.t1);
  const Triple<V> t2A = cross(arm_A, f.t2), t2B = cross(arm_B, f.t2);
  const Triple<V> It1A = IA * t1A, It1B = IB * t1B, It2A = IA * t2A, It2B = IB * t2B;
  const V h11 = m + dot(t1A, It1A) + dot(t1B, It1B);
  const V h22 = m + dot(t2A, It2A) + dot(t2B, It2B);
  const V h12 = dot(t2A, It1A) + dot(t2B, It1B);
  const V h1n = dot(f.n, It1A + It1B), h2n = dot(f.n, It2A + It2B);
  const V hnn = dot(f.n, IA * f.n + IB * f.n);
  store(c.response_t[0] + lane, h11);
  store(c.response_t[1] + lane, h12);
  store(c.response_t[2] + lane, h1n);
  store(c.response_t[3] + lane, h22);
  store(c.response_t[4] + lane, h2n);
  store(c.response_t[5] + lane, hnn);
  if constexpr (points > 1 && kMayJoin<NumberOf<V>>) {
    if (joint) invert_t<V, points>(c, lane, is_there);
  }
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const V u = at<V>(point.u, lane), v = at<V>(point.v, lane);
    const V K11 = h11 - 2 * v * h1n + v * v * hnn;
    const V K22 = h22 + 2 * u * h2n + u * u * hnn;
    const V K12 = h12 + u * h1n - v * h2n - u * v * hnn;
    const V half = (K11 - K22) / 2;
    const V K = (K11 + K22) / 2 + root<V>(half * half + K12 * K12);
    store(point.yields_t + lane, select(is_there[i] > V{}, 1 / K, V{}));
  }
}

}  // namespace
}  // namespace cradle
