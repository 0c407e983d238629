// The gyroscopic term of bodies in contact: it neither makes nor takes energy.
#include "server/dynamics/gyroscopic.h"

#include <catch2/catch.hpp>

#include "tests/physics/flock.h"
#include "tests/physics/worlds.h"

namespace cradle {

TEST_CASE("torque-free sub-steps keep energy and momentum, slow or fast") {
  std::mt19937_64 random(5);
  double energy_error = 0, momentum_error = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Vector J = random_inertia(random);
    const double turn = 0.01 * std::pow(5000, uniform(random, 0, 1));  // h |w|, 0.01 .. 50
    const double h = 1.0 / 240;
    const Vector before = turn / h * random_axis(random);
    const Vector after = gyroscopic_step(before, J, h);
    const double energy = J.dot(after.cwiseAbs2()) / J.dot(before.cwiseAbs2());
    const double momentum = J.cwiseProduct(after).norm() / J.cwiseProduct(before).norm();
    energy_error = std::fmax(energy_error, std::abs(energy - 1));
    momentum_error = std::fmax(momentum_error, std::abs(momentum - 1));
    if (J.x() == J.y() && J.y() == J.z()) CHECK(after == before);
  }
  CHECK(energy_error < 1e-9);
  CHECK(momentum_error < 1e-9);
}

TEST_CASE("a long torque-free sub-step is the sum of short ones") {
  std::mt19937_64 random(6);
  for (int i = 0; i < 200; ++i) {
    const Vector J = random_inertia(random);
    const Vector start = uniform(random, 0.01, 3) * random_axis(random);
    Vector w = start;
    for (int step = 0; step < 100; ++step) w = gyroscopic_step(w, J, 0.01);
    CHECK((gyroscopic_step(start, J, 1) - w).norm() < 1e-8 * start.norm());
  }
}

TEST_CASE("equal moments have no gyroscopic term, and no speed hangs or explodes") {
  const Vector w(1, -2, 3);
  CHECK(gyroscopic_step(w, {2, 2, 2}, 0.1) == w);
  const Vector J(1, 2, 2.5);
  const Vector fast = gyroscopic_step(1e5 * w, J, 1);  // more than the steps allowed
  CHECK(J.dot(fast.cwiseAbs2()) == Approx(1e10 * J.dot(w.cwiseAbs2())).epsilon(1e-9));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(gyroscopic_step({nan, 0, 0}, J, 1).hasNaN());
}

TEST_CASE("a fast body that rests on ice gains no energy by tumbling") {
  World world(settings());
  add(world, ground(0));
  BodySpec spec = ball(0.5, {0, 0, 0.5});
  spec.mass_kg = 10;
  spec.material.friction = 0;
  spec.inertia_kgm2 = {5.07187, 9.98451, 14.6078};
  spec.w_WB = {-123.267, -463.409, -21.3765};
  const BodyId body = add(world, spec);
  const double start_J = world.totals().kinetic_energy_J;
  double before_J = start_J;
  for (int tick = 0; tick < 60; ++tick) {
    world.step();
    const double now_J = world.totals().kinetic_energy_J;
    CHECK(now_J <= before_J * (1 + 1e-9));
    before_J = now_J;
  }
  CHECK(before_J == Approx(start_J).epsilon(1e-6));  // nor is there anything that takes it
  CHECK(state(world, body).p_WBo.z == Approx(0.5).margin(1e-3));
}

}  // namespace cradle
