// Balls that only fall: exact impacts, each at its time (server/dynamics/impact/). References:
// closed forms; for many balls an event-driven simulation of its own, which looks at all pairs.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/physics/worlds.h"

namespace cradle {
namespace {

BodySpec elastic_ball(double radius, const Vec3& p, const Vec3& v, double e = 1) {
  BodySpec spec = ball(radius, p, v);
  spec.material = {0, e};
  return spec;
}

BodySpec fixed_box(const Vec3& half, const Vec3& p, double friction = 0) {
  BodySpec spec = brick(half, p);
  spec.kind = BodyKind::fixed;
  spec.material = {friction, 0};
  return spec;
}

void add_room(World& world, double side) {
  const double h = side / 2 + 1;
  for (const double sign : {-1.0, 1.0}) {
    add(world, fixed_box({1, h + 1, h + 1}, {sign * h, 0, 0}));
    add(world, fixed_box({h + 1, 1, h + 1}, {0, sign * h, 0}));
    add(world, fixed_box({h + 1, h + 1, 1}, {0, 0, sign * h}));
  }
}

double kinetic_energy(const World& world) { return world.totals().kinetic_energy_J; }

struct Sphere {
  Vector x, v;
};

/// Balls of radius 0.5 and mass 1 between walls at -h and h, for a time: the next impact of all,
/// again and again.
void simulate(std::vector<Sphere>& balls, double h, double time) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  for (;;) {
    double first = kNone;
    std::size_t a = 0, b = 0;
    int axis = -1;
    for (std::size_t i = 0; i < balls.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        const double v = balls[i].v[k];
        const double t = v == 0 ? kNone : ((v > 0 ? h - 0.5 : 0.5 - h) - balls[i].x[k]) / v;
        if (t < first) first = t, a = i, axis = k;
      }
      for (std::size_t j = 0; j < i; ++j) {
        const Vector d = balls[i].x - balls[j].x, u = balls[i].v - balls[j].v;
        const double B = d.dot(u), A = u.squaredNorm(), C = d.squaredNorm() - 1;
        if (B >= 0 || B * B - A * C < 0) continue;
        const double t = std::max((-B - std::sqrt(B * B - A * C)) / A, 0.0);
        if (t < first) first = t, a = i, b = j, axis = -1;
      }
    }
    const double go = std::min(first, time);
    for (Sphere& ball : balls) ball.x += go * ball.v;
    time -= go;
    if (first > go || time <= 0) return;
    if (axis >= 0) {
      balls[a].v[axis] *= -1;
      continue;
    }
    const Vector n = (balls[a].x - balls[b].x).normalized();
    const Vector change = n.dot(balls[b].v - balls[a].v) * n;
    balls[a].v += change;
    balls[b].v -= change;
  }
}

}  // namespace

TEST_CASE("P25: a cradle passes on one, two and three, whatever the gaps") {
  for (const double gap : {0.0, 1e-12, 1e-9, 1e-6, 1e-3}) {
    for (int in = 1; in <= 3; ++in) {
      World world(weightless());
      std::vector<BodyId> balls;
      for (int k = 0; k < 5; ++k) {
        const double x = k * (1 + gap) - (k < in ? 0.5 : 0);
        balls.push_back(add(world, elastic_ball(0.5, {x, 0, 0}, {k < in ? 1.0 : 0.0, 0, 0})));
      }
      steps(world, 120);
      INFO("gap " << gap << ", " << in << " in");
      for (int k = 0; k < 5; ++k) {
        const double expected = k >= 5 - in ? 1 : 0;
        CHECK(std::abs(state(world, balls[static_cast<std::size_t>(k)]).v_WBcm.x - expected) <
              1e-9);
      }
    }
  }
}

