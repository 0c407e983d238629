// Rolling and torsional friction: closed forms of Newton and Euler.
//
// A ball of mass m, radius r and moment J that rolls, v = r w, under the torque -T and the
// contact's friction F:  m v' = -F,  J w' = F r - T,  so  v' = -T r / (J + m r^2), with
// T = mu_r m g cos a on a slope of the angle a, and  v' = (m g r^2 sin a - T r) / (J + m r^2)
// down it: it stays while r sin a < mu_r cos a. One that spins on the spot: w' = -mu_s m g / J.
#include <catch2/catch.hpp>
#include <random>

#include "tests/physics/planar.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

constexpr double kRadius = 0.5;

BodySpec soft_ball(double rolling_m, double torsional_m, const Vec3& v = {}, const Vec3& w = {}) {
  BodySpec spec = ball(kRadius, {0, 0, kRadius}, v);
  spec.w_WB = w;
  spec.material.rolling_friction_m = rolling_m;
  spec.material.torsional_friction_m = torsional_m;
  return spec;
}

/// Ticks until it is slower than that, at most a minute; and where it is then.
std::pair<int, BodyState> stop(World& world, BodyId body, double enough) {
  for (int tick = 1; tick <= 3600; ++tick) {
    world.step();
    const BodyState s = state(world, body);
    if (norm(s.v_WBcm) + kRadius * norm(s.w_WB) < enough) return {tick, s};
  }
  return {3601, {}};
}

/// Kinetic, and that of height.
double energy_of_body(const World& world, BodyId body, const Vec3& J) {
  const BodyState s = state(world, body);
  const Vector w = to_eigen(s.q_WB).conjugate() * to_eigen(s.w_WB);
  return 0.5 * norm(s.v_WBcm) * norm(s.v_WBcm) + kGravity * s.p_WBo.z +
         0.5 * w.dot(to_eigen(J).cwiseProduct(w));
}

/// What rolls at 1 m/s along +x on the level comes to rest after v / a and v^2 / 2a.
void check_rolls_to_rest(World& world, const BodySpec& spec, double deceleration) {
  const BodyId body = add(world, spec);
  const double x = spec.p_WBo.x, y = spec.p_WBo.y;
  for (int tick = 1; tick < 60 / deceleration; ++tick) {
    world.step();
    const BodyState s = state(world, body);
    REQUIRE(s.v_WBcm.x == Approx(1 - deceleration * tick / 60).margin(2e-4));
    REQUIRE(std::hypot(s.w_WB.y, s.w_WB.z) * kRadius == Approx(s.v_WBcm.x).margin(5e-4));
  }
  steps(world, 30);
  const BodyState s = state(world, body);
  CHECK(norm(s.v_WBcm) < 1e-8);  // it still sinks in
  CHECK(norm(s.w_WB) < 1e-9);
  CHECK(s.p_WBo.x - x == Approx(0.5 / deceleration).epsilon(2e-4));
  CHECK(std::abs(s.p_WBo.y - y) < 2e-4);
}

}  // namespace

TEST_CASE("P40: a ball with rolling friction comes to rest, and so does one that spins") {
  // Chrono's tests rolling_gravity and spinning_gravity: r = 0.5, m = 1, coefficients 0.2 m; at
  // 1 m/s it rests in less than 1 s, spinning at 1 rad/s in less than 4 s, w < 1e-3.
  World rolling(settings()), spinning(settings());
  for (World* world : {&rolling, &spinning}) add(*world, ground());
  const BodyId rolls = add(rolling, soft_ball(0.2, 0, {1, 0, 0}, {0, 2, 0}));
  const BodyId spins = add(spinning, soft_ball(0, 0.2, {}, {0, 0, 1}));
  steps(rolling, 60);
  CHECK(norm(state(rolling, rolls).w_WB) < 1e-3);
  CHECK(norm(state(rolling, rolls).v_WBcm) < 1e-3);
  steps(spinning, 240);
  CHECK(norm(state(spinning, spins).w_WB) < 1e-3);
}

