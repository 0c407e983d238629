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
// All points of a manifold at once ("joint"), where all of them carry and it lies in no heap:
//   soft:  l' = l - G_s r,  r_i = vn_i + bias_i / ms + gamma_i l_i, or vn_i + s_i / h where s_i > 0
//   hard:  l' = l - G_h r,  r_i = vn_i + max(s_i, 0) / h
//   G_s = (K + diag gamma + eps)^-1, gamma_i = K_ii is / ms;  G_h = (K + eps)^-1;  K has rank 3,
//   eps a millionth of the mean K_ii makes it regular and moves nothing; what it leaves of a
//   residual (a hundredth, with eps 0.01) is seen in the loads of a first tick ("three points")
//   friction: (P1, P2, Tn) = -G_t^-1 (V1, V2, Wn), to each point P / points and Tn (-v, u) / sum
//   (u^2 + v^2), where that leaves all points within their cones
// If an impulse would pull, the step is cut where the first one ends, and the points go on one
// after another from there: from a step that is merely clamped, energy may rise without bound.
// Where we differ from points by themselves: their offset along n from the plane through c is
// dropped (friction has no lever by it). Order and cost: soft_step.cpp.
#pragma once

#include "server/dynamics/contact/body_lanes.h"
#include "server/dynamics/contact/constraint_lanes.h"
#include "server/dynamics/contact/contact_audit.h"
#include "server/dynamics/contact/contact_masses.h"
#include "server/dynamics/contact/contact_twist.h"

namespace cradle {
namespace {

template <class V, int points, class Inertia>
CRADLE_LANES void warm_start_lanes(const BlockOf<V>& c, int lane, const V& part,
                                   BodyLine* velocities) {
  const Frame<V> f = frame_at<V>(c, lane);
  Bodies<V, Inertia> bodies = bodies_at<V, Inertia>(c, lane, velocities);
  Wrench<V, points> wrench;
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const V u = at<V>(point.u, lane), v = at<V>(point.v, lane);
    const V f1 = part * at<V>(point.lambda_1, lane), f2 = part * at<V>(point.lambda_2, lane);
    wrench.add_normal(part * at<V>(point.lambda, lane), u, v);
    wrench.add_friction(f1, f2, u, v);
  }
  wrench.push(f, bodies);
  store_bodies(c, lane, bodies, velocities);
}

/// The change of a normal impulse, once it is kept from pulling; the velocities of the points after
/// this one feel it.
template <class V, int points>
CRADLE_LANES void add_normal(BlockOf<V>& c, int lane, int i, const V& change, V* vn,
                             Wrench<V, points>& wrench) {
  const V old = at<V>(c.points[i].lambda, lane);
  const V lambda = larger<V>(old + change, V{});
  const V step = lambda - old;
  store(c.points[i].lambda + lane, lambda);
  wrench.add_normal(step, at<V>(c.points[i].u, lane), at<V>(c.points[i].v, lane));
  CRADLE_UNROLLED
  for (int j = i + 1; j < points; ++j) {
    vn[j] = vn[j] + at<V>(c.coupling[coupled(i, j)], lane) * step;
  }
}

/// All normal impulses at once, for the residual r. True where none would pull; elsewhere they have
/// gone as far as none does.
template <class V, int points>
CRADLE_LANES auto add_normals(BlockOf<V>& c, int lane, const RowOf<V>* G, const V* r, V* vn,
                              Wrench<V, points>& wrench) {
  V old[points], change[points], reach = fill<V>(1);
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    V d{};
    CRADLE_UNROLLED
    for (int j = 0; j < points; ++j) {
      d = d - at<V>(G[i < j ? joined<points>(i, j) : joined<points>(j, i)], lane) * r[j];
    }
    old[i] = at<V>(c.points[i].lambda, lane);
    change[i] = d;
    const V left = select(old[i] + d < V{}, old[i] / -d, fill<V>(1));
    reach = select(left < reach, left, reach);
  }
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const V lambda = larger<V>(old[i] + reach * change[i], V{});
    change[i] = lambda - old[i];
    store(point.lambda + lane, lambda);
    wrench.add_normal(change[i], at<V>(point.u, lane), at<V>(point.v, lane));
  }
  const auto is_whole = reach == fill<V>(1);
  if (all<V>(is_whole)) return is_whole;
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    vn[i] = vn[i] + change[i] / at<V>(c.points[i].yields, lane);
    CRADLE_UNROLLED
    for (int j = i + 1; j < points; ++j) {
      const V K = at<V>(c.coupling[coupled(i, j)], lane);
      vn[i] = vn[i] + K * change[j];
      vn[j] = vn[j] + K * change[i];
    }
  }
  return is_whole;
}

