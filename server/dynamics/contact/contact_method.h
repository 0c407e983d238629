// Contact of manifolds side by side, for the kernels' files alone (see lanes.h).
//
// Source: the soft step of soft_step.cpp, on the relative twist of the bodies at the manifold's
// centre c, so that four points cost little more than one.
//   V = vB + wB x cB - vA - wA x cA,  W = wB - wA; in the frame: Vn V1 V2, Wn W1 W2
//   a point at c + u t1 + v t2:  vn = Vn + v W1 - u W2,  vt = (V1 - v Wn, V2 + u Wn)
//   impulses (l, f1, f2) there:  P = (sum l, sum f1, sum f2),
//                                T = (sum u f2 - v f1, sum v l, -sum u l)
//   v -+ P / m,  w -+ I^-1 (c x P + T)
// G, the response of (Vn, W1, W2) to (Pn, T1, T2), and G_t, that of (V1, V2, Wn) to (P1, P2, Tn):
//   K_ij = (1, v_i, -u_i) G (1, v_j, -u_j),  K_t from (1, 0, -v), (0, 1, u) and G_t
// All points of a manifold at once ("joint"), where all of them carry:
//   soft:  l' = l - G_s r,  r_i = vn_i + bias_i / ms + gamma_i l_i, or vn_i + s_i / h where s_i > 0
//   hard:  l' = l - G_h r,  r_i = vn_i + max(s_i, 0) / h
//   G_s = (K + diag gamma + eps)^-1, gamma_i = K_ii is / ms;  G_h = (K + eps)^-1;  K has rank 3,
//   eps a hundredth of the mean K_ii makes it regular and moves nothing (1e-4 to 1e-1: the same)
//   friction: (P1, P2, Tn) = -G_t^-1 (V1, V2, Wn), to each point P / points and Tn (-v, u) / sum
//   (u^2 + v^2), where that leaves all points within their cones
// If an impulse would pull, the step is cut where the first one ends, and the points go on one
// after another from there: from a step that is merely clamped, energy may rise without bound.
// Where we differ from points by themselves: their offset along n from the plane through c is
// dropped (friction has no lever by it).
//
// Order as soft_step.cpp. Cost, see there.
#pragma once

#ifdef __SSE2__
#include <immintrin.h>
#endif

#include <type_traits>

#include "server/dynamics/contact/contact_block.h"
#include "server/dynamics/lanes.h"