TEST_CASE("a ball, a cylinder and a disc roll to rest as their torque says") {
  for (const double mu : {0.2, 0.02}) {
    CAPTURE(mu);
    World of_ball(settings()), of_cylinder(settings()), of_disc(planar_settings({0, -kGravity, 0}));
    add(of_ball, ground());
    check_rolls_to_rest(of_ball, soft_ball(mu, 0, {1, 0, 0}, {0, 2, 0}),
                        mu * kGravity / (1.4 * kRadius));

    add(of_cylinder, ground());
    BodySpec cylinder = soft_ball(mu, 0, {1, 0, 0}, {0, 2, 0});
    cylinder.shape = Shape::cylinder(kRadius, 0.4);
    cylinder.q_WB = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};
    check_rolls_to_rest(of_cylinder, cylinder, mu * kGravity / (1.5 * kRadius));

    add(of_disc, level(0));
    BodySpec round = disc(kRadius, {0, kRadius, 0}, {1, 0, 0});
    round.w_WB = {0, 0, -2};
    round.material.rolling_friction_m = mu;
    check_rolls_to_rest(of_disc, round, mu * kGravity / (1.5 * kRadius));
  }
}

TEST_CASE("a ball that spins on the spot stops after J w / (mu m g)") {
  const double J = 0.4 * kRadius * kRadius;
  for (const double mu : {0.2, 0.02, 0.002}) {
    CAPTURE(mu);
    World world(settings());
    add(world, ground());
    const BodyId body = add(world, soft_ball(0, mu, {}, {0, 0, 1}));
    const double time = J / (mu * kGravity);
    const auto [ticks, s] = stop(world, body, 1e-9);
    CHECK(ticks >= 60 * time);
    CHECK(ticks < 60 * time + 2);
    CHECK(2 * std::atan2(s.q_WB.z, s.q_WB.w) == Approx(time / 2).epsilon(2e-3));
    CHECK(norm(s.p_WBo - Vec3{0, 0, s.p_WBo.z}) < 1e-12);
  }
}

TEST_CASE("a ball stays on a slope below atan(mu_r / r), above it rolls") {
  const double mu = 0.05;
  for (const double part : {0.5, 0.99, 1.5, 3.0}) {
    CAPTURE(part);
    const double tangent = part * mu / kRadius, angle = std::atan(tangent);
    World world(settings());
    BodySpec slope = ground(1);
    slope.q_WB = {std::cos(angle / 2), 0, std::sin(angle / 2), 0};
    add(world, slope);
    BodySpec spec = soft_ball(mu, 0);
    spec.material.friction = 1;
    spec.p_WBo = {kRadius * std::sin(angle), 0, kRadius * std::cos(angle)};
    const BodyId body = add(world, spec);
    if (part < 1) {
      const auto way = [&] {  // along the slope; it also sinks in
        const Vec3 d = state(world, body).p_WBo - spec.p_WBo;
        return d.x * std::cos(angle) - d.z * std::sin(angle);
      };
      steps(world, 1);
      const double first = way();
      CHECK(std::abs(first) < 1e-5);
      steps(world, 600);
      CHECK(std::abs(way() - first) < 1e-14);
      CHECK(norm(state(world, body).v_WBcm) < 1e-15);
      continue;
    }
    const double acceleration = kGravity * std::cos(angle) * (tangent - mu / kRadius) / 1.4;
    steps(world, 120);
    CHECK(norm(state(world, body).v_WBcm) == Approx(2 * acceleration).epsilon(1e-3));
    CHECK(norm(state(world, body).w_WB) == Approx(2 * acceleration / kRadius).epsilon(1e-3));
  }
}