/// As softness.h.
template <class V>
struct Soft {
  V mass_scale, impulse_scale, bias_rate;
};

/// The bias of a soft point, times 1/K.
template <class V>
CRADLE_LANES V bias_of(const SubStep& step, const Soft<V>& soft, const V& s, const V& yields,
                       const V& lambda) {
  // max(ms br s, -(limit + is K lambda))
  const V limit = larger<V>(fill<V>(step.push_speed), fill<V>(-step.push_rate) * s);
  return larger<V>(yields * (soft.mass_scale * soft.bias_rate * s),
                   -(yields * limit + soft.impulse_scale * lambda));
}

template <class V, int points, bool joint, class Inertia>
CRADLE_LANES void solve_lanes(BlockOf<V>& c, int lane, const SubStep& step, BodyLine* velocities) {
  const Frame<V> f = frame_at<V>(c, lane);
  Bodies<V, Inertia> bodies = bodies_at<V, Inertia>(c, lane, velocities);
  V vn[points];
  normal_velocities<V, points>(c, lane, twist_of(f, bodies), vn);
  const V haste = fill<V>(step.rate) * at<V>(c.gap_haste, lane);
  if (are_idle<V, points>(c, lane, vn, haste)) return;
  const Soft<V> soft{fill<V>(step.soft.mass_scale), fill<V>(step.soft.impulse_scale),
                     fill<V>(step.soft.bias_rate)};
  Wrench<V, points> wrench;
  decltype(vn[0] == vn[0]) is_done{};
  if constexpr (joint) {
    V r[points];
    CRADLE_UNROLLED
    for (int i = 0; i < points; ++i) {
      auto& point = c.points[i];
      const V s = at<V>(point.s, lane), lambda = at<V>(point.lambda, lane);
      const V yields = at<V>(point.yields, lane);
      const V bias = bias_of<V>(step, soft, s, yields, lambda);
      const V give = soft.impulse_scale * lambda / (soft.mass_scale * yields);
      r[i] = vn[i] + give + select(s > V{}, s * haste, bias / (soft.mass_scale * yields));
      r[i] = select(yields > V{}, r[i], V{});
    }
    is_done = add_normals<V, points>(c, lane, c.inverse_soft, r, vn, wrench);
  }
  if (!all<V>(is_done)) {
    CRADLE_UNROLLED
    for (int i = 0; i < points; ++i) {
      auto& point = c.points[i];
      const V s = at<V>(point.s, lane), lambda = at<V>(point.lambda, lane);
      const V yields = at<V>(point.yields, lane);
      const V into = -(yields * (soft.mass_scale * vn[i]) +
                       bias_of<V>(step, soft, s, yields, lambda) + soft.impulse_scale * lambda);
      const V ahead = -(yields * (vn[i] + s * haste) + soft.impulse_scale * lambda);
      const V change = select(s > V{}, ahead, into);
      add_normal<V, points>(c, lane, i, select(is_done, V{}, change), vn, wrench);
    }
  }
  wrench.push_along_n(f, bodies);
  store_bodies(c, lane, bodies, velocities);
}

