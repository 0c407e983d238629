// Two balls with distance d and relative velocity u touch within a time h only if, at some t of it,
//   |d + t u|^2 <= R^2,  and so, since t^2 u^2 >= 0,  d^2 + min(0, 2 h d . u) <= R^2:
// no root, no division, no branch, and few pass that do not meet. The grid is that of molecular
// dynamics (Quentrec and Brot 1973; Allen and Tildesley, "Computer Simulation of Liquids", 5.3):
// cells as wide as
//   L = 2 r_max + 2 h v_max,
// so that a ball is looked at with those after it in its own cell, and with half of the 26 cells
// around, which are five rows in memory.
//
// In single precision: with unit roundoff e = 2^-24, coordinates up to X and distances up to L, d
// and u are wrong by at most 2 sqrt(3) e (X + L) and, times h, 2 sqrt(3) e L; the sum of three
// squares and three products is then by less than 64 e L (X + L). Twice that is allowed for, since
// after impacts d is that of a later time. Who passes is asked again in double: results do not
// depend on any of this.
//
// Cost: O(n), 25 ns a ball (Zen 5) where there is one a cell.
#include "server/dynamics/impact/ball_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "server/collision/fetch.h"
#include "server/collision/index.h"
#include "server/collision/machine_lanes.h"