namespace cradle {
namespace {

// Lines of bodies to lanes, and back.

/// In groups of n rows, element l of row k becomes element k of row l.
template <class V, int distance, std::size_t... l>
CRADLE_LANES void transpose(V* rows, std::index_sequence<l...> lanes) {
  constexpr int n = kLanes<V>;
  for (int k = 0; k < n; ++k) {
    if ((k & distance) != 0) continue;
    const V a = rows[k], b = rows[k + distance];
    rows[k] =
        __builtin_shufflevector(a, b, ((int(l) & distance) ? n + (int(l) ^ distance) : int(l))...);
    rows[k + distance] =
        __builtin_shufflevector(a, b, ((int(l) & distance) ? n + int(l) : (int(l) ^ distance))...);
  }
  if constexpr (distance > 1) transpose<V, distance / 2>(rows, lanes);
}

template <class V>
struct Twist {
  Triple<V> linear, angular;
};

constexpr int kLineDoubles = sizeof(BodyLine) / sizeof(double);

template <class V>
CRADLE_LANES void load_rows(V* rows, const BodyLine* lines, const std::int32_t* at) {
  constexpr int n = kLanes<V>;
  for (int part = 0; part < kLineDoubles / n; ++part) {
    for (int l = 0; l < n; ++l) rows[part * n + l] = load<V>(lines[at[l]].linear + part * n);
    if constexpr (n > 1) transpose<V, n / 2>(rows + part * n, std::make_index_sequence<n>{});
  }
}
template <class V>
CRADLE_LANES Twist<V> load_lines(const BodyLine* lines, const std::int32_t* at) {
  V r[kLineDoubles];
  load_rows(r, lines, at);
  return {{r[0], r[1], r[2]}, {r[3], r[4], r[5]}};
}
template <class V>
CRADLE_LANES void store_lines(BodyLine* lines, const std::int32_t* at, const Twist<V>& twist) {
  constexpr int n = kLanes<V>;
  V r[kLineDoubles] = {twist.linear.x,
                       twist.linear.y,
                       twist.linear.z,
                       twist.angular.x,
                       twist.angular.y,
                       twist.angular.z,
                       V{},
                       V{}};
  for (int part = 0; part < kLineDoubles / n; ++part) {
    if constexpr (n > 1) transpose<V, n / 2>(r + part * n, std::make_index_sequence<n>{});
    for (int l = 0; l < n; ++l) store(lines[at[l]].linear + part * n, r[part * n + l]);
  }
}

// A manifold in a lane.

using BlockRow = ContactBlock::Row;

template <class V>
CRADLE_LANES V at(const BlockRow& row, int lane) {
  return load<V>(row + lane);
}
template <class V>
CRADLE_LANES Triple<V> at3(const BlockRow* rows, int lane) {
  return {load<V>(rows[0] + lane), load<V>(rows[1] + lane), load<V>(rows[2] + lane)};
}

template <class V>
CRADLE_LANES V larger(const V& a, const V& b) {
  return a > b ? a : b;
}

template <class V>
CRADLE_LANES V root(const V& x) {
  if constexpr (kLanes<V> == 1) {
    return __builtin_sqrt(x);
#ifdef __SSE2__
  } else if constexpr (kLanes<V> == 2) {
    return V(_mm_sqrt_pd(__m128d(x)));
#endif
#ifdef __AVX2__
  } else if constexpr (kLanes<V> == 4) {
    return V(_mm256_sqrt_pd(__m256d(x)));
#endif
#ifdef __AVX512F__
  } else if constexpr (kLanes<V> == 8) {
    return V(_mm512_maskz_sqrt_pd(0xff, __m512d(x)));
#endif
  } else {
    V r;
    for (int l = 0; l < kLanes<V>; ++l) r[l] = __builtin_sqrt(x[l]);
    return r;
  }
}

template <class V>
struct Symmetric {
  V xx, xy, xz, yy, yz, zz;
};
template <class V>
CRADLE_LANES Symmetric<V> symmetric_at(const BlockRow* rows, int lane) {
  return {at<V>(rows[0], lane), at<V>(rows[1], lane), at<V>(rows[2], lane),
          at<V>(rows[3], lane), at<V>(rows[4], lane), at<V>(rows[5], lane)};
}
template <class V>
CRADLE_LANES Triple<V> operator*(const Symmetric<V>& m, const Triple<V>& a) {
  return {m.xx * a.x + m.xy * a.y + m.xz * a.z, m.xy * a.x + m.yy * a.y + m.yz * a.z,
          m.xz * a.x + m.yz * a.y + m.zz * a.z};
}

template <class V>
struct Frame {
  Triple<V> n, t1, t2;
};
template <class V>
CRADLE_LANES Frame<V> frame_at(const ContactBlock& c, int lane) {
  const Triple<V> n = at3<V>(c.n, lane), t1 = at3<V>(c.t1, lane);
  return {n, t1, cross(n, t1)};
}

/// Two bodies, and how they yield.
template <class V>
struct Bodies {
  Twist<V> A, B;
  V inverse_mass_A, inverse_mass_B;
  Symmetric<V> inverse_inertia_A, inverse_inertia_B;
  Triple<V> arm_A, arm_B;