/// First order in the turns since the tick's start.
template <class V, int points>
CRADLE_LANES void separations(BlockOf<V>& c, int lane, const Frame<V>& f, const BodyLine* motions) {
  const Twist<V> A = load_lines<V>(motions, c.a + lane), B = load_lines<V>(motions, c.b + lane);
  const Triple<V> arm_A = at3<V>(c.arm_A, lane), arm_B = at3<V>(c.arm_B, lane);
  const V Sn = dot(f.n, B.linear + cross(B.angular, arm_B) - A.linear - cross(A.angular, arm_A));
  if constexpr (points == 1) {
    store(c.points[0].s + lane, at<V>(c.points[0].s0, lane) + Sn);
    return;
  }
  const Triple<V> H = B.angular - A.angular;
  const V H1 = dot(f.t1, H), H2 = dot(f.t2, H);
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    store(point.s + lane,
          at<V>(point.s0, lane) + Sn + at<V>(point.v, lane) * H1 - at<V>(point.u, lane) * H2);
  }
}

/// True where all points stick by the friction that stops them at once; that is theirs then.
template <class V, int points>
CRADLE_LANES auto stick(BlockOf<V>& c, int lane, const V& V1, const V& V2, const V& Wn,
                        Wrench<V, points>& wrench) {
  const Triple<V> F = symmetric_at<V>(c.inverse_t, lane) * Triple<V>{V1, V2, Wn};
  const V share = at<V>(c.share, lane), turn = F.z * at<V>(c.lever_share, lane);
  const V friction = at<V>(c.friction, lane);
  V f1[points], f2[points];
  auto sticks = share == share;
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const V u = at<V>(point.u, lane), v = at<V>(point.v, lane);
    const V is_there = select(at<V>(point.yields, lane) > V{}, fill<V>(1), V{});
    f1[i] = at<V>(point.lambda_1, lane) - is_there * (F.x * share - v * turn);
    f2[i] = at<V>(point.lambda_2, lane) - is_there * (F.y * share + u * turn);
    const V limit = friction * at<V>(point.lambda, lane);
    sticks = sticks & (f1[i] * f1[i] + f2[i] * f2[i] <= limit * limit);
  }
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const V old_1 = at<V>(point.lambda_1, lane), old_2 = at<V>(point.lambda_2, lane);
    const V new_1 = select(sticks, f1[i], old_1), new_2 = select(sticks, f2[i], old_2);
    store(point.lambda_1 + lane, new_1);
    store(point.lambda_2 + lane, new_2);
    wrench.add_friction(new_1 - old_1, new_2 - old_2, at<V>(point.u, lane), at<V>(point.v, lane));
  }
  return sticks;
}

template <class V, int points, bool joint, class Inertia>
CRADLE_LANES void rub(BlockOf<V>& c, int lane, const Frame<V>& f, Bodies<V, Inertia>& bodies) {
  const RelativeTwist<V> twist = twist_of(f, bodies);
  V V1 = twist.V1, V2 = twist.V2, Wn = twist.Wn;
  Wrench<V, points> wrench;
  decltype(V1 == V1) is_done{};
  if constexpr (joint) is_done = stick<V, points>(c, lane, V1, V2, Wn, wrench);
  if (!all<V>(is_done)) {
    const V h11 = at<V>(c.response_t[0], lane), h12 = at<V>(c.response_t[1], lane);
    const V h1n = at<V>(c.response_t[2], lane), h22 = at<V>(c.response_t[3], lane);
    const V h2n = at<V>(c.response_t[4], lane), hnn = at<V>(c.response_t[5], lane);
    const V friction = at<V>(c.friction, lane);
    CRADLE_UNROLLED
    for (int i = 0; i < points; ++i) {
      auto& point = c.points[i];
      const V u = at<V>(point.u, lane), v = at<V>(point.v, lane);
      const V yields = at<V>(point.yields_t, lane);
      const V v1 = points > 1 ? V1 - v * Wn : V1, v2 = points > 1 ? V2 + u * Wn : V2;
      const V old_1 = at<V>(point.lambda_1, lane), old_2 = at<V>(point.lambda_2, lane);
      const V f1 = old_1 - yields * v1, f2 = old_2 - yields * v2;
      const V limit = friction * at<V>(point.lambda, lane), size2 = f1 * f1 + f2 * f2;
      V scale = fill<V>(1);
      const auto slides = size2 > limit * limit;
      if (any<V>(slides))
        scale = select(slides, limit / root<V>(size2), scale);  // waits for two series
      const V new_1 = select(is_done, old_1, scale * f1),
              new_2 = select(is_done, old_2, scale * f2);
      store(point.lambda_1 + lane, new_1);
      store(point.lambda_2 + lane, new_2);
      const V d1 = new_1 - old_1, d2 = new_2 - old_2, dn = u * d2 - v * d1;
      wrench.add_friction(d1, d2, u, v);
      if constexpr (points > 1) {
        V1 = V1 + (h11 * d1 + h12 * d2 + h1n * dn);
        V2 = V2 + (h12 * d1 + h22 * d2 + h2n * dn);
        Wn = Wn + (h1n * d1 + h2n * d2 + hnn * dn);
      }
    }
  }
  wrench.push_across_n(f, bodies);
}

