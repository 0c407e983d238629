/// Which balls may meet within a tick, by a grid over where they are when it begins.
///
/// Seen by one that falls as they do, at their mean velocity, balls go straight on. A ball belongs
/// to the cell of its centre, and no two that may meet are further apart than a cell is wide:
/// ball_grid.cpp. The grid stays as it is for the tick; who has deviated since is noted beside it.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include "server/collision/box_lanes.h"
#include "server/collision/broad_phase.h"
#include "server/collision/executor.h"
#include "server/collision/pair_parts.h"
#include "server/collision/pair_rules.h"
#include "server/dynamics/impact/ball_kernel.h"
#include "server/dynamics/impact/balls.h"

namespace cradle {

class BallGrid {
  /// What follows from the fastest ball, and from the one that is farthest out.
  struct Measure {
    double speed_max = 0;       // m/s, about the mean velocity
    double coordinate_max = 0;  // m
    double fall = 0;            // m: at most so far is a ball from where falling would bring it
    double reach = 0;           // m: no two that are further apart may meet
    float slack = 0;            // m^2, for rounding
  };

 public:
  /// Cells of planes across z, which follow each other; or all there are.
  struct Slab {
    static constexpr std::uint32_t kEnd = std::numeric_limits<std::uint32_t>::max();
    std::uint32_t begin = 0, end = kEnd;

    bool is_all() const { return begin == 0 && end == kEnd; }
  };
  /// Balls that go where the grid does not know.
  class Deviations {
    friend class BallGrid;
    std::vector<std::uint8_t> places_;  // a bit each
    Measure measure_;
  };

  /// For a tick of `dt` seconds. False, and no use, if these balls do not suit a grid: too many
  /// share a cell, since radii or speeds differ, or they overlap. A rule that looks at nothing
  /// else.
  bool build(Executor& executor, std::span<const Ball> balls, double dt, const Vector& v_mean,
             const Vector& gravity);

  /// Replaces `pairs` by those, of balls, that meet in the tick or touch, and some that do not:
  /// sorted, each once. Returns the cells looked at.
  /// `lanes`: as many doubles abreast, see kernels_of_width; the result does not depend on it.
  std::int64_t find_pairs(Executor& executor, int lanes, std::vector<BodyPair>& pairs);

  /// There are none yet.
  void begin(Deviations& deviations) const;
  /// An impact has changed it.
  void note(Deviations& deviations, std::int32_t number, const Ball& ball) const;

  /// Calls `visit(number)` for the others that this ball, as it goes now, may meet between `now`
  /// and the tick's end, or touch; and for some more: how many depends on what was noted.
  template <class F>
  void for_each_near(const Deviations& deviations, std::int32_t number, const Ball& ball,
                     double now, F&& visit) const;

  /// Calls `visit(number)` for those that are in a box when the tick begins, and for some beside.
  template <class F>
  void for_each_in(const Aabb& box, F&& visit) const;

  /// Planes of cells across z, with those at the rim.
  std::int32_t planes() const { return static_cast<std::int32_t>(size_[2]); }
  /// That has so many of `denominator` of the balls before it.
  std::int32_t plane_after(std::size_t numerator, std::size_t denominator) const;
  /// How many planes two balls that may meet are apart, at most.
  std::int32_t planes_apart(const Deviations& deviations) const;
  Slab slab(std::int32_t first_plane, std::int32_t end_plane) const;
  /// So many planes before the cell that begins one, and after.
  Slab around(std::uint32_t cell, std::int32_t planes) const;
  /// Where the ball was when the tick began.
  bool is_in(const Slab& slab, std::int32_t number) const {
    if (slab.is_all()) return true;  // also of balls that suit no grid
    const std::uint32_t cell = cells_of_[static_cast<std::size_t>(number)];
    return slab.begin <= cell && cell < slab.end;
  }

  double radius_min() const { return radius_min_; }  ///< m
  double radius_max() const { return radius_max_; }
  double speed_max() const { return measure_.speed_max; }  ///< m/s, about the mean velocity