  CRADLE_LANES Triple<V> V_at_centre() const {
    return B.linear + cross(B.angular, arm_B) - A.linear - cross(A.angular, arm_A);
  }
  CRADLE_LANES void push(const Triple<V>& P, const Triple<V>& T) {
    A.linear = A.linear - inverse_mass_A * P;
    A.angular = A.angular - inverse_inertia_A * (cross(arm_A, P) + T);
    B.linear = B.linear + inverse_mass_B * P;
    B.angular = B.angular + inverse_inertia_B * (cross(arm_B, P) + T);
  }
};
template <class V>
CRADLE_LANES Bodies<V> bodies_at(const ContactBlock& c, int lane, const BodyLine* velocities) {
  return {load_lines<V>(velocities, c.a + lane),
          load_lines<V>(velocities, c.b + lane),
          at<V>(c.inverse_mass_A, lane),
          at<V>(c.inverse_mass_B, lane),
          symmetric_at<V>(c.inverse_inertia_A, lane),
          symmetric_at<V>(c.inverse_inertia_B, lane),
          at3<V>(c.arm_A, lane),
          at3<V>(c.arm_B, lane)};
}
template <class V>
CRADLE_LANES void store_bodies(const ContactBlock& c, int lane, const Bodies<V>& bodies,
                               BodyLine* velocities) {
  store_lines(velocities, c.a_out + lane, bodies.A);
  store_lines(velocities, c.b_out + lane, bodies.B);
}

/// Which element of `coupling` joins points i < j.
constexpr int coupled(int i, int j) { return i == 0 ? j - 1 : i + j; }

// What a pass does to a manifold.

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
CRADLE_LANES void invert_into(BlockRow* to, int lane, const V* K, const V* diagonal,
                              std::integral_constant<int, 2>) {
  const Inverse2<V> m = inverse<V>(diagonal[0], K[0], diagonal[1]);
  store(to[0] + lane, m.xx);
  store(to[1] + lane, m.xy);
  store(to[2] + lane, m.yy);
}
/// [A B; B^T D] by the inverse of A and of D - B^T A^-1 B.
template <class V>
CRADLE_LANES void invert_into(BlockRow* to, int lane, const V* K, const V* diagonal,
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
CRADLE_LANES void invert(ContactBlock& c, int lane, const SubStep& step, const V* is_there) {
  V K[6], own[points], soft[points], hard[points], sum{}, number{};
  for (int i = 0; i < points * (points - 1) / 2; ++i) K[i] = at<V>(c.coupling[i], lane);
  for (int i = 0; i < points; ++i) {
    const V yields = at<V>(c.yields[i], lane);
    own[i] = is_there[i] != V{} ? 1 / yields : V{};
    sum = sum + own[i];
    number = number + is_there[i];
  }
  const V eps = 0.01 * sum / larger<V>(number, fill<V>(1));
  for (int i = 0; i < points; ++i) {
    hard[i] = is_there[i] != V{} ? own[i] + eps : fill<V>(1);
    soft[i] = hard[i] + step.impulse_scale / step.mass_scale * own[i];
  }
  constexpr std::integral_constant<int, points> size{};
  invert_into<V>(c.inverse_soft, lane, K, soft, size);
  invert_into<V>(c.inverse_hard, lane, K, hard, size);
}

/// After `response_t`.
template <class V, int points>
CRADLE_LANES void invert_t(ContactBlock& c, int lane, const V* is_there) {
  V number{}, lever2{};
  for (int i = 0; i < points; ++i) {
    const V u = at<V>(c.u[i], lane), v = at<V>(c.v[i], lane);
    number = number + is_there[i];
    lever2 = lever2 + (u * u + v * v);
  }
  const auto is_used = number > V{};
  const Symmetric<V> m = symmetric_at<V>(c.response_t, lane);
  const V yy_zz = m.yy * m.zz - m.yz * m.yz, xy_zz = m.xz * m.yz - m.xy * m.zz;
  const V xy_yz = m.xy * m.yz - m.xz * m.yy;
  const V determinant = m.xx * yy_zz + m.xy * xy_zz + m.xz * xy_yz;
  const V d = is_used ? 1 / determinant : V{};
  store(c.inverse_t[0] + lane, d * yy_zz);
  store(c.inverse_t[1] + lane, d * xy_zz);
  store(c.inverse_t[2] + lane, d * xy_yz);
  store(c.inverse_t[3] + lane, d * (m.xx * m.zz - m.xz * m.xz));
  store(c.inverse_t[4] + lane, d * (m.xy * m.xz - m.xx * m.yz));
  store(c.inverse_t[5] + lane, d * (m.xx * m.yy - m.xy * m.xy));
  store(c.share + lane, is_used ? 1 / number : V{});
  store(c.lever_share + lane, lever2 > V{} ? 1 / lever2 : V{});
}

/// The masses that impulses meet.
template <class V, int points>
CRADLE_LANES void prepare_lanes(ContactBlock& c, int lane, const SubStep& step, bool joint) {
  const Frame<V> f = frame_at<V>(c, lane);
  const V m = at<V>(c.inverse_mass_A, lane) + at<V>(c.inverse_mass_B, lane);
  const Symmetric<V> IA = symmetric_at<V>(c.inverse_inertia_A, lane);
  const Symmetric<V> IB = symmetric_at<V>(c.inverse_inertia_B, lane);
  const Triple<V> arm_A = at3<V>(c.arm_A, lane), arm_B = at3<V>(c.arm_B, lane);
  const Triple<V> nA = cross(arm_A, f.n), nB = cross(arm_B, f.n);
  const Triple<V> InA = IA * nA, InB = IB * nB;
  const V g00 = m + dot(nA, InA) + dot(nB, InB);
  const V g01 = dot(f.t1, InA + InB), g02 = dot(f.t2, InA + InB);
  const Triple<V> I1 = IA * f.t1 + IB * f.t1, I2 = IA * f.t2 + IB * f.t2;
  const V g11 = dot(f.t1, I1), g12 = dot(f.t2, I1), g22 = dot(f.t2, I2);

  V x0[points], x1[points], x2[points], is_there[points];
  for (int i = 0; i < points; ++i) {
    const V u = at<V>(c.u[i], lane), v = at<V>(c.v[i], lane);
    x0[i] = g00 + g01 * v - g02 * u;
    x1[i] = g01 + g11 * v - g12 * u;
    x2[i] = g02 + g12 * v - g22 * u;
    const V K = x0[i] + x1[i] * v - x2[i] * u;
    is_there[i] = at<V>(c.yields[i], lane);  // 1 or 0
    store(c.yields[i] + lane, is_there[i] != V{} ? 1 / K : V{});
  }
  for (int i = 0; i < points; ++i) {
    for (int j = i + 1; j < points; ++j) {
      const V K = x0[i] + x1[i] * at<V>(c.v[j], lane) - x2[i] * at<V>(c.u[j], lane);
      store(c.coupling[coupled(i, j)] + lane, is_there[i] * is_there[j] != V{} ? K : V{});
    }
  }
  if constexpr (points > 1) {
    if (joint) invert<V, points>(c, lane, step, is_there);
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
  if constexpr (points > 1) {
    if (joint) invert_t<V, points>(c, lane, is_there);
  }
  for (int i = 0; i < points; ++i) {
    const V u = at<V>(c.u[i], lane), v = at<V>(c.v[i], lane);
    const V K11 = h11 - 2 * v * h1n + v * v * hnn;
    const V K22 = h22 + 2 * u * h2n + u * u * hnn;
    const V K12 = h12 + u * h1n - v * h2n - u * v * hnn;
    const V half = (K11 - K22) / 2;
    const V K = (K11 + K22) / 2 + root<V>(half * half + K12 * K12);
    store(c.yields_t[i] + lane, is_there[i] != V{} ? 1 / K : V{});
  }
}

/// In the manifold's frame: normal impulses, and the twists they make.
template <class V>
struct Wrench {
  V Pn{}, P1{}, P2{}, Tn{}, T1{}, T2{};

  CRADLE_LANES void add_normal(const V& l, const V& u, const V& v) {
    Pn = Pn + l;
    T1 = T1 + v * l;
    T2 = T2 - u * l;
  }
  CRADLE_LANES void add_friction(const V& f1, const V& f2, const V& u, const V& v) {
    P1 = P1 + f1;
    P2 = P2 + f2;
    Tn = Tn + (u * f2 - v * f1);
  }
  CRADLE_LANES void push(const Frame<V>& f, Bodies<V>& bodies) const {
    bodies.push(Pn * f.n + P1 * f.t1 + P2 * f.t2, Tn * f.n + T1 * f.t1 + T2 * f.t2);
  }
  CRADLE_LANES void push_along_n(const Frame<V>& f, Bodies<V>& bodies) const {
    bodies.push(Pn * f.n, T1 * f.t1 + T2 * f.t2);
  }
};

template <class V, int points>
CRADLE_LANES void warm_start_lanes(const ContactBlock& c, int lane, BodyLine* velocities) {
  const Frame<V> f = frame_at<V>(c, lane);
  Bodies<V> bodies = bodies_at<V>(c, lane, velocities);
  Wrench<V> wrench;
  for (int i = 0; i < points; ++i) {
    const V u = at<V>(c.u[i], lane), v = at<V>(c.v[i], lane);
    wrench.add_normal(at<V>(c.lambda[i], lane), u, v);
    wrench.add_friction(at<V>(c.lambda_1[i], lane), at<V>(c.lambda_2[i], lane), u, v);
  }
  wrench.push(f, bodies);
  store_bodies(c, lane, bodies, velocities);
}

/// Normal velocities of the points.
template <class V, int points>
CRADLE_LANES void normal_velocities(const ContactBlock& c, int lane, const Frame<V>& f,
                                    const Bodies<V>& bodies, V* vn) {
  const V Vn = dot(f.n, bodies.V_at_centre());
  const Triple<V> W = bodies.B.angular - bodies.A.angular;
  const V W1 = dot(f.t1, W), W2 = dot(f.t2, W);
  for (int i = 0; i < points; ++i) {
    vn[i] = Vn + at<V>(c.v[i], lane) * W1 - at<V>(c.u[i], lane) * W2;
  }
}

/// The change of a normal impulse, once it is kept from pulling; the velocities of the points after
/// this one feel it.
template <class V, int points>
CRADLE_LANES void add_normal(ContactBlock& c, int lane, int i, const V& change, V* vn,
                             Wrench<V>& wrench) {
  const V old = at<V>(c.lambda[i], lane);
  const V lambda = larger<V>(old + change, V{});
  const V step = lambda - old;
  store(c.lambda[i] + lane, lambda);
  store(c.lambda_max[i] + lane, larger<V>(at<V>(c.lambda_max[i], lane), lambda));
  wrench.add_normal(step, at<V>(c.u[i], lane), at<V>(c.v[i], lane));
  for (int j = i + 1; j < points; ++j) {
    vn[j] = vn[j] + at<V>(c.coupling[coupled(i, j)], lane) * step;
  }
}

/// All normal impulses at once, for the residual r. True where none would pull; elsewhere they have
/// gone as far as none does.
template <class V, int points>
CRADLE_LANES auto add_normals(ContactBlock& c, int lane, const BlockRow* G, const V* r, V* vn,
                              Wrench<V>& wrench) {
  V old[points], change[points], reach = fill<V>(1);
  for (int i = 0; i < points; ++i) {
    V d{};
    for (int j = 0; j < points; ++j) {
      d = d - at<V>(G[i < j ? joined<points>(i, j) : joined<points>(j, i)], lane) * r[j];
    }
    old[i] = at<V>(c.lambda[i], lane);
    change[i] = d;
    const V left = old[i] + d < V{} ? old[i] / -d : fill<V>(1);
    reach = left < reach ? left : reach;
  }
  for (int i = 0; i < points; ++i) {
    const V lambda = larger<V>(old[i] + reach * change[i], V{});
    change[i] = lambda - old[i];
    store(c.lambda[i] + lane, lambda);
    store(c.lambda_max[i] + lane, larger<V>(at<V>(c.lambda_max[i], lane), lambda));
    wrench.add_normal(change[i], at<V>(c.u[i], lane), at<V>(c.v[i], lane));
  }
  const auto is_whole = reach == fill<V>(1);
  if (all<V>(is_whole)) return is_whole;
  for (int i = 0; i < points; ++i) {
    vn[i] = vn[i] + change[i] / at<V>(c.yields[i], lane);
    for (int j = i + 1; j < points; ++j) {
      const V K = at<V>(c.coupling[coupled(i, j)], lane);
      vn[i] = vn[i] + K * change[j];
      vn[j] = vn[j] + K * change[i];
    }
  }
  return is_whole;
}

/// The bias of a soft point, times 1/K.
template <class V>
CRADLE_LANES V bias_of(const SubStep& step, const V& s, const V& yields, const V& lambda) {
  // max(ms br s, -(limit + is K lambda))
  const V limit = larger<V>(fill<V>(step.push_speed), -step.push_rate * s);
  return larger<V>(yields * (step.mass_scale * step.bias_rate * s),
                   -(yields * limit + step.impulse_scale * lambda));
}

template <class V, int points, bool joint>
CRADLE_LANES void solve_lanes(ContactBlock& c, int lane, const SubStep& step,
                              BodyLine* velocities) {
  const Frame<V> f = frame_at<V>(c, lane);
  Bodies<V> bodies = bodies_at<V>(c, lane, velocities);
  V vn[points];
  normal_velocities<V, points>(c, lane, f, bodies, vn);
  Wrench<V> wrench;
  decltype(vn[0] == vn[0]) is_done{};
  if constexpr (joint) {
    V r[points];
    for (int i = 0; i < points; ++i) {
      const V s = at<V>(c.s[i], lane), lambda = at<V>(c.lambda[i], lane);
      const V yields = at<V>(c.yields[i], lane);
      const V bias = bias_of<V>(step, s, yields, lambda);
      const V soft = vn[i] + (bias + step.impulse_scale * lambda) / (step.mass_scale * yields);
      r[i] = s > V{} ? vn[i] + s / step.h : soft;
      r[i] = yields > V{} ? r[i] : V{};
    }
    is_done = add_normals<V, points>(c, lane, c.inverse_soft, r, vn, wrench);
  }
  if (!all<V>(is_done)) {
    for (int i = 0; i < points; ++i) {
      const V s = at<V>(c.s[i], lane), lambda = at<V>(c.lambda[i], lane);
      const V yields = at<V>(c.yields[i], lane);
      const V soft = -(yields * (step.mass_scale * vn[i]) + bias_of<V>(step, s, yields, lambda) +
                       step.impulse_scale * lambda);
      const V ahead = -yields * (vn[i] + s / step.h);
      const V change = s > V{} ? ahead : soft;
      add_normal<V, points>(c, lane, i, is_done ? V{} : change, vn, wrench);
    }
  }
  wrench.push_along_n(f, bodies);
  store_bodies(c, lane, bodies, velocities);
}

/// First order in the turns since the tick's start.
template <class V, int points>
CRADLE_LANES void separations(ContactBlock& c, int lane, const Frame<V>& f,
                              const BodyLine* motions) {
  const Twist<V> A = load_lines<V>(motions, c.a + lane), B = load_lines<V>(motions, c.b + lane);
  const Triple<V> arm_A = at3<V>(c.arm_A, lane), arm_B = at3<V>(c.arm_B, lane);
  const V Sn = dot(f.n, B.linear + cross(B.angular, arm_B) - A.linear - cross(A.angular, arm_A));
  const Triple<V> H = B.angular - A.angular;
  const V H1 = dot(f.t1, H), H2 = dot(f.t2, H);
  for (int i = 0; i < points; ++i) {
    store(c.s[i] + lane,
          at<V>(c.s0[i], lane) + Sn + at<V>(c.v[i], lane) * H1 - at<V>(c.u[i], lane) * H2);
  }
}

/// True where all points stick by the friction that stops them at once; that is theirs then.
template <class V, int points>
CRADLE_LANES auto stick(ContactBlock& c, int lane, const V& V1, const V& V2, const V& Wn,
                        Wrench<V>& wrench) {
  const Triple<V> F = symmetric_at<V>(c.inverse_t, lane) * Triple<V>{V1, V2, Wn};
  const V share = at<V>(c.share, lane), turn = F.z * at<V>(c.lever_share, lane);
  const V friction = at<V>(c.friction, lane);
  V f1[points], f2[points];
  auto sticks = share == share;
  for (int i = 0; i < points; ++i) {
    const V u = at<V>(c.u[i], lane), v = at<V>(c.v[i], lane);
    const V is_there = at<V>(c.yields[i], lane) > V{} ? fill<V>(1) : V{};
    f1[i] = at<V>(c.lambda_1[i], lane) - is_there * (F.x * share - v * turn);
    f2[i] = at<V>(c.lambda_2[i], lane) - is_there * (F.y * share + u * turn);
    const V limit = friction * at<V>(c.lambda[i], lane);
    sticks = sticks & (f1[i] * f1[i] + f2[i] * f2[i] <= limit * limit);
  }
  for (int i = 0; i < points; ++i) {
    const V old_1 = at<V>(c.lambda_1[i], lane), old_2 = at<V>(c.lambda_2[i], lane);
    const V new_1 = sticks ? f1[i] : old_1, new_2 = sticks ? f2[i] : old_2;
    store(c.lambda_1[i] + lane, new_1);
    store(c.lambda_2[i] + lane, new_2);
    wrench.add_friction(new_1 - old_1, new_2 - old_2, at<V>(c.u[i], lane), at<V>(c.v[i], lane));
  }
  return sticks;
}

template <class V, int points, bool joint>
CRADLE_LANES void rub(ContactBlock& c, int lane, const Frame<V>& f, Bodies<V>& bodies) {
  const Triple<V> Vc = bodies.V_at_centre();
  V V1 = dot(f.t1, Vc), V2 = dot(f.t2, Vc);
  V Wn = dot(f.n, bodies.B.angular - bodies.A.angular);
  Wrench<V> wrench;
  decltype(V1 == V1) is_done{};
  if constexpr (joint) is_done = stick<V, points>(c, lane, V1, V2, Wn, wrench);
  if (!all<V>(is_done)) {
    const V h11 = at<V>(c.response_t[0], lane), h12 = at<V>(c.response_t[1], lane);
    const V h1n = at<V>(c.response_t[2], lane), h22 = at<V>(c.response_t[3], lane);
    const V h2n = at<V>(c.response_t[4], lane), hnn = at<V>(c.response_t[5], lane);
    const V friction = at<V>(c.friction, lane);
    for (int i = 0; i < points; ++i) {
      const V u = at<V>(c.u[i], lane), v = at<V>(c.v[i], lane);
      const V yields = at<V>(c.yields_t[i], lane);
      const V old_1 = at<V>(c.lambda_1[i], lane), old_2 = at<V>(c.lambda_2[i], lane);
      const V f1 = old_1 - yields * (V1 - v * Wn), f2 = old_2 - yields * (V2 + u * Wn);
      const V limit = friction * at<V>(c.lambda[i], lane), size2 = f1 * f1 + f2 * f2;
      const V scale = size2 > limit * limit ? limit / root<V>(size2) : fill<V>(1);
      const V new_1 = is_done ? old_1 : scale * f1, new_2 = is_done ? old_2 : scale * f2;
      store(c.lambda_1[i] + lane, new_1);
      store(c.lambda_2[i] + lane, new_2);
      const V d1 = new_1 - old_1, d2 = new_2 - old_2, dn = u * d2 - v * d1;
      wrench.add_friction(d1, d2, u, v);
      V1 = V1 + (h11 * d1 + h12 * d2 + h1n * dn);
      V2 = V2 + (h12 * d1 + h22 * d2 + h2n * dn);
      Wn = Wn + (h1n * d1 + h2n * d2 + hnn * dn);
    }
  }
  bodies.push(wrench.P1 * f.t1 + wrench.P2 * f.t2, wrench.Tn * f.n);
}

template <class V, int points, bool joint>
CRADLE_LANES void relax_lanes(ContactBlock& c, int lane, const SubStep& step, BodyLine* velocities,
                              const BodyLine* motions) {
  const Frame<V> f = frame_at<V>(c, lane);
  separations<V, points>(c, lane, f, motions);
  Bodies<V> bodies = bodies_at<V>(c, lane, velocities);
  V vn[points];
  normal_velocities<V, points>(c, lane, f, bodies, vn);
  Wrench<V> wrench;
  decltype(vn[0] == vn[0]) is_done{};
  if constexpr (joint) {
    V r[points];
    for (int i = 0; i < points; ++i) {
      const V yields = at<V>(c.yields[i], lane);
      r[i] = yields > V{} ? vn[i] + larger<V>(at<V>(c.s[i], lane), V{}) / step.h : V{};
    }
    is_done = add_normals<V, points>(c, lane, c.inverse_hard, r, vn, wrench);
  }
  if (!all<V>(is_done)) {
    for (int i = 0; i < points; ++i) {
      const V allowed = larger<V>(at<V>(c.s[i], lane), V{}) / step.h;
      const V change = -at<V>(c.yields[i], lane) * (vn[i] + allowed);
      add_normal<V, points>(c, lane, i, is_done ? V{} : change, vn, wrench);
    }
  }
  wrench.push_along_n(f, bodies);
  rub<V, points, joint>(c, lane, f, bodies);
  store_bodies(c, lane, bodies, velocities);
}

// Passes over blocks.

template <class V, class F>
CRADLE_LANES void for_lanes(const BlockRun& run, F&& f) {
  for (int k = 0; k < run.count; ++k) {
    for (int lane = 0; lane < kBlockLanes; lane += kLanes<V>) f(run.blocks[k], lane);
  }
}
template <int points, bool joint>
struct Kind {
  static constexpr int kPoints = points;
  static constexpr bool kJoint = joint;
};
template <class F>
CRADLE_LANES void by_kind(const BlockRun& run, F&& f) {
  if (run.points == 1) return f(Kind<1, false>{});
  if (run.points == 2) return run.joint ? f(Kind<2, true>{}) : f(Kind<2, false>{});
  return run.joint ? f(Kind<4, true>{}) : f(Kind<4, false>{});
}

template <class V>
struct Passes {
  static void prepare(const BlockRun& run, const SubStep& step) {
    by_kind(run, [&](auto kind) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](ContactBlock& c, int lane) CRADLE_LAMBDA {
        prepare_lanes<V, kind.kPoints>(c, lane, step, run.joint);
      });
    });
  }
  static void warm_start(const BlockRun& run, BodyLine* velocities) {
    by_kind(run, [&](auto kind) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](ContactBlock& c, int lane) CRADLE_LAMBDA {
        warm_start_lanes<V, kind.kPoints>(c, lane, velocities);
      });
    });
  }
  static void solve(const BlockRun& run, const SubStep& step, BodyLine* velocities) {
    by_kind(run, [&](auto kind) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](ContactBlock& c, int lane) CRADLE_LAMBDA {
        solve_lanes<V, kind.kPoints, kind.kJoint>(c, lane, step, velocities);
      });
    });
  }
  static void relax(const BlockRun& run, const SubStep& step, BodyLine* velocities,
                    const BodyLine* motions) {
    by_kind(run, [&](auto kind) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](ContactBlock& c, int lane) CRADLE_LAMBDA {
        relax_lanes<V, kind.kPoints, kind.kJoint>(c, lane, step, velocities, motions);
      });
    });
  }
};

template <class V>
constexpr ContactKernels contact_kernels() {
  using P = Passes<V>;
  return {kLanes<V>, P::prepare, P::warm_start, P::solve, P::relax};
}

}  // namespace
}  // namespace cradle
