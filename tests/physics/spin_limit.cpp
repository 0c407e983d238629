// What an impact would spin beyond the limit of angular velocity is slowed, and stays in the world.
#include <catch2/catch.hpp>

#include "tests/physics/worlds.h"

namespace cradle {
namespace {

BodySpec driven_wall(double half_height_m) {
  BodySpec spec = brick({0.0005, 300, half_height_m}, {}, {-10.6, 0, 0});
  spec.kind = BodyKind::kinematic;
  return spec;
}

}  // namespace

TEST_CASE("what an impact would spin beyond the limit stays in the way") {
  // A plate 4 mm long that is hit beside its middle at 900 m/s would turn at 4e5 rad/s.
  World world(weightless());
  const BodySpec driven = driven_wall(30);
  const BodyId wall_id = add(world, driven);
  std::vector<BodyId> plates;
  for (int k = 0; k < 40; ++k) {
    BodySpec plate = brick({0.0019, 0.00127, 0.00063}, {-8, -12 + 0.6 * k, 0}, {900, 0, 0});
    plate.q_WB = to_plain(Rotation(0.3 + 0.05 * k, 0.2, -0.5, 0.7 - 0.03 * k).normalized());
    plates.push_back(add(world, plate));
  }
  int cut = 0;
  double energy = world.totals().kinetic_energy_J;
  for (int tick = 0; tick < 30; ++tick) {
    cut += world.step().spins_cut;
    for (const BodyId id : plates)
      REQUIRE(state(world, id).p_WBo.x < state(world, wall_id).p_WBo.x);
  }
  CHECK(cut > 0);
  CHECK(world.quarantined_count() == 0);
  CHECK(world.totals().kinetic_energy_J < energy);
}

TEST_CASE("a spin that is cut is within the limit, also along an axis") {
  WorldSettings plane = weightless();
  plane.is_planar = true;
  World world(plane);
  const BodySpec driven = driven_wall(0.5);
  add(world, driven);
  for (int k = 0; k < 400; ++k) {
    BodySpec plate = brick({0.0019, 0.00127, 0.5}, {-8, -120 + 0.6 * k, 0}, {900, 0, 0});
    plate.q_WB = {std::cos(0.005 * k), 0, 0, std::sin(0.005 * k)};
    add(world, plate);
  }
  int cut = 0;
  for (int tick = 0; tick < 30; ++tick) cut += world.step().spins_cut;
  CHECK(cut > 20);
  CHECK(world.quarantined_count() == 0);
}

TEST_CASE("a spin that cannot be followed ends in quarantine and in no false attitude") {
  // At one tick a second the fastest turn by 7 rad a step of the series, which holds for 0.2.
  WorldSettings slow = weightless();
  slow.rate_hz = limits::kRateMin_hz;
  World world(slow);
  for (int k = 0; k < 60; ++k) {
    const double spin = limits::kAngularSpeedMax_radps * (k % 20 + 1) / 20;
    BodySpec spec = brick({0.5, 0.3 + 0.003 * k, 0.1}, {0, 0, 10.0 * k}, {});
    if (k % 3 == 0) spec.shape = Shape::sphere(0.5);
    spec.w_WB = {0.6 * spin, -0.7 * spin, 0.5 * spin};
    add(world, spec);
  }
  std::vector<BodyState> bodies;
  for (int tick = 0; tick < 5; ++tick) {
    world.step();
    world.snapshot(bodies);
    for (const BodyState& body : bodies) {
      const Quat& q = body.q_WB;
      CHECK(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z == Approx(1).margin(2e-9).epsilon(0));
    }
  }
  CHECK(world.quarantined_count() > 0);
  CHECK(world.quarantined_count() < 40);  // a ball's attitude is known at any spin
}

}  // namespace cradle
