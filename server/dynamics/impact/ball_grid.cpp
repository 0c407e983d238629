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

namespace cradle {
namespace {

constexpr std::size_t kBalls = 1024;        // worth a thread, at some nanoseconds each
constexpr std::size_t kSharedPerBall = 16;  // places in a ball's cell, on average, at most
constexpr double kCellsPerBall = 4;         // at most: beyond, cells are wider
constexpr double kRounding = 0x1p-17;       // 128 e

std::size_t index(std::int32_t i) { return static_cast<std::size_t>(i); }

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
  fall_ = 0;
  fall_from_rest_ = gravity.norm() * dt * dt;
  const Bounds bounds = bounds_of(executor, balls);
  radius_max_ = bounds.radius;
  speed_max_ = std::sqrt(bounds.speed2);
  if (!choose_cells(balls, bounds) || !count(executor, balls)) return false;
  sort(executor, balls);
  return true;
}

BallGrid::Bounds BallGrid::bounds_of(Executor& executor, std::span<const Ball> balls) {
  bounds_of_parts_.resize(chunks_of(balls.size(), kBalls));
  for_chunks(executor, balls.size(), kBalls,
             [&](std::size_t part, std::size_t begin, std::size_t end) {
               Bounds bounds{balls[begin].x, balls[begin].x, 0, 0};
               for (std::size_t i = begin; i < end; ++i) {
                 const Ball& ball = balls[i];
                 bounds.lower = bounds.lower.cwiseMin(ball.x);
                 bounds.upper = bounds.upper.cwiseMax(ball.x);
                 bounds.radius = std::max(bounds.radius, ball.radius);
                 bounds.speed2 = std::max(bounds.speed2, (ball.v - v_mean_).squaredNorm());
               }
               bounds_of_parts_[part] = bounds;
             });
  Bounds all = bounds_of_parts_[0];
  for (const Bounds& part : bounds_of_parts_) {
    all.lower = all.lower.cwiseMin(part.lower);
    all.upper = all.upper.cwiseMax(part.upper);
    all.radius = std::max(all.radius, part.radius);
    all.speed2 = std::max(all.speed2, part.speed2);
  }
  return all;
}

/// What follows from the fastest ball, and from the one that is farthest out.
void BallGrid::measure() {
  reach_ = 2 * (1 + kStruckTogether) * radius_max_ + 2 * dt_ * speed_max_ + 4 * fall_;
  slack_ = static_cast<float>(kRounding * reach_ * (coordinate_max_ + reach_) + 2 * reach_ * fall_);
}

bool BallGrid::choose_cells(std::span<const Ball> balls, const Bounds& bounds) {
  Vector lower, widths;
  for (int k = 0; k < 3; ++k) {
    const auto [low, high] = extent(balls, k);
    lower[k] = std::max(low, bounds.lower[k]);
    widths[k] = std::max(std::min(high, bounds.upper[k]) - lower[k], 0.0);
  }
  origin_ = lower + widths / 2;
  coordinate_max_ = (bounds.upper - origin_).cwiseMax(origin_ - bounds.lower).maxCoeff();
  measure();
  double side = 1.001 * reach_ + 2 * kRounding * coordinate_max_;
  if (!(side > 0 && side + coordinate_max_ < kFloatReach)) return false;
  const double cells_max = kCellsPerBall * static_cast<double>(balls.size()) + 64;
  const auto cells = [&](int k) { return 1 + std::floor(widths[k] / side); };
  for (; cells(0) * cells(1) * cells(2) > cells_max; side *= 1.26) {
  }
  cells_per_m_ = static_cast<float>(1 / side);
  for (int k = 0; k < 3; ++k) {
    origin_cells_[k] = static_cast<float>(lower[k] - origin_[k]);
    size_[k] = static_cast<std::uint32_t>(cells(k)) + 2;
  }
  return true;
}

/// Which cell each ball is in, and how many are in each.
bool BallGrid::count(Executor& executor, std::span<const Ball> balls) {
  cells_of_.resize(balls.size());
  for_each_index(executor, balls.size(), kBalls, [&](std::size_t i) {
    const Vector x = balls[i].x - origin_;
    cells_of_[i] = number_of(
        cell_of(static_cast<float>(x.x()), static_cast<float>(x.y()), static_cast<float>(x.z())));
  });
  begins_.assign(std::size_t{size_[0]} * size_[1] * size_[2] + 1, 0);
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
  stride_ = balls.size() + kLanes;  // a read of four may begin at the last
  columns_.resize(7 * stride_);
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const std::uint32_t place = begins_[cells_of_[i]]++;
    numbers_[place] = static_cast<std::int32_t>(i);
    places_[i] = place;
  }
  for_each_index(executor, balls.size(), kBalls, [&](std::size_t place) {
    constexpr std::size_t kAhead = 8;
    if (place + kAhead < balls.size()) {
      __builtin_prefetch(&balls[index(numbers_[place + kAhead])]);
    }
    write(balls[index(numbers_[place])], place);
  });
  // Each now tells where its cell ends.
  std::copy_backward(begins_.begin(), begins_.end() - 1, begins_.end());
  begins_[0] = 0;
}

