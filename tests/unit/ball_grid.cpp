// The grid of balls against all pairs, one by one.
#include "server/dynamics/impact/ball_grid.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <vector>

#include "server/collision/machine_lanes.h"

namespace cradle {
namespace {

constexpr double kTick = 1.0 / 60;

using BallRandom = std::mt19937_64;

double uniform_in(BallRandom& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
Vector uniform_vector(BallRandom& random, const Vector& low, const Vector& high) {
  return {uniform_in(random, low.x(), high.x()), uniform_in(random, low.y(), high.y()),
          uniform_in(random, low.z(), high.z())};
}

/// Balls anywhere in a box of any shape, some in a row that touches, one far out.
std::vector<Ball> crowd(BallRandom& random) {
  const double place = std::pow(10, uniform_in(random, 0, 6)), speed = uniform_in(random, 0, 30);
  const Vector origin = uniform_vector(random, Vector::Constant(-place), Vector::Constant(place));
  const Vector drift = uniform_vector(random, Vector::Constant(-50), Vector::Constant(50));
  const Vector half = uniform_vector(random, {2, 1, 0}, {9, 9, 9});
  const bool is_flat = uniform_in(random, 0, 1) < 0.2;
  const auto count = static_cast<std::size_t>(uniform_in(random, 1, 300));
  std::vector<Ball> balls(count);
  for (std::size_t i = 0; i < count; ++i) {
    Ball& ball = balls[i];
    ball.radius = uniform_in(random, 0.2, 0.6);
    ball.x = origin + uniform_vector(random, -half, half);
    ball.v = drift + uniform_vector(random, Vector::Constant(-speed), Vector::Constant(speed));
    if (is_flat) ball.x.z() = ball.v.z() = 0;
    if (i % 10 != 1) continue;
    ball.v = balls[i - 1].v;
    ball.x = balls[i - 1].x + Vector::UnitY() * (ball.radius + balls[i - 1].radius);
  }
  if (uniform_in(random, 0, 1) < 0.3) balls.back().x.x() += 1e3;
  return balls;
}

Vector mean_velocity(const std::vector<Ball>& balls) {
  Vector sum = Vector::Zero();
  for (const Ball& ball : balls) sum += ball.v;
  return sum / static_cast<double>(balls.size());
}

bool balls_touch(const Ball& a, const Ball& b, double now) {
  const double R = a.radius + b.radius + kStruckTogether * std::min(a.radius, b.radius);
  return (b.x - a.x + now * (b.v - a.v)).norm() <= R;
}
bool balls_meet(const Ball& a, const Ball& b, double now) {
  return impact_time(a, b, now, kTick) != kNever || balls_touch(a, b, now);
}

/// m, that they keep between them at least, by the bound that the grid goes by.
double gap(const Ball& a, const Ball& b) {
  const Vector d = b.x - a.x, u = b.v - a.v;
  const double least = d.squaredNorm() + std::min(0.0, 2 * kTick * d.dot(u));
  return std::sqrt(std::max(least, 0.0)) - a.radius - b.radius;
}

}  // namespace

TEST_CASE("a grid of balls finds all that meet, and few more") {
  BallRandom random(1);
  SerialExecutor here;
  int suited = 0, found_in_all = 0;
  for (int k = 0; k < 400; ++k) {
    CAPTURE(k);
    const std::vector<Ball> balls = crowd(random);
    BallGrid grid;
    if (!grid.build(here, balls, kTick, mean_velocity(balls), Vector::Zero())) continue;
    ++suited;
    std::vector<BodyPair> pairs{{7, 7}};
    grid.find_pairs(here, 0, pairs);
    for (const int lanes : machine_lanes()) {
      std::vector<BodyPair> same;
      grid.find_pairs(here, lanes, same);
      REQUIRE(same == pairs);
    }
    CHECK(std::is_sorted(pairs.begin(), pairs.end()));
    CHECK(std::adjacent_find(pairs.begin(), pairs.end()) == pairs.end());
    found_in_all += static_cast<int>(pairs.size());
    for (std::size_t i = 0; i < balls.size(); ++i) {
      for (std::size_t j = i + 1; j < balls.size(); ++j) {
        const BodyPair pair{static_cast<std::int32_t>(i), static_cast<std::int32_t>(j)};
        const bool is_found = std::binary_search(pairs.begin(), pairs.end(), pair);
        if (balls_meet(balls[i], balls[j], 0)) REQUIRE(is_found);
        if (is_found) REQUIRE(gap(balls[i], balls[j]) < 0.05);
      }
    }
  }
  CHECK(suited > 200);
  CHECK(found_in_all > 10'000);
}

TEST_CASE("balls that only just meet are found, however far from the middle") {
  BallRandom random(4);
  SerialExecutor here;
  for (const double speed : {1e-6, 1e-2, 10.0}) {
    for (const Vector& half : {Vector(5, 5, 5), Vector(1e3, 1, 1), Vector(1e5, 0, 0)}) {
      for (int k = 0; k < 50; ++k) {
        std::vector<Ball> balls(200);
        for (std::size_t i = 0; i < 200; i += 2) {
          Ball &a = balls[i], &b = balls[i + 1];
          const double radius = uniform_in(random, 0.4, 0.5);
          const Vector n = uniform_vector(random, {-1, -1, -1}, {1, 1, 1}).normalized();
          a.radius = b.radius = radius;
          a.x = uniform_vector(random, -half, half);
          b.x = a.x + (2 * radius + 2 * kTick * speed * 0.9999) * n;
          a.v = speed * n;
          b.v = -a.v;
        }
        BallGrid grid;
        REQUIRE(grid.build(here, balls, kTick, Vector::Zero(), Vector::Zero()));
        std::vector<BodyPair> pairs;
        grid.find_pairs(here, 0, pairs);
        for (std::int32_t i = 0; i < 200; i += 2) {
          CAPTURE(speed, half.x(), k, i);
          REQUIRE(std::binary_search(pairs.begin(), pairs.end(), BodyPair{i, i + 1}));
        }
      }
    }
  }
}

TEST_CASE("a ball that was struck finds whom it may meet now") {
  BallRandom random(2);
  SerialExecutor here;
  int met = 0;
  for (int k = 0; k < 200; ++k) {
    CAPTURE(k);
    std::vector<Ball> balls = crowd(random);
    BallGrid grid;
    if (!grid.build(here, balls, kTick, mean_velocity(balls), Vector::Zero())) continue;
    BallGrid::Deviations deviations;
    grid.begin(deviations);
    double now = 0;
    for (int strike = 0; strike < 20; ++strike) {
      now += uniform_in(random, 0, (kTick - now) / 5);
      const auto i =
          static_cast<std::size_t>(uniform_in(random, 0, static_cast<double>(balls.size())));
      const double speed = std::pow(10, uniform_in(random, 0, 2.5));
      const Vector v = balls[i].v, change = uniform_vector(random, Vector::Constant(-speed),
                                                           Vector::Constant(speed));
      balls[i].v = v + change;
      balls[i].x -= now * change;
      const auto number = static_cast<std::int32_t>(i);
      grid.note(deviations, number, balls[i]);
      std::vector<std::int32_t> near;
      grid.for_each_near(deviations, number, balls[i], now,
                         [&](std::int32_t other) { near.push_back(other); });
      for (std::size_t j = 0; j < balls.size(); ++j) {
        if (j == i || !balls_meet(balls[i], balls[j], now)) continue;
        ++met;
        REQUIRE(std::ranges::count(near, static_cast<std::int32_t>(j)) == 1);
      }
    }
  }
  CHECK(met > 1000);
}

TEST_CASE("a grid of balls has in a box whoever is in it") {
  BallRandom random(3);
  SerialExecutor here;
  for (int k = 0; k < 100; ++k) {
    const std::vector<Ball> balls = crowd(random);
    BallGrid grid;
    if (!grid.build(here, balls, kTick, mean_velocity(balls), Vector::Zero())) continue;
    const Vector middle = balls[balls.size() / 2].x;
    const Aabb box{middle - Vector::Constant(uniform_in(random, 0, 4)),
                   middle + Vector::Constant(uniform_in(random, 0, 4))};
    std::vector<int> times(balls.size(), 0);
    grid.for_each_in(box, [&](std::int32_t i) { ++times[static_cast<std::size_t>(i)]; });
    for (std::size_t i = 0; i < balls.size(); ++i) {
      CAPTURE(k, i);
      REQUIRE(times[i] <= 1);
      if (box.holds({balls[i].x, balls[i].x})) REQUIRE(times[i] == 1);
    }
  }
}

TEST_CASE("balls that overlap or are too unlike suit no grid") {
  SerialExecutor here;
  BallGrid grid;
  std::vector<Ball> balls(100);
  for (Ball& ball : balls) {
    ball.x = ball.v = Vector::Zero();
    ball.radius = 0.5;
  }
  CHECK_FALSE(grid.build(here, balls, kTick, Vector::Zero(), Vector::Zero()));
  for (std::size_t i = 0; i < balls.size(); ++i) {
    balls[i].x.x() = 1.5 * static_cast<double>(i);
  }
  CHECK(grid.build(here, balls, kTick, Vector::Zero(), Vector::Zero()));
  balls[50].radius = 1000;
  CHECK_FALSE(grid.build(here, balls, kTick, Vector::Zero(), Vector::Zero()));
  CHECK_FALSE(grid.build(here, {}, kTick, Vector::Zero(), Vector::Zero()));
}

}  // namespace cradle