template <class V, int points, bool joint, class Inertia>
CRADLE_LANES void relax_lanes(BlockOf<V>& c, int lane, const SubStep& step, BodyLine* velocities,
                              const BodyLine* motions) {
  const Frame<V> f = frame_at<V>(c, lane);
  separations<V, points>(c, lane, f, motions);
  Bodies<V, Inertia> bodies = bodies_at<V, Inertia>(c, lane, velocities);
  V vn[points];
  normal_velocities<V, points>(c, lane, twist_of(f, bodies), vn);
  const V haste = fill<V>(step.rate) * at<V>(c.gap_haste, lane);
  if (are_idle<V, points>(c, lane, vn, haste)) return;
  Wrench<V, points> wrench;
  decltype(vn[0] == vn[0]) is_done{};
  if constexpr (joint) {
    V r[points];
    CRADLE_UNROLLED
    for (int i = 0; i < points; ++i) {
      auto& point = c.points[i];
      const V yields = at<V>(point.yields, lane);
      r[i] = select(yields > V{}, vn[i] + larger<V>(at<V>(point.s, lane), V{}) * haste, V{});
    }
    is_done = add_normals<V, points>(c, lane, c.inverse_hard, r, vn, wrench);
  }
  if (!all<V>(is_done)) {
    CRADLE_UNROLLED
    for (int i = 0; i < points; ++i) {
      auto& point = c.points[i];
      const V allowed = larger<V>(at<V>(point.s, lane), V{}) * haste;
      const V change = -at<V>(point.yields, lane) * (vn[i] + allowed);
      add_normal<V, points>(c, lane, i, select(is_done, V{}, change), vn, wrench);
    }
  }
  wrench.push_along_n(f, bodies);
  rub<V, points, joint>(c, lane, f, bodies);
  store_bodies(c, lane, bodies, velocities);
}

// Passes over blocks.

template <class V>
using RunOf = BlockRun<NumberOf<V>>;

template <class V, class F>
CRADLE_LANES void for_lanes(const RunOf<V>& run, F&& f) {
  for (int k = 0; k < run.count; ++k) {
    for (int lane = 0; lane < BlockOf<V>::kLanes; lane += kLanes<V>) f(run.blocks[k], lane);
  }
}
template <int points, bool joint>
struct Kind {
  static constexpr int kPoints = points;
  static constexpr bool kJoint = joint;
};
/// Calls `f(kind)`.
template <class Real, class F>
CRADLE_LANES void by_kind(const BlockRun<Real>& run, F&& f) {
  if (run.points == 1) return f(Kind<1, false>{});
  if constexpr (kMayJoin<Real>) {
    if (run.joint) return run.points == 2 ? f(Kind<2, true>{}) : f(Kind<4, true>{});
  }
  return run.points == 2 ? f(Kind<2, false>{}) : f(Kind<4, false>{});
}

/// Calls `f(kind, inertia)`.
template <class V, class F>
CRADLE_LANES void by_inertia(const RunOf<V>& run, F&& f) {
  by_kind(run, [&](auto kind) CRADLE_LAMBDA {
    if (run.is_round) {
      f(kind, Round<V>{});
    } else {
      f(kind, Symmetric<V>{});
    }
  });
}