TEST_CASE("rolling friction is alike in every direction") {
  double least = 1e9, most = 0;
  for (int k = 0; k < 12; ++k) {
    const double a = 0.1 + k * 0.5236;
    World world(settings());
    add(world, ground());
    const Vec3 e{std::cos(a), std::sin(a), 0};
    const BodyId body = add(world, soft_ball(0.1, 0, e, {-2 * e.y, 2 * e.x, 0}));
    const BodyState s = stop(world, body, 1e-9).second;
    CHECK(std::abs(s.p_WBo.x * e.y - s.p_WBo.y * e.x) < 1e-12);
    least = std::fmin(least, std::hypot(s.p_WBo.x, s.p_WBo.y));
    most = std::fmax(most, std::hypot(s.p_WBo.x, s.p_WBo.y));
  }
  CHECK(most - least < 1e-12);
}

TEST_CASE("torsional friction between two bodies passes spin on, and keeps the sum") {
  // The block lies on smooth ground; the larger coefficient of each pair counts.
  World world(settings());
  add(world, ground(0));
  BodySpec block = brick({1, 1, 0.25}, {0, 0, 0.25});
  block.material.friction = 0;
  block.material.rolling_friction_m = 0;
  const double J_block = 2.0 / 3, J_ball = 0.4 * kRadius * kRadius;
  const BodyId below = add(world, block);
  BodySpec spinning = soft_ball(0, 0.01, {}, {0, 0, 3});
  spinning.p_WBo.z += 0.5;
  const BodyId above = add(world, spinning);
  for (int tick = 0; tick < 240; ++tick) {
    world.step();
    CHECK(J_ball * state(world, above).w_WB.z + J_block * state(world, below).w_WB.z ==
          Approx(3 * J_ball).epsilon(1e-12));
  }
  const double together = 3 * J_ball / (J_ball + J_block);
  CHECK(state(world, above).w_WB.z == Approx(together).epsilon(1e-9));
  CHECK(state(world, below).w_WB.z == Approx(together).epsilon(1e-9));
}

TEST_CASE("a contact has nothing of the torque of one that was") {
  World world(settings());
  add(world, ground());
  const BodyId spinning = add(world, soft_ball(0.01, 0.01, {1, 0, 0}, {0, 2, 3}));
  steps(world, 10);
  world.despawn(std::array{spinning});
  const BodyId still = add(world, soft_ball(0.01, 0.01));
  world.step();
  CHECK(state(world, still).w_WB == Vec3{});
  CHECK(state(world, still).v_WBcm.x == 0);
}

TEST_CASE("what touches nothing is not slowed, however near the ground is") {
  World world(weightless());
  add(world, ground());
  BodySpec near = soft_ball(1, 1, {}, {1, 2, 3});
  near.p_WBo.z += 1e-3;
  const BodyId body = add(world, near);
  steps(world, 60);
  CHECK(state(world, body).w_WB == Vec3{1, 2, 3});
}

TEST_CASE("an impact gives no more angular impulse than the coefficient times its impulse") {
  // Dropped at 2 m/s with e = 0.5: the impulse is 3 N s. As an event of a ball, and as an impact
  // in a sub-step.
  const double J = 0.4 * kRadius * kRadius;
  for (const std::string scheme : {"exact", "semi_implicit_euler"}) {
    for (const double mu : {0.01, 1.0}) {
      CAPTURE(scheme, mu);
      WorldSettings how = weightless();
      how.scheme = scheme;
      World world(how);
      add(world, ground(0));
      BodySpec spec = soft_ball(mu, mu, {0, 0, -2}, {0, 6, 5});
      spec.p_WBo.z += 0.1;
      spec.material.friction = 0;
      spec.material.restitution = 0.5;
      const BodyId body = add(world, spec);
      steps(world, 10);
      const BodyState s = state(world, body);
      CHECK(s.v_WBcm.z == Approx(1).epsilon(1e-9));
      CHECK(s.w_WB.z == Approx(std::fmax(5 - 3 * mu / J, 0)).margin(1e-9));
      CHECK(s.w_WB.y == Approx(std::fmax(6 - 3 * mu / J, 0)).margin(1e-9));
    }
  }
}

