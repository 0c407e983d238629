// The relative twist of a manifold's bodies at its centre, and the impulses that change it, for the
// kernels' files alone. Equations and symbols: contact_method.h.
#pragma once

#include "server/dynamics/contact/manifold_lanes.h"

namespace cradle {
namespace {

/// In the manifold's frame.
template <class V>
struct RelativeTwist {
  V Vn, V1, V2, Wn, W1, W2;
};

template <class V, class Inertia>
CRADLE_LANES RelativeTwist<V> twist_of(const Frame<V>& f, const Bodies<V, Inertia>& bodies) {
  const Triple<V> Vc = bodies.V_at_centre(), W = bodies.B.angular - bodies.A.angular;
  return {dot(f.n, Vc), dot(f.t1, Vc), dot(f.t2, Vc), dot(f.n, W), dot(f.t1, W), dot(f.t2, W)};
}

/// Normal velocities of the points.
template <class V, int points>
CRADLE_LANES void normal_velocities(const BlockOf<V>& c, int lane, const RelativeTwist<V>& twist,
                                    V* vn) {
  if constexpr (points == 1) {
    vn[0] = twist.Vn;
    return;
  }
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    vn[i] = twist.Vn + at<V>(point.v, lane) * twist.W1 - at<V>(point.u, lane) * twist.W2;
  }
}

/// Whether no point of any lane carries, rubs or will: gaps that do not close in the sub-step. To
/// solve them would change nothing then.
template <class V, int points>
CRADLE_LANES bool are_idle(const BlockOf<V>& c, int lane, const V* vn, const V& haste) {
  auto is_idle = haste == haste;
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const V s = at<V>(point.s, lane), yields = at<V>(point.yields, lane);
    const V lambda = at<V>(point.lambda, lane), none{};
    const V ahead = select(s > V{}, vn[i] + s * haste, fill<V>(-1));
    is_idle = is_idle & (lambda == none) & ((ahead >= none) | (yields == none));
  }
  if (!all<V>(is_idle)) return false;
  V friction{};
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    friction = friction +
               (size_of<V>(at<V>(point.lambda_1, lane)) + size_of<V>(at<V>(point.lambda_2, lane)));
  }
  return all<V>(friction == V{});
}

/// Impulses at the centre. A point by itself is the centre, and makes no T.
template <class V, int points>
struct Wrench {
  static constexpr bool kTwists = points > 1;
  V Pn{}, P1{}, P2{}, Tn{}, T1{}, T2{};

  CRADLE_LANES void add_normal(const V& l, const V& u, const V& v) {
    Pn = Pn + l;
    if constexpr (kTwists) {
      T1 = T1 + v * l;
      T2 = T2 - u * l;
    }
  }
  CRADLE_LANES void add_friction(const V& f1, const V& f2, const V& u, const V& v) {
    P1 = P1 + f1;
    P2 = P2 + f2;
    if constexpr (kTwists) Tn = Tn + (u * f2 - v * f1);
  }
  template <class B>
  CRADLE_LANES void push(const Frame<V>& f, B& bodies) const {
    const Triple<V> P = Pn * f.n + P1 * f.t1 + P2 * f.t2;
    if constexpr (kTwists) {
      bodies.push(P, Tn * f.n + T1 * f.t1 + T2 * f.t2);
    } else {
      bodies.push(P);
    }
  }
  template <class B>
  CRADLE_LANES void push_along_n(const Frame<V>& f, B& bodies) const {
    if constexpr (kTwists) {
      bodies.push(Pn * f.n, T1 * f.t1 + T2 * f.t2);
    } else {
      bodies.push(Pn * f.n);
    }
  }
  template <class B>
  CRADLE_LANES void push_across_n(const Frame<V>& f, B& bodies) const {
    const Triple<V> P = P1 * f.t1 + P2 * f.t2;
    if constexpr (kTwists) {
      bodies.push(P, Tn * f.n);
    } else {
      bodies.push(P);
    }
  }
};

}  // namespace
}  // namespace cradle