namespace cradle {
namespace {

constexpr std::size_t kBalls = 1024;        // worth a thread, at some nanoseconds each
constexpr std::size_t kSharedPerBall = 16;  // places in a ball's cell, on average, at most
constexpr double kCellsPerBall = 4;         // at most: beyond, cells are wider
constexpr double kGridRounding = 0x1p-17;   // 128 e

const BallKernels& ball_kernels_of(int lanes) {
#ifdef CRADLE_WIDE_X86
  return kernels_of_width<BallKernels>(
      lanes, {&kBallKernels1, &kBallKernels2, &kBallKernels4, &kBallKernels8});
#else
  return kernels_of_width<BallKernels>(lanes, {&kBallKernels1, &kBallKernels2});
#endif
}

/// Where nearly all balls are along an axis: 5 to 95 of 100 of a sample, and as much beyond as an
/// even crowd has. Whoever is outside belongs to the cells at the rim.
std::array<double, 2> extent(std::span<const Ball> balls, int axis) {
  constexpr std::size_t most = 61;
  const std::size_t count = std::min(most, balls.size());
  std::array<double, most> sample;
  for (std::size_t i = 0; i < count; ++i) sample[i] = balls[i * balls.size() / count].x[axis];
  std::sort(sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(count));
  const double low = sample[count / 20], high = sample[count - 1 - count / 20];
  const double beyond = 0.12 * (high - low);
  return {low - beyond, high + beyond};
}

}  // namespace

bool BallGrid::build(Executor& executor, std::span<const Ball> balls, double dt,
                     const Vector& v_mean, const Vector& gravity) {
  if (balls.empty()) return false;
  dt_ = dt;
  v_mean_ = v_mean;
  fall_from_rest_ = gravity.norm() * dt * dt;
  const Bounds bounds = bounds_of(executor, balls);
  radius_min_ = bounds.radius_min;
  radius_max_ = bounds.radius_max;
  measure_ = {};
  measure_.speed_max = std::sqrt(bounds.speed2);
  if (!choose_cells(balls, bounds) || !count(executor, balls)) return false;
  sort(executor, balls);
  return true;
}

BallGrid::Bounds BallGrid::bounds_of(Executor& executor, std::span<const Ball> balls) {
  bounds_of_parts_.resize(chunks_of(balls.size(), kBalls));
  for_chunks(executor, balls.size(), kBalls,
             [&](std::size_t part, std::size_t begin, std::size_t end) {
               Bounds bounds{balls[begin].x, balls[begin].x, balls[begin].radius, 0, 0};
               for (std::size_t i = begin; i < end; ++i) {
                 const Ball& ball = balls[i];
                 bounds.lower = bounds.lower.cwiseMin(ball.x);
                 bounds.upper = bounds.upper.cwiseMax(ball.x);
                 bounds.radius_min = std::min(bounds.radius_min, ball.radius);
                 bounds.radius_max = std::max(bounds.radius_max, ball.radius);
                 bounds.speed2 = std::max(bounds.speed2, (ball.v - v_mean_).squaredNorm());
               }
               bounds_of_parts_[part] = bounds;
             });
  Bounds all = bounds_of_parts_[0];
  for (const Bounds& part : bounds_of_parts_) {
    all.lower = all.lower.cwiseMin(part.lower);
    all.upper = all.upper.cwiseMax(part.upper);
    all.radius_min = std::min(all.radius_min, part.radius_min);
    all.radius_max = std::max(all.radius_max, part.radius_max);
    all.speed2 = std::max(all.speed2, part.speed2);
  }
  return all;
}

void BallGrid::set_reach(Measure& m) const {
  m.reach = 2 * (1 + kStruckTogether) * radius_max_ + 2 * dt_ * m.speed_max + 4 * m.fall;
  m.slack = static_cast<float>(kGridRounding * m.reach * (m.coordinate_max + m.reach) +
                               2 * m.reach * m.fall);
}

bool BallGrid::choose_cells(std::span<const Ball> balls, const Bounds& bounds) {
  Vector lower, widths;
  for (int k = 0; k < 3; ++k) {
    const auto [low, high] = extent(balls, k);
    lower[k] = std::max(low, bounds.lower[k]);
    widths[k] = std::max(std::min(high, bounds.upper[k]) - lower[k], 0.0);
  }
  origin_ = lower + widths / 2;
  const double out = (bounds.upper - origin_).cwiseMax(origin_ - bounds.lower).maxCoeff();
  measure_.coordinate_max = out;
  set_reach(measure_);
  double side = 1.001 * measure_.reach + 2 * kGridRounding * out;
  if (!(side > 0 && side + out < kFloatReach)) return false;
  const double cells_max = kCellsPerBall * static_cast<double>(balls.size()) + 64;
  const auto cells = [&](int k) { return 1 + std::floor(widths[k] / side); };
  for (; cells(0) * cells(1) * cells(2) > cells_max; side *= 1.26) {
  }
  cells_per_m_ = static_cast<float>(1 / side);
  for (int k = 0; k < 3; ++k) {
    first_cell_[k] = static_cast<float>(lower[k] - origin_[k]);
    last_cell_[k] = static_cast<float>(cells(k) - 1);
    size_[k] = static_cast<std::uint32_t>(cells(k)) + 2;
  }
  return true;
}

/// Which cell each ball is in, and how many are in each.
bool BallGrid::count(Executor& executor, std::span<const Ball> balls) {
  cells_of_.resize(balls.size());
  points_.resize(balls.size());
  for_each_index(executor, balls.size(), kBalls, [&](std::size_t i) {
    const Point at = point(balls[i]);
    points_[i] = at;
    cells_of_[i] = number_of(cell_of(at.x));
  });
  const std::size_t cells = std::size_t{size_[0]} * size_[1] * size_[2] + 1;
  if (cells > begins_.capacity())
    begins_.reserve(2 * cells);  // their number varies with the speeds
  begins_.assign(cells, 0);
  for (const std::uint32_t cell : cells_of_) ++begins_[cell];
  std::size_t shared = 0;
  std::uint32_t sum = 0;
  for (std::uint32_t& cell : begins_) {
    shared += std::size_t{cell} * cell;
    sum += std::exchange(cell, sum);
  }
  return shared <= kSharedPerBall * balls.size();
}

void BallGrid::sort(Executor& executor, std::span<const Ball> balls) {
  numbers_.resize(balls.size());
  places_.resize(balls.size());
  cells_at_.resize(balls.size());
  stride_ = balls.size() + kFloatLanes;  // a read of four may begin at the last
  columns_.resize(7 * stride_);
  for (std::size_t i = 0; i < balls.size(); ++i) {
    numbers_[begins_[cells_of_[i]]++] = static_cast<std::int32_t>(i);
  }
  for_each_index(executor, balls.size(), kBalls, [&](std::size_t place) {
    constexpr std::size_t kAhead = 8;
    if (place + kAhead < balls.size()) {
      fetch(&points_[index(numbers_[place + kAhead])]);
    }
    const std::size_t i = index(numbers_[place]);
    cells_at_[place] = cells_of_[i];
    places_[i] = static_cast<std::uint32_t>(place);
    write(points_[i], place);
  });
  // Each now tells where its cell ends.
  std::copy_backward(begins_.begin(), begins_.end() - 1, begins_.end());
  begins_[0] = 0;
}

BallGrid::Point BallGrid::point(const Ball& ball) const {
  const auto at = [](const Vector& x, const Vector& origin, int k) {
    return static_cast<float>(x[k] - origin[k]);
  };
  const auto radius = static_cast<float>((1 + kStruckTogether) * ball.radius);
  return {Four{at(ball.x, origin_, 0), at(ball.x, origin_, 1), at(ball.x, origin_, 2), 0},
          Four{at(ball.v, v_mean_, 0), at(ball.v, v_mean_, 1), at(ball.v, v_mean_, 2), radius}};
}

void BallGrid::write(const Point& point, std::size_t place) {
  float* const at = columns_.data() + place;
  for (int k = 0; k < 3; ++k) at[static_cast<std::size_t>(k) * stride_] = point.x[k];
  for (int k = 0; k < 4; ++k) at[static_cast<std::size_t>(3 + k) * stride_] = point.v_and_radius[k];
}

void BallGrid::begin(Deviations& deviations) const {
  deviations.places_.assign(numbers_.size() / 8 + 2, 0);  // and what is read with the last one
  deviations.measure_ = measure_;
}

void BallGrid::note(Deviations& deviations, std::int32_t number, const Ball& ball) const {
  const std::uint32_t place = places_[index(number)];
  deviations.places_[place / 8] |= static_cast<std::uint8_t>(1U << place % 8);
  Measure& m = deviations.measure_;
  m.speed_max = std::max(m.speed_max, (ball.v - v_mean_).norm());
  m.coordinate_max = std::max(m.coordinate_max, (ball.x - origin_).cwiseAbs().maxCoeff());
  m.fall = fall_from_rest_;
  set_reach(m);
}

std::int32_t BallGrid::plane_after(std::size_t numerator, std::size_t denominator) const {
  const std::size_t place = numerator * numbers_.size() / denominator;
  if (place >= numbers_.size()) return planes();
  return static_cast<std::int32_t>(cells_at_[place] / (size_[0] * size_[1]));
}

std::int32_t BallGrid::planes_apart(const Deviations& deviations) const {
  constexpr double kRounding = 2e-4;  // of cells, in single precision
  const double apart = std::ceil(deviations.measure_.reach * double{cells_per_m_} + kRounding);
  return static_cast<std::int32_t>(std::min<double>(apart, planes()));
}

BallGrid::Slab BallGrid::slab(std::int32_t first_plane, std::int32_t end_plane) const {
  const auto cells_before = [this](std::int32_t plane) {
    return static_cast<std::uint32_t>(std::clamp(plane, 0, planes())) * size_[0] * size_[1];
  };
  return {cells_before(first_plane), cells_before(end_plane)};
}

BallGrid::Slab BallGrid::around(std::uint32_t cell, std::int32_t planes) const {
  const auto plane = static_cast<std::int32_t>(cell / (size_[0] * size_[1]));
  return slab(plane - planes, plane + planes);
}

BallCells BallGrid::cells() const {
  return {columns_.data(),
          stride_,
          cells_at_.data(),
          begins_.data(),
          {size_[0], size_[1], size_[2]},
          measure_.slack,
          static_cast<float>(2 * dt_)};
}

std::int64_t BallGrid::find_pairs(Executor& executor, int lanes, std::vector<BodyPair>& pairs) {
  pairs.clear();
  hits_.resize(numbers_.size());
  const BallCells all = cells();
  const BallKernels& kernels = ball_kernels_of(lanes);
  const std::uint32_t ny = size_[1] - 2, nz = size_[2] - 2;
  const auto look = [&](std::size_t begin, std::size_t end, std::vector<BodyPair>& found) {
    for (std::size_t row = begin; row < end; ++row) {
      const auto y = static_cast<std::int32_t>(1 + row % ny);
      const auto z = static_cast<std::int32_t>(1 + row / ny);
      const std::uint32_t first = number_of(1, y, z);
      const Range places{begins_[first], begins_[first + size_[0] - 2]};
      kernels.look(all, places.begin, places.end, hits_.data());
      for (std::uint32_t at = places.begin; at < places.end; ++at) {
        if (hits_[at] != 0) decode(at, hits_[at], found);
      }
    }
    return static_cast<std::int64_t>((end - begin) * (size_[0] - 2));
  };
  const std::int64_t seen = parts_.find(executor, std::size_t{ny} * nz, pairs, look);
  sorter_.sort(numbers_.size(), pairs);
  return seen;
}

void BallGrid::decode(std::uint32_t place, std::uint32_t hits, std::vector<BodyPair>& found) const {
  const std::int32_t number = numbers_[place];
  const std::uint32_t cell = cells_at_[place];
  const BallCells all = cells();
  const auto row = [&](std::size_t r) {
    const std::uint32_t middle = cell + row_after(all, r);
    return Range{r == 0 ? place + 1 : begins_[middle - 1], begins_[middle + 2]};
  };
  const auto add = [&](std::uint32_t other) {
    const auto [a, b] = std::minmax(number, numbers_[other]);
    found.push_back({a, b});
  };
  for (std::uint32_t left = hits & ~kMoreBalls; left != 0; left &= left - 1) {
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
    add(row(bit / 4).begin + bit % 4);
  }
  if ((hits & kMoreBalls) == 0) return;
  const auto at_place = [&](std::size_t k) { return column(k)[place]; };
  const Probe ball = probe({Four{at_place(0), at_place(1), at_place(2), 0},
                            Four{at_place(3), at_place(4), at_place(5), at_place(6)}},
                           measure_, 0);
  for (std::size_t r = 0; r < kBallRows; ++r) {
    const auto [begin, end] = row(r);
    for (std::uint32_t at = begin + 4; at < end; at += 4) {
      for (unsigned more = may_meet(ball, at); more != 0; more &= more - 1) {
        const std::uint32_t other = at + static_cast<std::uint32_t>(std::countr_zero(more));
        if (other < end) add(other);
      }
    }
  }
}

}  // namespace cradle
