// From constraints to blocks and back, for the kernels' files alone (see lanes.h).
//
// A constraint's lines of eight numbers are read whole and transposed: eight numbers of eight
// constraints take 8 loads and 24 moves between lanes, not 64 of each kind. Symbols as in
// contact_method.h.
#pragma once

#include "server/dynamics/contact/manifold_lanes.h"

namespace cradle {
namespace {

template <class V>
CRADLE_LANES void load_numbers(V* rows, double* const* lines, int begin) {
  constexpr int n = kLanes<V>;
  for (int part = 0; part < kLineDoubles / n; ++part) {
    for (int l = 0; l < n; ++l) rows[part * n + l] = load<V>(lines[l] + begin + part * n);
    if constexpr (n > 1) transpose<V, n / 2>(rows + part * n, std::make_index_sequence<n>{});
  }
}
/// Where there is a constraint.
template <class V>
CRADLE_LANES void store_numbers(V* rows, const ContactBlock& c, int lane, int begin) {
  constexpr int n = kLanes<V>;
  for (int part = 0; part < kLineDoubles / n; ++part) {
    if constexpr (n > 1) transpose<V, n / 2>(rows + part * n, std::make_index_sequence<n>{});
    for (int l = 0; l < n; ++l) {
      if (c.source[lane + l] < 0) continue;
      store(c.lines[lane + l] + begin + part * n, rows[part * n + l]);
    }
  }
}

template <class V>
CRADLE_LANES void store3(BlockRow* rows, int lane, const Triple<V>& value) {
  store(rows[0] + lane, value.x);
  store(rows[1] + lane, value.y);
  store(rows[2] + lane, value.z);
}

/// How the bodies turn; all zeros if they do not.
template <class V>
CRADLE_LANES void fill_inertia(const BodyLine* responses, const std::int32_t* at, BlockRow* rows,
                               int lane) {
  V r[kLineDoubles];
  load_rows(r, responses, at);
  for (int k = 0; k < 6; ++k) store(rows[k] + lane, r[k]);
}

template <class V, int points>
CRADLE_LANES void fill_lanes(ContactBlock& c, int lane, bool is_round,
                             const BlockFilling& filling) {
  using Lines = ConstraintLines;
  if (!is_round) {
    fill_inertia<V>(filling.responses, c.a + lane, c.inverse_inertia_A, lane);
    fill_inertia<V>(filling.responses, c.b + lane, c.inverse_inertia_B, lane);
  }
  V r[kLineDoubles];
  load_numbers(r, c.lines + lane, Lines::kFrame);
  const Triple<V> n{r[0], r[1], r[2]}, t1{r[3], r[4], r[5]}, t2 = cross(n, t1);
  store3(c.n, lane, n);
  store3(c.t1, lane, t1);
  store(c.friction + lane, r[6]);
  const V one = fill<V>(1), preload = filling.give * r[7];
  store(c.sink_share + lane, one - r[7]);

  Triple<V> arms[points], sum{};
  V number{}, zero{};
  for (int i = 0; i < points; ++i) {
    const auto is_there = at<V>(c.yields[i], lane) > V{};
    const int begin = Lines::kPoints + i * Lines::kPointNumbers;
    load_numbers(r, c.lines + lane, begin + Lines::kPlace);
    arms[i] = {r[0], r[1], r[2]};
    sum = sum + select(is_there, arms[i], Triple<V>{});
    number = number + (is_there ? one : zero);
    const V gap = r[3];
    load_numbers(r, c.lines + lane, begin + Lines::kLoad);
    const V load = larger<V>(smaller<V>(r[3], filling.excess * (r[2] * r[4])) - r[7],
                             zero);  // beyond rest_load
    const V s0 = is_there ? gap - preload * load : zero;
    store(c.s0[i] + lane, s0);
    store(c.s[i] + lane, s0);
    store(c.lambda_1[i] + lane, is_there ? filling.h * r[0] : zero);
    store(c.lambda_2[i] + lane, is_there ? filling.h * r[1] : zero);
    store(c.lambda[i] + lane, is_there ? filling.h * r[2] : zero);
  }
  // The mean of the points: between them every point has a short lever.
  const V share = 1 / larger<V>(number, one);
  const Triple<V> centre = share * sum;
  load_numbers(r, c.lines + lane, Lines::kBodies);
  store3(c.arm_A, lane, centre);
  store3(c.arm_B, lane, centre + Triple<V>{r[0], r[1], r[2]});
  store(c.gap_haste + lane, r[5] > V{} ? fill<V>(kImpactHaste) : one);
  for (int i = 0; i < points; ++i) {
    const auto is_there = at<V>(c.yields[i], lane) > V{};
    const Triple<V> from_centre = arms[i] - centre;
    store(c.u[i] + lane, is_there ? dot(t1, from_centre) : zero);
    store(c.v[i] + lane, is_there ? dot(t2, from_centre) : zero);
  }
}

/// What presses lasts, or grows: soft_batch.cpp.
template <class V>
CRADLE_LANES V press_after(const V& before, const V& now, const BlockTaking& taking) {
  const V next = smaller<V>(larger<V>(now, taking.decay * before), taking.growth * before);
  return before == V{} ? now : next;
}

template <class V, int points>
CRADLE_LANES void take_lanes(const ContactBlock& c, int lane, const BlockTaking& taking,
                             double* sag) {
  V most = load<V>(sag + lane);
  const V give = taking.give * at<V>(c.sink_share, lane);
  for (int i = 0; i < points; ++i) {
    const int begin = ConstraintLines::kPoints + i * ConstraintLines::kPointNumbers;
    const V yields = at<V>(c.yields[i], lane);
    V r[kLineDoubles];
    load_numbers(r, c.lines + lane, begin + ConstraintLines::kLoad);
    // Of what does nothing, some lanes have no friction, others that of sign minus: plus 0, all.
    r[0] = at<V>(c.lambda_1[i], lane) / taking.h + V{};
    r[1] = at<V>(c.lambda_2[i], lane) / taking.h + V{};
    r[2] = at<V>(c.lambda[i], lane) / taking.h;
    r[4] = yields > V{} ? 1 / yields : V{};
    r[5] = at<V>(c.s[i], lane);
    const V now = r[2] * r[4];
    r[3] = yields > V{} ? press_after<V>(r[3], now, taking) : V{};
    most = larger<V>(give * smaller<V>(r[3], now), most);
    store_numbers(r, c, lane, begin + ConstraintLines::kLoad);
  }
  store(sag + lane, most);
}

}  // namespace
}  // namespace cradle
