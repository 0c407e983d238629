// Which balls of the cells around may meet one, by the bound of ball_grid.cpp, for the kernels'
// files alone (see lanes.h): four balls of each of as many rows at once as a vector has room for.
// Rows are short: mostly four are all. Every lane rounds as a float does, so that results are the
// same bits at every width.
#pragma once

#include <utility>

#include "server/collision/lanes.h"
#include "server/dynamics/impact/ball_kernel.h"

namespace cradle {
namespace {

using FourBalls = float __attribute__((vector_size(16)));
using EightBalls = float __attribute__((vector_size(32)));

/// Four numbers from each of these places on.
template <class V>
CRADLE_LANES V load_fours(const float* from, const std::uint32_t* places) {
  if constexpr (sizeof(V) == sizeof(FourBalls)) {
    V v;
    __builtin_memcpy(&v, from + places[0], sizeof v);
    return v;
  } else {
    const auto a = load_fours<FourBalls>(from, places);
    const auto b = load_fours<FourBalls>(from, places + 1);
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
  }
}

/// Balls by their columns in memory, or one of them in all lanes.
template <class T>
struct BallColumns {
  T x, y, z, vx, vy, vz, radius;
};

CRADLE_LANES BallColumns<const float*> columns_of(const BallCells& cells) {
  const float* const x = cells.x;
  const std::size_t next = cells.stride;
  return {x, x + next, x + 2 * next, x + 3 * next, x + 4 * next, x + 5 * next, x + 6 * next};
}

template <class V, std::size_t... l>
CRADLE_LANES V in_all_lanes(float value, std::index_sequence<l...>) {
  return V{(static_cast<void>(l), value)...};
}
template <class V>
CRADLE_LANES V in_all_lanes(float value) {
  return in_all_lanes<V>(value, std::make_index_sequence<sizeof(V) / sizeof(float)>{});
}
template <class V>
CRADLE_LANES BallColumns<V> in_all_lanes(const BallColumns<const float*>& c, std::uint32_t at) {
  return {in_all_lanes<V>(c.x[at]),     in_all_lanes<V>(c.y[at]),  in_all_lanes<V>(c.z[at]),
          in_all_lanes<V>(c.vx[at]),    in_all_lanes<V>(c.vy[at]), in_all_lanes<V>(c.vz[at]),
          in_all_lanes<V>(c.radius[at])};
}

/// One ball beside those from these places on: a bit for each that it may meet.
template <class V>
CRADLE_LANES std::uint32_t may_meet(const BallColumns<const float*>& c, const BallColumns<V>& ball,
                                    const std::uint32_t* places, const V& slack,
                                    const V& twice_dt) {
  const V dx = load_fours<V>(c.x, places) - ball.x;
  const V dy = load_fours<V>(c.y, places) - ball.y;
  const V dz = load_fours<V>(c.z, places) - ball.z;
  const V ux = load_fours<V>(c.vx, places) - ball.vx;
  const V uy = load_fours<V>(c.vy, places) - ball.vy;
  const V uz = load_fours<V>(c.vz, places) - ball.vz;
  const V R = load_fours<V>(c.radius, places) + ball.radius;
  const V nearing = twice_dt * (dx * ux + dy * uy + dz * uz);
  const V least = nearing < V{} ? nearing : V{};
  return signs_of(dx * dx + dy * dy + dz * dz + least - R * R - slack);
}

/// A bit for each of the first four of a row that is one.
CRADLE_LANES std::uint32_t bits_within(std::uint32_t begin, std::uint32_t end) {
  const std::uint32_t count = end - begin;
  return (1U << (count < 4 ? count : 4)) - 1;
}

/// The rows beside a cell that are looked at together: where their balls are.
struct RowsBeside {
  std::uint32_t places[kBallRows];     // of the first of each; that of row 0 is the ball's next
  std::uint32_t within = 0, more = 0;  // as in hits
};

CRADLE_LANES RowsBeside rows_beside(const BallCells& cells, std::uint32_t at) {
  const std::uint32_t* const cell = cells.begins + cells.cells[at];
  RowsBeside rows;
  for (std::size_t r = 0; r < kBallRows; ++r) {
    const std::uint32_t* const middle = cell + row_after(cells, r);
    const std::uint32_t begin = r == 0 ? at + 1 : middle[-1], end = middle[2];
    rows.places[r] = begin;
    rows.within |= bits_within(begin, end) << (4 * r);
    rows.more |= end - begin > 4 ? kMoreBalls : 0;
  }
  return rows;
}

/// Ball by ball, not cell by cell: most cells are empty or have one, which nobody can foresee.
template <class V>
void look(const BallCells& of_grid, std::uint32_t begin, std::uint32_t end,
          std::uint32_t* __restrict hits) {
  constexpr std::size_t rows_at_once = sizeof(V) / sizeof(FourBalls);
  const BallCells cells = of_grid;  // nothing that is written could be part of it
  const BallColumns<const float*> columns = columns_of(cells);
  const auto slack = in_all_lanes<V>(cells.slack), twice_dt = in_all_lanes<V>(cells.twice_dt);
  const auto slack_4 = in_all_lanes<FourBalls>(cells.slack);
  const auto twice_dt_4 = in_all_lanes<FourBalls>(cells.twice_dt);
  for (std::uint32_t at = begin; at < end; ++at) {
    const RowsBeside rows = rows_beside(cells, at);
    const auto ball = in_all_lanes<V>(columns, at);
    const auto ball_4 = in_all_lanes<FourBalls>(columns, at);
    std::uint32_t found = may_meet(columns, ball_4, rows.places, slack_4, twice_dt_4);
    for (std::size_t r = 1; r < kBallRows; r += rows_at_once) {
      found |= may_meet(columns, ball, rows.places + r, slack, twice_dt) << (4 * r);
    }
    hits[at] = (found & rows.within) | rows.more;
  }
}

}  // namespace
}  // namespace cradle
