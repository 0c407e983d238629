// Which four of more points of two boxes are kept, for the kernels' files alone (see lanes.h).
//
// First those of the last manifold: which four stand for a face must not hang on tenths of a
// millimetre. What leans on five points that all carry tilts toward the one that is left out, and
// back once that has taken the place of another: some cubes of a heap rocked so for good.
// Else as in four_points.h.
#pragma once

#include "server/collision/box_block.h"
#include "server/collision/lanes.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

template <class V>
CRADLE_LANES V endless() {
  return fill<V>(__builtin_inf());
}

/// Whether candidate c is in what is left of a set, a sum of 2^c, from which it is taken: of all,
/// from the last one on.
template <class V>
CRADLE_LANES auto take_out(int c, V& rest) {
  const auto is_in = rest >= fill<V>(1 << c);
  rest = is_in ? rest - (1 << c) : rest;
  return is_in;
}

/// In the frame of the reference face.
template <class V>
struct FacePoints {
  V x[kBoxCandidates], y[kBoxCandidates], z[kBoxCandidates];
  V used[kBoxCandidates];  // 1 or 0
  V inside;

  CRADLE_LANES void set(int c, const Triple<V>& p, const V& is_there, const V& here) {
    x[c] = p.x;
    y[c] = p.y;
    z[c] = p.z;
    used[c] = is_there;
    inside = is_there > V{} ? larger<V>(inside, here) : inside;
  }
};

/// A candidate c; `bit`: 2^c, or 0 if there is none.
template <class V>
struct Chosen {
  V x, y, bit;
};

/// The candidate that scores highest: the first of those that score no less than that but for
/// `tie(highest)`. None if the highest is not above `least`.
template <class V, class Score, class Tie>
CRADLE_LANES Chosen<V> choose(const FacePoints<V>& points, const V& least, Score score, Tie tie) {
  V scores[kBoxCandidates], highest = -endless<V>();
  for (int c = 0; c < kBoxCandidates; ++c) {
    const V now = score(c);
    scores[c] = points.used[c] > V{} ? now : -endless<V>();
    highest = larger<V>(scores[c], highest);
  }
  const V enough = highest - tie(highest);
  Chosen<V> best{};
  for (int c = kBoxCandidates - 1; c >= 0; --c) {
    const auto is_less = scores[c] < enough;
    best.x = is_less ? best.x : points.x[c];
    best.y = is_less ? best.y : points.y[c];
    best.bit = is_less ? best.bit : fill<V>(1 << c);
  }
  best.bit = highest > least ? best.bit : V{};
  return best;
}

/// The bit, or 0 if it is one of the others.
template <class V, class... Bits>
CRADLE_LANES V unless_in(const V& bit, const Bits&... others) {
  V left = bit;
  ((left = bit == others ? V{} : left), ...);
  return left;
}