TEST_CASE("a ball that sleeps on a slope wakes without moving") {
  WorldSettings how = settings();
  how.is_sleeping = true;
  World world(how);
  BodySpec slope = ground(1);
  slope.q_WB = {std::cos(0.02), 0, std::sin(0.02), 0};
  add(world, slope);
  BodySpec spec = soft_ball(0.1, 0.1);
  spec.p_WBo = {kRadius * std::sin(0.04), 0, kRadius * std::cos(0.04)};
  const BodyId body = add(world, spec);
  steps(world, 120);
  const BodyState asleep = state(world, body);
  REQUIRE(asleep.asleep);
  Wrench nothing;
  nothing.body = body;
  REQUIRE(world.push(std::array{nothing}).result == Result::ok);
  steps(world, 2);
  CHECK_FALSE(state(world, body).asleep);
  steps(world, 8);
  const Vec3 d = state(world, body).p_WBo - asleep.p_WBo;  // it goes on sinking in
  CHECK(std::abs(d.x * std::cos(0.04) - d.z * std::sin(0.04)) < 1e-14);
}

TEST_CASE("rolling and torsional friction never add energy") {
  // Thrown with any spin: balls, and bodies that tumble, whose inertia is not alike about all axes.
  std::mt19937_64 random(7);
  for (int k = 0; k < 60; ++k) {
    CAPTURE(k);
    World world(settings());
    add(world, ground(uniform(random, 0, 1)));
    const auto any = [&](double size) {
      return Vec3{uniform(random, -size, size), uniform(random, -size, size), 0};
    };
    BodySpec spec = soft_ball(uniform(random, 0, 0.3), uniform(random, 0, 0.3), any(3), any(6));
    spec.w_WB.z = uniform(random, -6, 6);
    Vec3 J{0.1, 0.1, 0.1};
    if (k % 3 == 1) {
      J = {0.15, 0.12, 0.08};
      spec.inertia_kgm2 = J;
    }
    if (k % 3 == 2) spec.material.restitution = uniform(random, 0, 1), spec.p_WBo.z += 0.5;
    const BodyId body = add(world, spec);
    const double start = energy_of_body(world, body, J);
    double last = start;
    for (int tick = 0; tick < 300; ++tick) {
      world.step();
      const double now = energy_of_body(world, body, J);
      REQUIRE(now <= start * (1 + 1e-6));
      last = now;
    }
    CHECK(last < start);
  }
}

TEST_CASE("a heap with rolling and torsional friction never has more energy than at its start") {
  std::mt19937_64 random(11);
  World world(settings());
  add(world, ground());
  std::vector<std::pair<BodyId, Vec3>> bodies;
  for (int i = 0; i < 60; ++i) {
    const Vec3 at{uniform(random, -1, 1), uniform(random, -1, 1), 0.6 + 0.4 * i};
    BodySpec spec = i % 2 == 0 ? ball(kRadius / 2, at) : brick({0.2, 0.3, 0.25}, at);
    spec.w_WB = {uniform(random, -9, 9), uniform(random, -9, 9), uniform(random, -9, 9)};
    spec.material.rolling_friction_m = uniform(random, 0, 0.2);
    spec.material.torsional_friction_m = uniform(random, 0, 0.2);
    const double m = 1.0 / 12 * 4;
    bodies.emplace_back(add(world, spec),
                        i % 2 == 0
                            ? Vec3{0.025, 0.025, 0.025}
                            : Vec3{m * (0.09 + 0.0625), m * (0.04 + 0.0625), m * (0.04 + 0.09)});
  }
  const auto total = [&] {
    double sum = 0;
    for (const auto& [body, J] : bodies) sum += energy_of_body(world, body, J);
    return sum;
  };
  const double start = total();
  for (int tick = 0; tick < 600; ++tick) {
    world.step();
    REQUIRE(total() <= start * (1 + 1e-6));
  }
  CHECK(total() < 0.3 * start);
}

}  // namespace cradle