TEST_CASE("a break shot stays symmetric") {
  for (const double gap : {0.0, 1e-9, 1e-6}) {
    World world(weightless());
    const BodyId cue = add(world, elastic_ball(0.5, {0, -3, 0}, {0, 10, 0}));
    std::vector<std::vector<BodyId>> rows;
    for (int row = 0; row < 5; ++row) {
      rows.emplace_back();
      for (int k = 0; k <= row; ++k) {
        const double x = (1 + gap) * (k - row / 2.0), y = (1 + gap) * row * std::sqrt(3) / 2;
        rows.back().push_back(add(world, elastic_ball(0.5, {x, y, 0}, {})));
      }
    }
    steps(world, 30);
    INFO("gap " << gap);
    CHECK(std::abs(state(world, cue).v_WBcm.x) < 1e-9 + 10 * gap);
    for (const auto& row : rows) {
      for (std::size_t k = 0; k < row.size(); ++k) {
        const Vec3 one = state(world, row[k]).v_WBcm;
        const Vec3 other = state(world, row[row.size() - 1 - k]).v_WBcm;
        CHECK(std::abs(one.x + other.x) + std::abs(one.y - other.y) < 1e-8 + 1e3 * gap);
      }
    }
    CHECK(std::abs(kinetic_energy(world) - 50) < 1e-10);
  }
}

TEST_CASE("P18: restitution of two balls") {
  for (const double e : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    World world(weightless());
    const BodyId a = add(world, elastic_ball(0.5, {-1.01, 0, 0}, {1, 0, 0}, e));
    const BodyId b = add(world, elastic_ball(0.5, {1.01, 0, 0}, {-1, 0, 0}, e));
    steps(world, 60);
    CHECK(std::abs(state(world, b).v_WBcm.x - state(world, a).v_WBcm.x - 2 * e) < 1e-12);
  }
}

TEST_CASE("P19: unlike balls in free fall exchange their velocities") {
  for (const double rate : {60.0, 30.0, 15.0}) {
    World world(settings(rate));
    const BodyId a = add(world, elastic_ball(1, {-2, 0, 0}, {5, 0, 0}));
    const BodyId b = add(world, elastic_ball(1, {2, 0, 0}, {-10, 0, 0}));
    steps(world, static_cast<int>(rate));
    CHECK(std::abs(state(world, a).v_WBcm.x + 10) < 1e-12);
    CHECK(std::abs(state(world, b).v_WBcm.x - 5) < 1e-12);
    CHECK(std::abs(state(world, a).v_WBcm.z + kGravity) < 1e-12);
    const double t = 2.0 / 15;  // they meet
    CHECK(std::abs(state(world, a).p_WBo.x - (-2 + 5 * t - 10 * (1 - t))) < 1e-11);
  }
}

TEST_CASE("balls that are as many as before, but not the same, are known by their places") {
  World world(weightless());
  const BodyId leaves = add(world, elastic_ball(0.5, {0, 9, 0}, {}));
  BodySpec spec = brick({0.5, 0.5, 0.5}, {0, 0, 0});
  spec.material = {0, 1};
  const BodyId cube = add(world, spec);
  add(world, elastic_ball(0.5, {0, -9, 0}, {}));
  steps(world, 2);
  REQUIRE(world.despawn(std::array{leaves}).result == Result::ok);
  const BodyId ball = add(world, elastic_ball(0.5, {-3.02, 0, 0}, {4, 0, 0}));
  steps(world, 60);
  // Equal masses exchange their velocities, where the ball meets the face.
  CHECK(std::abs(state(world, cube).v_WBcm.x - 4) < 1e-12);
  CHECK(std::abs(state(world, ball).p_WBo.x + 1) < 1e-9);
}

