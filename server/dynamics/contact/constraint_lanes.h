// From constraints to blocks and back, for the kernels' files alone (see lanes.h).
//
// A constraint's lines of eight doubles are read whole and transposed: eight numbers of eight
// constraints take 8 loads and 24 moves between lanes, not 64 of each kind. Lanes of
// floats: line_lanes.h. Symbols as in contact_method.h.
#pragma once

#include "server/dynamics/contact/manifold_lanes.h"

namespace cradle {
namespace {

/// Of a line the numbers from `first` up to, not with, `end`, and those that lie with them in a
/// vector: where there is a constraint.
template <class V, int first, int end>
CRADLE_LANES void store_numbers(V* rows, const BlockOf<V>& c, int lane, int begin) {
  constexpr int n = kLanes<V>;
  if constexpr (n == 1) {
    if (c.source[lane] < 0) return;
    for (int k = first; k < end; ++k) c.lines[lane][begin + k] = rows[k];
  } else if constexpr (kIsFloats<V>) {
    static_assert(end - first == 4);
    put_four_rows(rows + first, [&](int l, const FourFloats& four) CRADLE_LAMBDA {
      if (c.source[lane + l] >= 0) store_four(c.lines[lane + l] + begin + first, four);
    });
  } else {
    CRADLE_UNROLLED
    for (int part = first / n; part * n < end; ++part) {
      transpose<V, n / 2>(rows + part * n, std::make_index_sequence<n>{});
      CRADLE_UNROLLED
      for (int l = 0; l < n; ++l) {
        if (c.source[lane + l] < 0) continue;
        store(c.lines[lane + l] + begin + part * n, rows[part * n + l]);
      }
    }
  }
}

/// Of a line of each constraint.
template <class V, int first = 0, int end = kLineNumbers>
CRADLE_LANES void load_numbers(V* to, const BlockOf<V>& c, int lane, int begin) {
  const auto line = [&](int l) CRADLE_LAMBDA { return c.lines[lane + l] + begin; };
  if constexpr (kIsFloats<V> && end - first == kLineNumbers) {
    load_line_rows(to, line);
  } else if constexpr (kIsFloats<V>) {
    static_assert(end - first == 4);
    load_four_rows(to + first, [&](int l) CRADLE_LAMBDA { return line(l) + first; });
  } else {
    load_columns<kLineNumbers, first, end>(to, c.lines + lane, begin);
  }
}

template <class V>
CRADLE_LANES void store3(RowOf<V>* rows, int lane, const Triple<V>& value) {
  store(rows[0] + lane, value.x);
  store(rows[1] + lane, value.y);
  store(rows[2] + lane, value.z);
}

/// How the bodies turn; all zeros if they do not.
template <class V>
CRADLE_LANES void fill_inertia(const BodyLine* responses, const std::int32_t* at, RowOf<V>* rows,
                               int lane) {
  V r[kLineNumbers];
  load_rows(r, responses, at);
  CRADLE_UNROLLED
  for (int k = 0; k < 6; ++k) store(rows[k] + lane, r[k]);
}

template <class V, int points>
CRADLE_LANES void fill_lanes(BlockOf<V>& c, int lane, bool is_round,
                             const BlockFilling<NumberOf<V>>& filling) {
  using Lines = ConstraintLines;
  if (!is_round) {
    fill_inertia<V>(filling.responses, c.a + lane, c.inverse_inertia_A, lane);
    fill_inertia<V>(filling.responses, c.b + lane, c.inverse_inertia_B, lane);
  }
  V r[kLineNumbers];
  load_numbers<V>(r, c, lane, Lines::kFrame);
  const Triple<V> n{r[0], r[1], r[2]}, t1{r[3], r[4], r[5]}, t2 = cross(n, t1);
  store3(c.n, lane, n);
  store3(c.t1, lane, t1);
  store(c.friction + lane, r[6]);
  const V one = fill<V>(1), preload = fill<V>(filling.give) * r[7];
  store(c.sink_share + lane, one - r[7]);

  V K[kLineNumbers];
  load_numbers<V, 0, kBlockPoints>(K, c, lane, Lines::kMasses);
  Triple<V> arms[points], sum{};
  V number{}, zero{};
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const auto is_there = at<V>(point.yields, lane) > V{};
    load_numbers<V>(r, c, lane, Lines::kPoints + i * kLineNumbers);
    const V *const load = r + Lines::kLoad, force = load[2], press = load[3];
    arms[i] = {r[0], r[1], r[2]};
    sum = sum + select(is_there, arms[i], Triple<V>{});
    number = number + (is_there ? one : zero);
    const V rest = filling.rest_loads != nullptr ? at<V>(filling.rest_loads[i], lane) : zero;
    const V lasting = smaller<V>(press, fill<V>(filling.excess) * (force * K[i]));
    const V s0 = is_there ? r[3] - preload * larger<V>(lasting - rest, zero) : zero;
    store(point.s0 + lane, s0);
    store(point.s + lane, s0);
    store(point.lambda_1 + lane, is_there ? fill<V>(filling.h) * load[0] : zero);
    store(point.lambda_2 + lane, is_there ? fill<V>(filling.h) * load[1] : zero);
    store(point.lambda + lane, is_there ? fill<V>(filling.h) * force : zero);
  }
  // The mean of the points: between them every point has a short lever.
  const V share = 1 / larger<V>(number, one);
  const Triple<V> centre = share * sum;
  load_numbers<V>(r, c, lane, Lines::kBodies);
  store3(c.arm_A, lane, centre);
  store3(c.arm_B, lane, centre + Triple<V>{r[0], r[1], r[2]});
  store(c.gap_haste + lane, r[5] > V{} ? fill<V>(kImpactHaste) : one);
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const auto is_there = at<V>(point.yields, lane) > V{};
    const Triple<V> from_centre = arms[i] - centre;
    store(point.u + lane, is_there ? dot(t1, from_centre) : zero);
    store(point.v + lane, is_there ? dot(t2, from_centre) : zero);
  }
}

