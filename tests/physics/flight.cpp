// Free flight against closed forms and published references.
#include <catch2/catch.hpp>

#include "tests/physics/worlds.h"

namespace cradle {

TEST_CASE("P01: a projectile is where the parabola says after two seconds") {
  World world(settings());
  const BodyId body = add(world, ball(0.5, {}, {3, 4, 5}));
  steps(world, 120);
  // x = v0 t - g t^2 / 2, v = v0 - g t (closed form). Semi-implicit Euler misses z by 0.16 m.
  const BodyState s = state(world, body);
  CHECK(distance(s.p_WBo, {6, 8, 10 - 0.5 * kGravity * 4}) < 1e-12);
  CHECK(distance(s.v_WBcm, {3, 4, 5 - kGravity * 2}) < 1e-12);
}

TEST_CASE("P03: a force to the right of the centre turns the body the right way") {
  // Arm (1, 0, 0) m, force (0, 0, 1) N, J = 1: torque arm x force = (0, -1, 0) N m, so after 1 s
  // w = (0, -1, 0) rad/s. The seed paper's printed arm, x - xi, gives (0, +1, 0).
  World world(weightless());
  BodySpec spec;
  spec.mass_kg = 1;
  spec.inertia_kgm2 = {1, 1, 1};
  const BodyId body = add(world, spec);
  Wrench push;
  push.body = body;
  push.point_kind = WrenchPoint::world_point;
  push.point = {1, 0, 0};
  push.value = {0, 0, 1};
  push.duration = WrenchDuration::ticks;
  push.ticks = 60;
  REQUIRE(world.push(std::array{push}).result == Result::ok);
  steps(world, 60);
  CHECK(distance(state(world, body).w_WB, {0, -1, 0}) < 1e-12);
  CHECK(distance(state(world, body).v_WBcm, {0, 0, 1}) < 1e-12);
  steps(world, 60);  // the wrench has ended
  CHECK(distance(state(world, body).w_WB, {0, -1, 0}) < 1e-12);
}

TEST_CASE("P07: an asymmetric body tumbles to the published attitude") {
  // Box of half extents 0.1, 0.2, 0.3 m, w0 = (1, 2, 3) rad/s; attitude after 5 s from RK4 in
  // extended precision with 400 000 steps.
  World world(weightless());
  BodySpec spec = brick({0.1, 0.2, 0.3}, {});
  spec.w_WB = {1, 2, 3};
  const BodyId body = add(world, spec);
  const Totals before = world.totals();
  CHECK(before.kinetic_energy_J == Approx(0.163333333333).epsilon(1e-11));
  steps(world, 300);
  const Quat reference{-0.364863742986863, 0.023563357342589, 0.021262001052007,
                       -0.930519824912735};
  CHECK(angle(state(world, body).q_WB, reference) < 1e-7);
  const Totals after = world.totals();
  CHECK(std::abs(after.kinetic_energy_J / before.kinetic_energy_J - 1) < 1e-12);
  CHECK(distance(after.angular_momentum_Nms, before.angular_momentum_Nms) < 1e-13);
}

TEST_CASE("P08: a body spun about its middle axis flips when the elliptic integral says") {
  // w_y of the box of P07 with w0 = (.05, 5, .05) first vanishes at 2.0969670 s, then every
  // 5.110152307 s (Jacobi elliptic functions, k^2 = .999925349). Without the gyroscopic term of
  // Euler's equation, which the seed paper omits, it never flips.
  World world(weightless());
  BodySpec spec = brick({0.1, 0.2, 0.3}, {});
  spec.w_WB = {0.05, 5, 0.05};
  const BodyId body = add(world, spec);
  std::vector<double> flips;
  const auto spin_about_own_y = [&] {
    const BodyState s = state(world, body);
    const auto [w, x, y, z] = s.q_WB;
    const Vec3 axis{2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
    return axis.x * s.w_WB.x + axis.y * s.w_WB.y + axis.z * s.w_WB.z;
  };
  double last = spin_about_own_y();
  for (int tick = 1; tick <= 720; ++tick) {
    world.step();
    const double now = spin_about_own_y();
    if (last * now < 0) flips.push_back((tick - now / (now - last)) / 60.0);
    last = now;
  }
  REQUIRE(flips.size() == 2);
  // The zero is interpolated between ticks: about 1e-4 s.
  CHECK(flips[0] == Approx(2.0969670).margin(1e-3));
  CHECK(flips[1] - flips[0] == Approx(5.110152307).margin(1e-3));
}

TEST_CASE("a torque on a turned body meets its turned inertia") {
  // Erratum E3 of the seed paper: J in the world is R J R^T. A box turned by 90 degrees about z and
  // twisted about x feels the moment about its own y axis.
  World world(weightless());
  BodySpec spec = brick({0.5, 1, 1.5}, {});
  spec.q_WB = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
  const BodyId body = add(world, spec);
  Wrench twist;
  twist.body = body;
  twist.quantity = WrenchQuantity::angular_impulse;
  twist.value = {1, 0, 0};
  world.push(std::array{twist});
  world.step();
  const double J_y = (0.5 * 0.5 + 1.5 * 1.5) / 3;  // m/3 (a^2 + c^2)
  CHECK(state(world, body).w_WB.x == Approx(1 / J_y).epsilon(1e-12));
}

TEST_CASE("rotations about different axes do not commute") {
  // Erratum E4: there is no rotation vector whose derivative is the angular velocity.
  const auto turned = [](const Vec3& first, const Vec3& second) {
    World world(weightless());
    const BodyId body = add(world, ball(0.5, {}));
    for (const Vec3& w : {first, second}) {
      Motion motion;
      motion.body = body;
      motion.sets_velocity = true;
      motion.w_WB = w;
      world.set_motion(std::array{motion});
      steps(world, 60);
    }
    return state(world, body).q_WB;
  };
  const double quarter = std::acos(0.0);  // rad/s for a second
  const Quat x_then_y = turned({quarter, 0, 0}, {0, quarter, 0});
  const Quat y_then_x = turned({0, quarter, 0}, {quarter, 0, 0});
  // Products of the quaternions (s, s, 0, 0) and (s, 0, s, 0), s = sqrt(1/2): left factor is last.
  CHECK(angle(x_then_y, {0.5, 0.5, 0.5, -0.5}) < 1e-7);
  CHECK(angle(y_then_x, {0.5, 0.5, 0.5, 0.5}) < 1e-7);
}

TEST_CASE("a body spinning through many turns a tick comes round") {
  // A sphere at w turns by w t exactly; 1000 rad/s is 16.7 rad a tick.
  World world(weightless());
  BodySpec spec = ball(0.5, {});
  spec.w_WB = {0, 0, 1000};
  const BodyId body = add(world, spec);
  steps(world, 60);
  const double half = 500;  // rad
  CHECK(angle(state(world, body).q_WB, {std::cos(half), 0, 0, std::sin(half)}) < 1e-7);
}

TEST_CASE("a kinematic body keeps its velocities whatever pushes it") {
  World world(settings());
  BodySpec spec = brick({0.5, 0.5, 0.5}, {0, 0, 3}, {1, 0, 0});
  spec.kind = BodyKind::kinematic;
  const BodyId lift = add(world, spec);
  const BodyId load = add(world, ball(0.5, {0.5, 0, 4.1}));
  steps(world, 60);
  CHECK(distance(state(world, lift).p_WBo, {1, 0, 3}) < 1e-12);
  CHECK(state(world, load).in_contact);
}

}  // namespace cradle