 private:
  using Four = FourFloats;
  struct Range {
    std::uint32_t begin, end;  // of places
  };
  using Cell = std::int32_t __attribute__((vector_size(16)));  // x, y, z
  /// A ball in the grid's numbers.
  struct Point {
    Four x, v_and_radius;
  };
  struct Bounds {
    Vector lower, upper;  // of centres, m
    double radius_min, radius_max, speed2;
  };
  /// A ball in all lanes, to look at others four at once, from `now` on.
  struct Probe {
    Four x, y, z, vx, vy, vz, radius, slack, now, twice_left;
  };

  Bounds bounds_of(Executor& executor, std::span<const Ball> balls);
  bool choose_cells(std::span<const Ball> balls, const Bounds& bounds);
  bool count(Executor& executor, std::span<const Ball> balls);
  void sort(Executor& executor, std::span<const Ball> balls);
  Point point(const Ball& ball) const;
  void write(const Point& point, std::size_t place);

  void set_reach(Measure& measure) const;
  Cell cell_of(const Four& x) const;
  std::uint32_t number_of(const Cell& cell) const { return number_of(cell[0], cell[1], cell[2]); }
  std::uint32_t number_of(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const auto row = static_cast<std::uint32_t>(z) * size_[1] + static_cast<std::uint32_t>(y);
    return row * size_[0] + static_cast<std::uint32_t>(x);
  }
  const float* column(std::size_t k) const { return columns_.data() + k * stride_; }
  static Four four(const float* from) {
    Four f;
    std::memcpy(&f, from, sizeof f);
    return f;
  }
  Probe probe(const Point& ball, const Measure& measure, double now) const;
  unsigned may_meet(const Probe& ball, std::uint32_t place) const;
  static unsigned deviated(const Deviations& deviations, std::uint32_t place);
  BallCells cells() const;
  void decode(std::uint32_t place, std::uint32_t hits, std::vector<BodyPair>& found) const;
  template <class F>
  void for_each_row(const Vector& lower, const Vector& upper, F&& visit) const;

