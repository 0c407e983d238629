// Contact at default settings (60 Hz, four sub-steps) against closed forms and published figures.
#include <catch2/catch.hpp>

#include "tests/physics/worlds.h"

namespace cradle {

TEST_CASE("P13: a sliding sphere begins to roll when and where Coulomb says") {
  // r = 0.5 m, v0 = 2 m/s, mu = 0.2: slip ends at t = 2 v0 / (7 mu g) = 0.2912480 s with
  // 5/7 v0 = 1.4285714 m/s after 0.4992823 m (closed form); default tolerance 1 %.
  World world(settings());
  add(world, ground(0.2));
  BodySpec spec = ball(0.5, {0, 0, 0.5}, {2, 0, 0});
  spec.material.friction = 0.2;
  const BodyId body = add(world, spec);
  double slip_end_s = 0;
  double slip_end_m = 0;
  for (int tick = 1; tick <= 120; ++tick) {
    const BodyState before = state(world, body);
    world.step();
    const BodyState s = state(world, body);
    const double slip_before = before.v_WBcm.x - 0.5 * before.w_WB.y;
    const double slip = s.v_WBcm.x - 0.5 * s.w_WB.y;
    if (slip_end_s == 0 && slip < 1e-3) {
      const double part =
          slip_before / (3.5 * 0.2 * kGravity) * 60;  // of the tick: slip falls evenly
      slip_end_s = (tick - 1 + part) / 60;
      slip_end_m = before.p_WBo.x + part * (s.p_WBo.x - before.p_WBo.x);
    }
  }
  CHECK(slip_end_s == Approx(0.2912480).epsilon(0.01));
  CHECK(slip_end_m == Approx(0.4992823).epsilon(0.01));
  const BodyState s = state(world, body);
  CHECK(s.v_WBcm.x == Approx(1.4285714).epsilon(0.01));
  CHECK(s.w_WB.y == Approx(s.v_WBcm.x / 0.5).epsilon(1e-3));  // the contact sags by 0.14 mm
}

TEST_CASE("P14: a sliding box stops where Coulomb says: sliding stop") {
  // Edge 0.5 m, v0 = 5 m/s, mu = 0.5: 2.5484200 m in 1.0193680 s (closed form; Chrono's test
  // sliding_gravity asks for 0.5 %).
  for (const double direction : {0.0, 0.5, 1.0, 2.0}) {
    World world(settings());
    add(world, ground());
    const Vec3 e{std::cos(direction), std::sin(direction), 0};
    const BodyId body = add(world, brick({0.25, 0.25, 0.25}, {0, 0, 0.25}, {5 * e.x, 5 * e.y, 0}));
    int ticks = 0;
    double speed = 5;
    while (speed > 0.05 && ticks < 120) {
      world.step();
      ++ticks;
      speed = norm(state(world, body).v_WBcm);
    }
    const double last = speed / (0.5 * kGravity);  // s, for what is left
    steps(world, 60);
    const BodyState s = state(world, body);
    CAPTURE(direction);
    CHECK(s.p_WBo.x * e.x + s.p_WBo.y * e.y == Approx(2.5484200).epsilon(0.005));
    CHECK(std::abs(s.p_WBo.y * e.x - s.p_WBo.x * e.y) < 1e-2);  // in a straight line
    CHECK(ticks / 60.0 + last == Approx(1.0193680).epsilon(0.005));
  }
}

TEST_CASE("P18: two spheres part with the coefficient of restitution") {
  // r = 0.5 m at +-1 m/s: e_out = e_in (Chrono's test cor_normal, tolerance 1e-3).
  for (const double e : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    World world(weightless());
    BodySpec left = ball(0.5, {-1, 0, 0}, {1, 0, 0});
    BodySpec right = ball(0.5, {1, 0, 0}, {-1, 0, 0});
    left.material.restitution = right.material.restitution = e;
    const BodyId a = add(world, left);
    const BodyId b = add(world, right);
    steps(world, 120);
    CAPTURE(e);
    CHECK(state(world, a).v_WBcm.x == Approx(-e).margin(1e-3));
    CHECK(state(world, b).v_WBcm.x == Approx(e).margin(1e-3));
  }
}

TEST_CASE("P19: an elastic collision in free fall exchanges the velocities") {
  // r = 1 m, 5 and -10 m/s, gravity, 1 s at 60, 30 and 15 Hz: -10 and 5 plus g t (Jolt's test).
  for (const double rate : {60.0, 30.0, 15.0}) {
    World world(settings(rate));
    BodySpec left = ball(1, {-3, 0, 0}, {5, 0, 0});
    BodySpec right = ball(1, {3, 0, 0}, {-10, 0, 0});
    left.material = right.material = {0, 1};
    const BodyId a = add(world, left);
    const BodyId b = add(world, right);
    steps(world, static_cast<int>(rate));
    CAPTURE(rate);
    CHECK(distance(state(world, a).v_WBcm, {-10, 0, -kGravity}) < 1e-5);
    CHECK(distance(state(world, b).v_WBcm, {5, 0, -kGravity}) < 1e-5);
  }
}

TEST_CASE("P16: a box rests on a slope below the friction angle and slides above it") {
  // mu = 0.5, friction angle 26.565 degrees: 26.0 stays, creeping less than 1e-5 m in 10 s;
  // 27.1 slides with g (sin - mu cos), within 1 %.
  for (const double degrees : {26.0, 27.1}) {
    World world(settings());
    const double a = degrees * std::acos(-1.0) / 180;
    BodySpec slope = ground();
    slope.q_WB = {std::cos(a / 2), 0, std::sin(a / 2), 0};  // about y: down towards +x
    BodySpec box = brick({0.5, 0.5, 0.25}, {0.25 * std::sin(a), 0, 0.25 * std::cos(a)});
    box.q_WB = slope.q_WB;
    add(world, slope);
    const BodyId body = add(world, box);
    steps(world, 30);  // to settle
    const Vec3 begin = state(world, body).p_WBo;
    const double v_begin = norm(state(world, body).v_WBcm);
    steps(world, 600);
    CAPTURE(degrees);
    if (degrees < 26.5) {
      CHECK(distance(state(world, body).p_WBo, begin) < 1e-5);
    } else {
      const double acceleration = (norm(state(world, body).v_WBcm) - v_begin) / 10;
      CHECK(acceleration == Approx(kGravity * (std::sin(a) - 0.5 * std::cos(a))).epsilon(0.01));
    }
  }
}

TEST_CASE("a stack of ten cubes stands, and sinks in as the law of sag says") {
  WorldSettings how = settings();
  how.solver = "soft";
  how.sub_steps = 4;
  World world(how);
  add(world, ground());
  std::vector<BodyId> cubes;
  for (int i = 0; i < 10; ++i) cubes.push_back(add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5 + i})));
  const double energy_start = world.totals().potential_energy_J;
  steps(world, 600);
  const BodyState top = state(world, cubes.back());
  // Each contact sags by F / (mu omega^2) under the weight above it, omega = 2 pi 0.177 * 240 Hz;
  // between two cubes mu = 1/2 kg, on the ground 1 kg (solver-substep law): 12.6 mm in all.
  const double omega = 2 * std::acos(-1.0) * 0.177 * 240;
  double sag = 10 * kGravity / (omega * omega);
  for (int above = 1; above < 10; ++above) sag += above * kGravity / (0.5 * omega * omega);
  CHECK(9.5 - top.p_WBo.z == Approx(sag).epsilon(0.2));
  CHECK(std::hypot(top.p_WBo.x, top.p_WBo.y) < 0.02);
  CHECK(norm(top.v_WBcm) < 1e-3);
  CHECK(world.totals().potential_energy_J <= energy_start);  // E11: separation adds no energy
}