template <class V>
struct Passes {
  using Real = NumberOf<V>;
  using Run = BlockRun<Real>;
  static void gather(const Run& run, const BlockFilling<Real>& filling) {
    by_kind(run, [&](auto kind) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](BlockOf<V>& c, int lane) CRADLE_LAMBDA {
        fill_lanes<V, kind.kPoints>(c, lane, run.is_round, filling);
      });
    });
  }
  static void scatter(const Run& run, const BlockTaking& taking, Real* sag) {
    by_kind(run, [&](auto kind) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](const BlockOf<V>& c, int lane)
                            CRADLE_LAMBDA { take_lanes<V, kind.kPoints>(c, lane, taking, sag); });
    });
  }
  static void prepare(const Run& run, const Softness& soft, const BodyLine* velocities) {
    by_inertia<V>(run, [&](auto kind, auto inertia) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](BlockOf<V>& c, int lane) CRADLE_LAMBDA {
        prepare_lanes<V, kind.kPoints, decltype(inertia)>(c, lane, run.joint, soft, velocities);
      });
    });
  }
  static void warm_start(const Run& run, BodyLine* velocities) {
    by_inertia<V>(run, [&](auto kind, auto inertia) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](BlockOf<V>& c, int lane) CRADLE_LAMBDA {
        warm_start_lanes<V, kind.kPoints, decltype(inertia)>(c, lane, fill<V>(1), velocities);
      });
    });
  }
  static void repeat(const Run& run, BodyLine* velocities) {
    by_inertia<V>(run, [&](auto kind, auto inertia) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](BlockOf<V>& c, int lane) CRADLE_LAMBDA {
        warm_start_lanes<V, kind.kPoints, decltype(inertia)>(c, lane, at<V>(c.part, lane),
                                                             velocities);
      });
    });
  }
  static void scale(const Run& run) {
    for_lanes<V>(run, [&](BlockOf<V>& c, int lane) CRADLE_LAMBDA {
      const V part = at<V>(c.part, lane);
      for (int i = 0; i < run.points; ++i) {
        auto& point = c.points[i];
        for (RowOf<V>* row : {&point.lambda, &point.lambda_1, &point.lambda_2}) {
          store(*row + lane, part * at<V>(*row, lane));
        }
      }
    });
  }
  static void solve(const Run& run, const SubStep& step, BodyLine* velocities) {
    by_inertia<V>(run, [&](auto kind, auto inertia) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](BlockOf<V>& c, int lane) CRADLE_LAMBDA {
        solve_lanes<V, kind.kPoints, kind.kJoint, decltype(inertia)>(c, lane, step, velocities);
      });
    });
  }
  static void relax(const Run& run, const SubStep& step, BodyLine* velocities,
                    const BodyLine* motions) {
    by_inertia<V>(run, [&](auto kind, auto inertia) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](BlockOf<V>& c, int lane) CRADLE_LAMBDA {
        relax_lanes<V, kind.kPoints, kind.kJoint, decltype(inertia)>(c, lane, step, velocities,
                                                                     motions);
      });
    });
  }
  static void judge(const Run& run, const SubStep& step, const BodyLine* velocities,
                    ContactTally<Real>& tally) {
    by_kind(run, [&](auto kind) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](const BlockOf<V>& c, int lane) CRADLE_LAMBDA {
        judge_lanes<V, kind.kPoints>(c, lane, step, velocities, tally);
      });
    });
  }
  static void work(const Run& run, const BodyLine* means, ContactWork<Real>& work) {
    by_kind(run, [&](auto kind) CRADLE_LAMBDA {
      for_lanes<V>(run, [&](const BlockOf<V>& c, int lane)
                            CRADLE_LAMBDA { work_lanes<V, kind.kPoints>(c, lane, means, work); });
    });
  }
};

template <class V>
constexpr BlockPasses<NumberOf<V>> block_passes() {
  using P = Passes<V>;
  return {P::gather, P::scatter, P::prepare, P::warm_start, P::repeat,
          P::scale,  P::solve,   P::relax,   P::judge,      P::work};
}

/// Of doubles `V` and floats `F`.
template <class V, class F>
constexpr ContactKernels contact_kernels() {
  using B = BodyPasses<V>;
  return {kLanes<V>, B::load, B::look, B::move, B::average, block_passes<V>(), block_passes<F>()};
}

}  // namespace
}  // namespace cradle