  double dt_ = 0;
  double fall_from_rest_ = 0;  // m, see Measure::fall, once an impact may have put a ball to rest
  Measure measure_;
  Vector v_mean_ = Vector::Zero(), origin_ = Vector::Zero();
  double radius_min_ = 0, radius_max_ = 0;
  Four first_cell_{}, last_cell_{};  // where cells begin, m from origin_; the last along each axis
  float cells_per_m_ = 0;
  std::uint32_t size_[3] = {};         // cells, with those at the rim, which stay empty
  std::vector<std::uint32_t> begins_;  // of each cell in what follows, and the end
  std::vector<std::int32_t> numbers_;  // of the balls, in the order of the cells
  std::vector<std::uint32_t> places_;  // of each ball in that order
  std::vector<float> columns_;         // in that order: x, y, z, v and radius, an array each
  std::size_t stride_ = 0;
  std::vector<std::uint32_t> cells_of_;  // by number
  std::vector<std::uint32_t> cells_at_;  // by place
  std::vector<Point> points_;            // by number
  std::vector<std::uint32_t> hits_;      // by place: BallKernels
  std::vector<Bounds> bounds_of_parts_;
  PairParts parts_;
  PairSorter sorter_;
};

/// Never turns order around: of two coordinates the larger has no smaller cell.
inline BallGrid::Cell BallGrid::cell_of(const Four& x) const {
  Four cell = (x - first_cell_) * cells_per_m_;
  cell = cell < Four{} ? Four{} : cell;
  cell = cell > last_cell_ ? last_cell_ : cell;
  return __builtin_convertvector(cell, Cell) + 1;
}

inline BallGrid::Probe BallGrid::probe(const Point& ball, const Measure& measure,
                                       double now) const {
  const auto all = [](float value) { return Four{value, value, value, value}; };
  return {all(ball.x[0]),
          all(ball.x[1]),
          all(ball.x[2]),
          all(ball.v_and_radius[0]),
          all(ball.v_and_radius[1]),
          all(ball.v_and_radius[2]),
          all(ball.v_and_radius[3]),
          all(measure.slack),
          all(static_cast<float>(now)),
          all(static_cast<float>(2 * (dt_ - now)))};
}

/// Bit k: the ball at `place + k` may meet it.
inline unsigned BallGrid::may_meet(const Probe& ball, std::uint32_t place) const {
  const float* const at = columns_.data() + place;
  const Four ux = four(at + 3 * stride_) - ball.vx, uy = four(at + 4 * stride_) - ball.vy,
             uz = four(at + 5 * stride_) - ball.vz;
  const Four dx = four(at) - ball.x + ball.now * ux;
  const Four dy = four(at + stride_) - ball.y + ball.now * uy;
  const Four dz = four(at + 2 * stride_) - ball.z + ball.now * uz;
  const Four R = four(at + 6 * stride_) + ball.radius;
  const Four nearing = ball.twice_left * (dx * ux + dy * uy + dz * uz);
  const Four least = nearing < Four{} ? nearing : Four{};
  return signs_of(dx * dx + dy * dy + dz * dz + least - R * R - ball.slack);
}

/// Likewise: it has deviated.
inline unsigned BallGrid::deviated(const Deviations& deviations, std::uint32_t place) {
  std::uint16_t bits;
  std::memcpy(&bits, deviations.places_.data() + place / 8, sizeof bits);
  return (unsigned{bits} >> place % 8) & 15U;
}

template <class F>
void BallGrid::for_each_row(const Vector& lower, const Vector& upper, F&& visit) const {
  const auto cell_at = [this](const Vector& x, double rounding) {
    const auto cut = [&](int k) {
      return static_cast<float>(
          std::clamp(x[k] - origin_[k] + rounding, -kFloatReach, kFloatReach));
    };
    return cell_of(Four{cut(0), cut(1), cut(2), 0});
  };
  const double rounding = 1e-6 * measure_.coordinate_max;  // of a float, sixteen times
  const Cell low = cell_at(lower, -rounding), high = cell_at(upper, rounding);
  for (std::int32_t z = low[2]; z <= high[2]; ++z) {
    for (std::int32_t y = low[1]; y <= high[1]; ++y) {
      const Range row{begins_[number_of(low[0], y, z)], begins_[number_of(high[0], y, z) + 1]};
      if (row.begin < row.end) visit(row);
    }
  }
}

template <class F>
void BallGrid::for_each_near(const Deviations& deviations, std::int32_t number, const Ball& ball,
                             double now, F&& visit) const {
  const std::uint32_t place = places_[static_cast<std::size_t>(number)];
  const Probe one = probe(point(ball), deviations.measure_, now);
  const Vector v = ball.v - v_mean_, here = ball.x + now * v, there = ball.x + dt_ * v;
  // The other may have come as far from where it was.
  constexpr double kRounding = 1 + 1e-6;
  const double radius = kRounding * (1 + kStruckTogether) * ball.radius;
  const Vector r = Vector::Constant(radius + deviations.measure_.reach / 2);
  for_each_row(here.cwiseMin(there) - r, here.cwiseMax(there) + r, [&](const Range& row) {
    for (std::uint32_t at = row.begin; at < row.end; at += kFloatLanes) {
      unsigned hits = may_meet(one, at) | deviated(deviations, at);
      if (row.end - at < kFloatLanes) hits &= (1U << (row.end - at)) - 1;
      for (; hits != 0; hits &= hits - 1) {
        const std::uint32_t other = at + static_cast<std::uint32_t>(std::countr_zero(hits));
        if (other != place) visit(numbers_[other]);
      }
    }
  });
}

template <class F>
void BallGrid::for_each_in(const Aabb& box, F&& visit) const {
  for_each_row(box.lower, box.upper, [&](const Range& row) {
    for (std::uint32_t at = row.begin; at < row.end; ++at) visit(numbers_[at]);
  });
}

}  // namespace cradle