TEST_CASE("P26: a light ball on a heavy one is thrown up") {
  World world(settings(60));
  add(world, ground(0));
  BodySpec heavy = elastic_ball(0.5, {0, 0, 1.5}, {});
  heavy.mass_kg = 10;
  add(world, heavy);
  const BodyId light = add(world, elastic_ball(0.1, {0, 0, 2.101}, {}));
  // The light one meets the other while it rises: v_h up and v_l down with their heights, in closed
  // form of falls; at once they would be v and v.
  const double g = kGravity, v = std::sqrt(2 * g * 1.0);
  const double gap = 0.001, t = gap / (2 * v);
  const double up = v - g * t, down = v + g * t, height = 1.1 + v * t - g * t * t / 2;
  const double after = (2 * 10 * up - (1 - 10) * down) / 11;
  double apex = 0;
  for (int k = 0; k < 60; ++k) {
    world.step();
    const BodyState now = state(world, light);
    apex = std::max(apex, now.p_WBo.z + now.v_WBcm.z * std::abs(now.v_WBcm.z) / (2 * g));
  }
  CHECK(std::abs(apex - (height + after * after / (2 * g))) < 1e-9);
}

TEST_CASE("P20: a ball's bounces end at the time of their series") {
  for (const auto& [e, stop] : {std::pair{0.5, 1.3545709}, std::pair{0.9, 8.5789492}}) {
    World world(settings());
    add(world, ground(0));
    const BodyId body = add(world, elastic_ball(0.5, {0, 0, 1.5}, {}, e));
    steps(world, static_cast<int>(std::floor(stop * 60)));
    const double v = state(world, body).v_WBcm.z;
    CHECK(std::abs(v) + (state(world, body).p_WBo.z - 0.5) > 1e-7);  // not yet
    world.step();
    CHECK(std::abs(state(world, body).v_WBcm.z) < 1e-12);
    CHECK(std::abs(state(world, body).p_WBo.z - 0.5) < 1e-12);
    steps(world, 60);
    CHECK(std::abs(state(world, body).v_WBcm.z) < 1e-3);
    CHECK(std::abs(state(world, body).p_WBo.z - 0.5) < 1e-3);
  }
}

TEST_CASE("a ball is thrown back by an edge, a sphere and a capsule") {
  const double r = 0.3;
  const auto leaves_with = [r](const BodySpec& obstacle, double offset, double round) {
    World world(weightless());
    add(world, obstacle);
    const BodyId body = add(world, elastic_ball(r, {offset, 0.1, 3}, {0, 0, -7}));
    steps(world, 60);
    const double s = offset / (r + round);  // sine of the normal
    const Vector n(s, 0, std::sqrt(1 - s * s));
    const Vector expected = Vector(0, 0, -7) + 14 * n.z() * n;
    return (to_eigen(state(world, body).v_WBcm) - expected).norm();
  };
  for (const double offset : {0.01, 0.1, 0.2, 0.29}) {
    CHECK(leaves_with(fixed_box({1, 1, 1}, {-1, 0, -1}), offset, 0) < 1e-10);
    BodySpec sphere = fixed_box({1, 1, 1}, {0, 0.1, 0});
    sphere.shape = Shape::sphere(0.4);
    CHECK(leaves_with(sphere, offset, 0.4) < 1e-10);
    BodySpec capsule = sphere;
    capsule.shape = Shape::capsule(0.4, 0.5);
    capsule.q_WB = {std::sqrt(0.5), -std::sqrt(0.5), 0, 0};  // along y
    CHECK(leaves_with(capsule, offset, 0.4) < 1e-10);
  }
}

TEST_CASE("friction at an impact: sliding, and sticking") {
  // Coulomb: dv_t = -min(mu (1 + e) v_n, v_t / K m), K m = 1 + 5/2.
  for (const double mu : {0.1, 0.5}) {
    for (const double e : {0.0, 0.8}) {
      World world(weightless());
      add(world, ground(mu));
      BodySpec spec = ball(0.5, {0, 0, 1.01}, {3, 0, -4});
      spec.material = {mu, e};
      const BodyId body = add(world, spec);
      steps(world, 30);
      const double change = std::min(mu * (1 + e) * 4, 3 / 3.5);
      CHECK(std::abs(state(world, body).v_WBcm.x - (3 - change)) < 1e-12);
      CHECK(std::abs(state(world, body).w_WB.y - 2.5 * change / 0.5) < 1e-12);
      CHECK(std::abs(state(world, body).v_WBcm.z - 4 * e) < 1e-12);
    }
  }
}

