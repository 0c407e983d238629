// Bodies and manifolds of a block in lanes, for the kernels' files alone (see lanes.h).
#pragma once

#include <type_traits>

#include "server/dynamics/contact/contact_block.h"
#include "server/dynamics/contact/line_lanes.h"

namespace cradle {
namespace {

// Lines of bodies to lanes, and back.

/// Two numbers of its line beside it.
template <class V>
struct Twist {
  Triple<V> linear, angular;
  V inverse_mass, inverse_moment;
};

template <class Line>
CRADLE_LANES auto numbers_of(Line* line) {
  if constexpr (std::is_const_v<Line>) {
    return reinterpret_cast<const double*>(line);
  } else {
    return reinterpret_cast<double*>(line);
  }
}
template <class V>
CRADLE_LANES void load_rows(V* rows, const BodyLine* lines, const std::int32_t* at) {
  load_line_rows(rows, [&](int l) CRADLE_LAMBDA { return numbers_of(lines) + at[l]; });
}
template <class V>
CRADLE_LANES Twist<V> load_lines(const BodyLine* lines, const std::int32_t* at) {
  V r[kLineNumbers];
  load_rows(r, lines, at);
  return {{r[0], r[1], r[2]}, {r[3], r[4], r[5]}, r[kInverseMass], r[kInverseMoment]};
}
/// `before`: as it was loaded, from there if it can change.
template <class V>
CRADLE_LANES void store_lines(BodyLine* lines, const std::int32_t* at, const Twist<V>& before,
                              const Twist<V>& now) {
  const auto line = [&](int l) CRADLE_LAMBDA { return numbers_of(lines) + at[l]; };
  if constexpr (kIsFloats<V>) {
    const Triple<V> dv = now.linear - before.linear, dw = now.angular - before.angular;
    V rows[kLineNumbers] = {dv.x, dv.y, dv.z, dw.x, dw.y, dw.z, V{}, V{}};
    change_line_rows(rows, line);
  } else {
    V rows[kLineNumbers] = {now.linear.x,  now.linear.y,  now.linear.z,     now.angular.x,
                            now.angular.y, now.angular.z, now.inverse_mass, now.inverse_moment};
    store_line_rows(rows, line);
  }
}

// A manifold in a lane.

template <class V>
using BlockOf = ContactBlock<NumberOf<V>>;
template <class V>
using RowOf = typename BlockOf<V>::Row;

template <class V>
CRADLE_LANES V at(const RowOf<V>& row, int lane) {
  return load<V>(row + lane);
}
template <class V>
CRADLE_LANES Triple<V> at3(const RowOf<V>* rows, int lane) {
  return {load<V>(rows[0] + lane), load<V>(rows[1] + lane), load<V>(rows[2] + lane)};
}

template <class V>
struct Symmetric {
  V xx, xy, xz, yy, yz, zz;
};
template <class V>
CRADLE_LANES Symmetric<V> symmetric_at(const RowOf<V>* rows, int lane) {
  return {at<V>(rows[0], lane), at<V>(rows[1], lane), at<V>(rows[2], lane),
          at<V>(rows[3], lane), at<V>(rows[4], lane), at<V>(rows[5], lane)};
}
template <class V>
CRADLE_LANES Triple<V> operator*(const Symmetric<V>& m, const Triple<V>& a) {
  return {m.xx * a.x + m.xy * a.y + m.xz * a.z, m.xy * a.x + m.yy * a.y + m.yz * a.z,
          m.xz * a.x + m.yz * a.y + m.zz * a.z};
}

/// A multiple of the identity.
template <class V>
struct Round {
  V moment;
};
template <class V>
CRADLE_LANES Triple<V> operator*(const Round<V>& m, const Triple<V>& a) {
  return m.moment * a;
}
template <class V>
CRADLE_LANES void set_inertia(Round<V>& m, const Twist<V>& body, const RowOf<V>*, int) {
  m.moment = body.inverse_moment;
}
template <class V>
CRADLE_LANES void set_inertia(Symmetric<V>& m, const Twist<V>&, const RowOf<V>* rows, int lane) {
  m = symmetric_at<V>(rows, lane);
}

template <class V>
struct Frame {
  Triple<V> n, t1, t2;
};
template <class V>
CRADLE_LANES Frame<V> frame_at(const BlockOf<V>& c, int lane) {
  const Triple<V> n = at3<V>(c.n, lane), t1 = at3<V>(c.t1, lane);
  return {n, t1, cross(n, t1)};
}

/// Two bodies, and how they yield: Inertia is Round or Symmetric.
template <class V, class Inertia>
struct Bodies {
  Twist<V> A, B;
  Twist<V> A_before, B_before;  ///< as they were loaded
  Inertia inverse_inertia_A, inverse_inertia_B;
  Triple<V> arm_A, arm_B;

  CRADLE_LANES Triple<V> V_at_centre() const {
    return B.linear + cross(B.angular, arm_B) - A.linear - cross(A.angular, arm_A);
  }
  CRADLE_LANES void push(const Triple<V>& P, const Triple<V>& T) {
    A.linear = A.linear - A.inverse_mass * P;
    A.angular = A.angular - inverse_inertia_A * (cross(arm_A, P) + T);
    B.linear = B.linear + B.inverse_mass * P;
    B.angular = B.angular + inverse_inertia_B * (cross(arm_B, P) + T);
  }
  CRADLE_LANES void push(const Triple<V>& P) {
    A.linear = A.linear - A.inverse_mass * P;
    A.angular = A.angular - inverse_inertia_A * cross(arm_A, P);
    B.linear = B.linear + B.inverse_mass * P;
    B.angular = B.angular + inverse_inertia_B * cross(arm_B, P);
  }
};
template <class V, class Inertia>
CRADLE_LANES Bodies<V, Inertia> bodies_at(const BlockOf<V>& c, int lane,
                                          const BodyLine* velocities) {
  const Twist<V> A = load_lines<V>(velocities, c.a + lane);
  const Twist<V> B = load_lines<V>(velocities, c.b + lane);
  Bodies<V, Inertia> bodies{A, B, A, B, {}, {}, at3<V>(c.arm_A, lane), at3<V>(c.arm_B, lane)};
  set_inertia(bodies.inverse_inertia_A, bodies.A, c.inverse_inertia_A, lane);
  set_inertia(bodies.inverse_inertia_B, bodies.B, c.inverse_inertia_B, lane);
  return bodies;
}
template <class V, class Inertia>
CRADLE_LANES void store_bodies(const BlockOf<V>& c, int lane, const Bodies<V, Inertia>& bodies,
                               BodyLine* velocities) {
  store_lines(velocities, c.a_out + lane, bodies.A_before, bodies.A);
  store_lines(velocities, c.b_out + lane, bodies.B_before, bodies.B);
}

/// Which element of `coupling` joins points i < j.
constexpr int coupled(int i, int j) { return i == 0 ? j - 1 : i + j; }

}  // namespace
}  // namespace cradle