/// What presses lasts, or grows: soft_batch.cpp.
template <class V>
CRADLE_LANES V press_after(const V& before, const V& now, const BlockTaking& taking) {
  const V next =
      smaller<V>(larger<V>(now, fill<V>(taking.decay) * before), fill<V>(taking.growth) * before);
  return before == V{} ? now : next;
}

template <class V, int points>
CRADLE_LANES void take_lanes(const BlockOf<V>& c, int lane, const BlockTaking& taking,
                             NumberOf<V>* sag) {
  V most = load<V>(sag + lane);
  const V give = fill<V>(taking.give) * at<V>(c.sink_share, lane);
  V K[kLineNumbers], r[kLineNumbers], *const load = r + ConstraintLines::kLoad;
  load_numbers<V, 0, kBlockPoints>(K, c, lane, ConstraintLines::kMasses);
  CRADLE_UNROLLED
  for (int i = 0; i < points; ++i) {
    auto& point = c.points[i];
    const int begin = ConstraintLines::kPoints + i * kLineNumbers;
    const V yields = at<V>(point.yields, lane);
    load_numbers<V, ConstraintLines::kLoad>(r, c, lane, begin);
    // Of what does nothing, some lanes have no friction, others that of sign minus: plus 0, all.
    load[0] = at<V>(point.lambda_1, lane) / fill<V>(taking.h) + V{};
    load[1] = at<V>(point.lambda_2, lane) / fill<V>(taking.h) + V{};
    load[2] = at<V>(point.lambda, lane) / fill<V>(taking.h);
    K[i] = yields > V{} ? 1 / yields : V{};
    const V now = load[2] * K[i];
    load[3] = yields > V{} ? press_after<V>(load[3], now, taking) : V{};
    most = larger<V>(give * smaller<V>(load[3], now), most);
    store_numbers<V, ConstraintLines::kLoad, kLineNumbers>(r, c, lane, begin);
  }
  store_numbers<V, 0, kBlockPoints>(K, c, lane, ConstraintLines::kMasses);
  store(sag + lane, most);
}

}  // namespace
}  // namespace cradle