TEST_CASE("a small gas goes as all its impacts in their order say") {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> speed(-5, 5);
  World world(weightless());
  add_room(world, 8);
  std::vector<Sphere> balls;
  for (int k = 0; k < 125; ++k) {
    const Vector x(1.4 * (k % 5) - 2.8, 1.4 * (k / 5 % 5) - 2.8, 1.4 * (k / 25) - 2.8);
    balls.push_back({x, {speed(random), speed(random), speed(random)}});
    add(world, elastic_ball(0.5, to_plain(x), to_plain(balls.back().v)));
  }
  // Later on both forget where they came from: an error grows about tenfold with every impact.
  for (int tick = 0; tick < 20; ++tick) {
    world.step();
    simulate(balls, 4, 1.0 / 60);
    std::vector<BodyState> states;
    world.snapshot(states);
    for (std::size_t k = 0; k < balls.size(); ++k) {
      INFO("tick " << tick << ", ball " << k);
      REQUIRE((to_eigen(states[6 + k].p_WBo) - balls[k].x).norm() < 1e-9);
    }
  }
}

TEST_CASE("A11: a gas keeps its energy, and no balls overlap") {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> speed(-5, 5);
  World world(weightless());
  add_room(world, 12);
  for (int k = 0; k < 216; ++k) {
    const Vec3 x{2.0 * (k % 6) - 5, 2.0 * (k / 6 % 6) - 5, 2.0 * (k / 36) - 5};
    add(world, elastic_ball(0.5, x, {speed(random), speed(random), speed(random)}));
  }
  const double start = kinetic_energy(world);
  std::vector<BodyState> states;
  for (int tick = 0; tick < 300; ++tick) {
    world.step();
    world.snapshot(states);
    for (std::size_t i = 6; i < states.size(); ++i) {
      for (std::size_t j = 6; j < i; ++j) {
        REQUIRE((to_eigen(states[i].p_WBo) - to_eigen(states[j].p_WBo)).norm() > 1 - 1e-9);
      }
    }
  }
  CHECK(std::abs(kinetic_energy(world) / start - 1) < 1e-12);
}

TEST_CASE("balls among other bodies lose energy, and nothing else") {
  // Balls with restitution and friction, a heap of boxes, a kinematic paddle: what takes part in
  // events changes from tick to tick.
  for (int seed = 0; seed < 4; ++seed) {
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    std::uniform_real_distribution<double> place(-2.4, 2.4);
    World world(settings());
    add_room(world, 6);
    for (int k = 0; k < 30; ++k) {
      const Vec3 x{place(random), place(random), -2.6 + 0.18 * k};
      if (k % 3 == 0) {
        add(world, brick({0.2, 0.2, 0.2}, x));
      } else {
        BodySpec spec = ball(0.2, x, {place(random), place(random), 0});
        spec.material = {0.3, 0.9};
        add(world, spec);
      }
    }
    const auto energy = [&] {
      const Totals totals = world.totals();
      return totals.kinetic_energy_J + totals.potential_energy_J;
    };
    const double start = energy();
    std::vector<BodyState> states;
    for (int tick = 0; tick < 600; ++tick) {
      world.step();
      INFO("seed " << seed << ", tick " << tick);
      REQUIRE(energy() < start * (1 + 1e-9));
      world.snapshot(states);
      for (std::size_t k = 6; k < states.size(); ++k) {
        REQUIRE(to_eigen(states[k].p_WBo).cwiseAbs().maxCoeff() < 3);
      }
    }
  }
}

}  // namespace cradle