/// The deepest, the farthest from it, and those two that then add most area, on both sides if there
/// are points on both: as four_points.h, but that what adds nothing is left out. Sum of 2^c. `gap`:
/// what a point that does not touch may be higher by than the deepest.
template <class V>
CRADLE_LANES V choose_four(const FacePoints<V>& points, const V& gap) {
  constexpr double kTie = kTolerances.tie_m;
  V lowest = endless<V>(), weights[kBoxCandidates];
  for (int c = 0; c < kBoxCandidates; ++c) {
    lowest = smaller<V>(points.used[c] > V{} ? points.z[c] : endless<V>(), lowest);
  }
  for (int c = 0; c < kBoxCandidates; ++c) {
    const auto may_carry = larger<V>(points.z[c], V{}) - larger<V>(lowest, V{}) <= gap;
    weights[c] = may_carry ? fill<V>(1) : fill<V>(kTolerances.gap_weight);
  }
  const auto p = choose<V>(
      points, -endless<V>(), [&](int c) CRADLE_LAMBDA { return -points.z[c]; },
      [](const V&) CRADLE_LAMBDA { return fill<V>(kTie); });
  const auto q = choose<V>(
      points, fill<V>(kTie * kTie),
      [&](int c) CRADLE_LAMBDA {
        const V dx = points.x[c] - p.x, dy = points.y[c] - p.y;
        return weights[c] * (dx * dx + dy * dy);
      },
      [](const V& highest) CRADLE_LAMBDA { return 2 * kTie * root<V>(highest); });
  const V q_x = q.x - p.x, q_y = q.y - p.y;
  const V tie = kTie * root<V>(q_x * q_x + q_y * q_y);
  const auto by_area = [&](const V&) CRADLE_LAMBDA { return tie; };
  const auto r = choose<V>(
      points, tie,
      [&](int c) CRADLE_LAMBDA {
        return weights[c] * size_of<V>(q_x * (points.y[c] - p.y) - q_y * (points.x[c] - p.x));
      },
      by_area);
  const V r_x = r.x - p.x, r_y = r.y - p.y;
  const V area = q_x * r_y - q_y * r_x, turn = area < V{} ? fill<V>(-1) : fill<V>(1);
  const auto s = choose<V>(
      points, tie,
      [&](int c) CRADLE_LAMBDA {
        const V s_x = points.x[c] - p.x, s_y = points.y[c] - p.y;
        const V of_q = turn * (q_x * s_y - q_y * s_x), of_r = turn * (s_x * r_y - s_y * r_x);
        return -weights[c] * smaller<V>(smaller<V>(of_q, of_r), turn * area - of_q - of_r);
      },
      by_area);
  // Where all are near to each other one may be chosen twice.
  return p.bit + unless_in<V>(q.bit, p.bit) + unless_in<V>(r.bit, p.bit, q.bit) +
         unless_in<V>(s.bit, p.bit, q.bit, r.bit);
}

template <class V>
struct Extent {
  V low = endless<V>(), high = -endless<V>();

  CRADLE_LANES void add(const V& is_in, const V& value) {
    low = is_in > V{} ? smaller<V>(low, value) : low;
    high = is_in > V{} ? larger<V>(high, value) : high;
  }
};

/// The four of last time, if they are all there, nearly as deep as any and spread nearly as far;
/// the deepest of them then stands for the deepest of all, as `lower` has it (box_facing.cpp). Else
/// another four. Of lanes where there are more than four.
template <class V, class M>
CRADLE_LANES V choose_four_again(const FacePoints<V>& points, const M& are_many, BoxFaceBlock& b,
                                 int lane, const V& slack) {
  const V last = load<V>(b.last_set + lane), one = fill<V>(1), none{};
  Extent<V> x, y, z, last_x, last_y, last_z;
  V rest = last, count{}, was_last[kBoxCandidates];
  for (int c = kBoxCandidates - 1; c >= 0; --c) {
    const auto is_last = take_out<V>(c, rest);
    was_last[c] = is_last ? points.used[c] : none;
    count = count + was_last[c];
    x.add(points.used[c], points.x[c]);
    y.add(points.used[c], points.y[c]);
    z.add(points.used[c], points.z[c]);
    last_x.add(was_last[c], points.x[c]);
    last_y.add(was_last[c], points.y[c]);
    last_z.add(was_last[c], points.z[c]);
  }
  constexpr double kSpread = kTolerances.last_four_spread;
  const V last_faces = load<V>(b.last_faces + lane), faces = load<V>(b.faces + lane);
  const V deeper = last_z.low - z.low;
  const V least_x = kSpread * (x.high - x.low), least_y = kSpread * (y.high - y.low);
  const V last_width = last_x.high - last_x.low, last_depth = last_y.high - last_y.low;
  const auto stay = (last_faces == faces) & (count == 4 * one) &
                    (deeper <= kTolerances.last_four_depth * slack) & (last_width >= least_x) &
                    (last_depth >= least_y);
  const V stays = stay ? one : none, lower = stay ? deeper : none;
  const V per_near = one / (kTolerances.as_deep * slack);
  for (int c = 0; c < kBoxCandidates; ++c) {
    const V share = larger<V>(one - (points.z[c] - last_z.low) * per_near, none);
    store(b.z[c] + lane, was_last[c] > none ? points.z[c] - lower * share : points.z[c]);
  }
  return any<V>(are_many & (stays == none))
             ? (stay ? last : choose_four<V>(points, kTolerances.carrying_gap * slack))
             : last;
}

}  // namespace
}  // namespace cradle