void BallGrid::write(const Ball& ball, std::size_t place) {
  float* at = columns_.data() + place;
  for (int k = 0; k < 3; ++k) {
    at[static_cast<std::size_t>(k) * stride_] = static_cast<float>(ball.x[k] - origin_[k]);
    at[static_cast<std::size_t>(3 + k) * stride_] = static_cast<float>(ball.v[k] - v_mean_[k]);
  }
  at[6 * stride_] = static_cast<float>((1 + kStruckTogether) * ball.radius);
}

void BallGrid::note(std::int32_t number, const Ball& ball) {
  write(ball, places_[index(number)]);
  speed_max_ = std::max(speed_max_, (ball.v - v_mean_).norm());
  coordinate_max_ = std::max(coordinate_max_, (ball.x - origin_).cwiseAbs().maxCoeff());
  fall_ = fall_from_rest_;
  measure();
}

std::int64_t BallGrid::find_pairs(Executor& executor, std::vector<BodyPair>& pairs) {
  pairs.clear();
  const std::size_t rows = std::size_t{size_[1] - 2} * (size_[2] - 2);
  const std::int64_t seen =
      parts_.find(executor, rows, pairs,
                  [this](std::size_t begin, std::size_t end, std::vector<BodyPair>& found) {
                    return join(begin, end, found);
                  });
  sorter_.sort(numbers_.size(), pairs);
  return seen;
}

std::int64_t BallGrid::join(std::size_t first_row, std::size_t end_row,
                            std::vector<BodyPair>& found) const {
  const std::uint32_t next_y = size_[0], next_z = size_[0] * size_[1];
  const std::array<std::uint32_t, 4> others{next_y, next_z - next_y, next_z, next_z + next_y};
  std::int64_t looked_at = 0;
  for (std::size_t row = first_row; row < end_row; ++row) {
    const std::size_t y = 1 + row % (size_[1] - 2), z = 1 + row / (size_[1] - 2);
    const std::uint32_t* cell = begins_.data() + z * next_z + y * next_y + 1;
    for (const std::uint32_t* const end = cell + size_[0] - 2; cell < end; ++cell) {
      if (cell[0] == cell[1]) continue;
      ++looked_at;
      std::array<Range, 5> ranges;
      for (std::size_t k = 0; k < 4; ++k) {
        ranges[k + 1] = {cell[others[k] - 1], cell[others[k] + 2]};
      }
      for (std::uint32_t at = cell[0]; at < cell[1]; ++at) {
        ranges[0] = {at + 1, cell[2]};
        look_at(at, ranges, found);
      }
    }
  }
  return looked_at;
}

/// Of each range four balls at once, which is most of them as a rule: no branches until then.
void BallGrid::look_at(std::uint32_t place, const std::array<Range, 5>& ranges,
                       std::vector<BodyPair>& found) const {
  const Probe ball = probe(place, 0);
  const std::int32_t number = numbers_[place];
  const auto add = [&](std::uint32_t other) {
    const auto [a, b] = std::minmax(number, numbers_[other]);
    found.push_back({a, b});
  };
  std::uint32_t hits = 0;
  bool has_more = false;
  for (std::size_t r = 0; r < ranges.size(); ++r) {
    const std::uint32_t count = ranges[r].end - ranges[r].begin;
    const unsigned within = (1U << std::min<std::uint32_t>(count, kLanes)) - 1;
    hits |= (may_meet<true>(ball, ranges[r].begin) & within) << (kLanes * r);
    has_more |= count > kLanes;
  }
  for (; hits != 0; hits &= hits - 1) {
    const auto bit = static_cast<std::size_t>(std::countr_zero(hits));
    add(ranges[bit / kLanes].begin + static_cast<std::uint32_t>(bit % kLanes));
  }
  for (std::size_t r = 0; has_more && r < ranges.size(); ++r) {
    for (std::uint32_t at = ranges[r].begin + kLanes; at < ranges[r].end; at += kLanes) {
      for (unsigned more = may_meet<true>(ball, at); more != 0; more &= more - 1) {
        const std::uint32_t other = at + static_cast<std::uint32_t>(std::countr_zero(more));
        if (other < ranges[r].end) add(other);
      }
    }
  }
}

}  // namespace cradle