TEST_CASE("two half overlapped cubes part without popping") {
  // What is kept of the push-out is a known limit of solving a manifold point by point: Box3D keeps
  // 0.54 m/s, sweeps over points 0.3 m/s (both measured at the same scene); the goal is 0.1 m/s.
  World world(weightless());
  const BodyId a = add(world, brick({0.5, 0.5, 0.5}, {}));
  const BodyId b = add(world, brick({0.5, 0.5, 0.5}, {0.5, 0, 0}));
  double fastest = 0;
  for (int i = 0; i < 60; ++i) {
    world.step();
    fastest = std::fmax(fastest, norm(state(world, b).v_WBcm));
  }
  const double gap = state(world, b).p_WBo.x - state(world, a).p_WBo.x - 1;
  CHECK(gap > -0.02);
  CHECK(gap < 0.3);
  CHECK(fastest < 0.3);
}

TEST_CASE("every bounce keeps the square of the restitution of the height") {
  // e = 0.8 from 10 m clear: the energy above the floor falls to 0.64 at each of five bounces.
  World world(settings());
  add(world, ground());
  BodySpec spec = ball(0.5, {0, 0, 10.5});
  spec.material.restitution = 0.8;
  const BodyId body = add(world, spec);
  double height = 10;
  int bounces = 0;
  for (int tick = 0; tick < 900 && bounces < 5; ++tick) {
    const double before = state(world, body).v_WBcm.z;
    world.step();
    const BodyState s = state(world, body);
    if (before >= 0 || s.v_WBcm.z <= 0) continue;
    ++bounces;
    const double apex = s.p_WBo.z - 0.5 + s.v_WBcm.z * s.v_WBcm.z / (2 * kGravity);
    CHECK(apex / height == Approx(0.64).epsilon(1e-9));
    height = apex;
  }
  CHECK(bounces == 5);
}

TEST_CASE("a dropped ball bounces lower and lower and comes to rest") {
  World world(settings());
  add(world, ground());
  BodySpec spec = ball(0.5, {0, 0, 1.5});
  spec.material.restitution = 0.5;
  const BodyId body = add(world, spec);
  double energy = world.totals().kinetic_energy_J + world.totals().potential_energy_J;
  for (int i = 0; i < 300; ++i) {
    world.step();
    const double now = world.totals().kinetic_energy_J + world.totals().potential_energy_J;
    CHECK(now <= energy + 1e-2);  // J, of 14.7: no impact adds energy beyond the step's own error
    energy = now;
  }
  CHECK(norm(state(world, body).v_WBcm) < 1e-6);
  CHECK(state(world, body).p_WBo.z == Approx(0.5).margin(1e-3));
}

TEST_CASE("a fast sphere does not tunnel through a thin wall") {
  World world(weightless());
  BodySpec wall = brick({0.01, 2, 2}, {});
  wall.kind = BodyKind::fixed;
  add(world, wall);
  const BodyId bullet = add(world, ball(0.05, {-5.003, 0, 0}, {1000, 0, 0}));
  steps(world, 10);
  CHECK(state(world, bullet).p_WBo.x == Approx(-0.06).margin(1e-3));
}

}  // namespace cradle
