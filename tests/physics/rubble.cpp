// What has fallen in on itself and comes to rest: soft steps give it to Newton's method, group by
// group. Over many seeds, because each has contacts of its own.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "tests/physics/worlds.h"

namespace cradle {
namespace {

constexpr int kRubbleSeeds = 12 + 5, kBodies = 48, kRubbleTicks = 900;

/// Boxes, cubes and hulls of twelve corners on a sphere, in twelve layers of four.
std::vector<BodyId> drop_rubble(World& world, unsigned seed) {
  std::mt19937 random(seed);
  const auto within = [&](double most) {
    return most * (std::ldexp(static_cast<double>(random()), -31) - 1);
  };
  std::vector<Vector> corners;
  for (int i = 0; i < 12; ++i) {
    corners.push_back(0.5 * Vector(within(1), within(1), within(1)).normalized());
  }
  const Shape hull =
      Shape::stored(ShapeKind::hull, world.add_geometry(make_hull(corners).geometry));
  add(world, ground(0.5));
  std::vector<BodyId> bodies;
  for (int i = 0; i < kBodies; ++i) {
    const double x = 1.2 * (i % 2 - 0.5) + within(0.1), y = 1.2 * (i / 2 % 2 - 0.5) + within(0.1);
    BodySpec spec = brick({0.5, 0.4, 0.3}, {x, y, 0.8 + 0.9 * (i / 4)});
    if (i % 3 == 1) spec.shape = hull;
    if (i % 3 == 2) spec.shape = Shape::box({0.3, 0.3, 0.3});
    const Rotation q(within(1), within(1), within(1), within(1));
    spec.q_WB = to_plain(q.normalized());
    spec.material.friction = 0.6;
    bodies.push_back(add(world, spec));
  }
  return bodies;
}

double energy_J(const World& world) {
  const Totals totals = world.totals();
  return totals.kinetic_energy_J + totals.potential_energy_J;
}

/// Nothing was to be solved; or what soft steps have brought to rest waits for Newton's method.
bool all_rest(const StepReport& report) {
  return report.islands == report.islands_at_rest ||
         (report.body_sub_steps == 0 && report.islands_by_newton == 0);
}
bool are_at_once(const StepReport& report) {
  return report.islands == report.islands_at_rest + report.islands_by_newton;
}

/// Of all seeds.
struct Rubble {
  int taken_over = 0, in_vain = 0, at_rest = 0;
  double jump_m = 0, gain_J = 0;  // at most, in ticks in which the last groups were taken over
};

void let_fall(unsigned seed, Rubble& outcome) {
  WorldSettings how = settings();
  how.solver = "hybrid";
  World world(how);
  const std::vector<BodyId> bodies = drop_rubble(world, seed);
  bool rests = false;
  for (int tick = 0; tick < kRubbleTicks && !rests; ++tick) {
    std::vector<Vec3> before;
    for (const BodyId body : bodies) before.push_back(state(world, body).p_WBo);
    const double energy_before_J = energy_J(world);
    const StepReport report = world.step();
    outcome.taken_over += report.islands_taken_over;
    outcome.in_vain += report.islands_makeshift;
    rests = tick > 100 && all_rest(report);
    if (report.islands_taken_over == 0 || !are_at_once(report)) continue;
    outcome.gain_J = std::fmax(outcome.gain_J, energy_J(world) - energy_before_J);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const double way = distance(state(world, bodies[i]).p_WBo, before[i]);
      outcome.jump_m = std::fmax(outcome.jump_m, way);
    }
  }
  outcome.at_rest += rests ? 1 : 0;
}

}  // namespace

TEST_CASE("rubble comes to rest group by group, without a jump, and none is tried in vain often") {
  Rubble outcome;
  for (unsigned seed = 1; seed <= 12; ++seed) let_fall(seed, outcome);
  // A group of these lies still at the peak of its sway, but not in balance: it would begin to move
  // as it is taken over, by up to 7e-5 m in that tick.
  for (const unsigned seed : {128u, 160u, 177u, 195u, 200u}) let_fall(seed, outcome);
  CAPTURE(outcome.taken_over, outcome.in_vain, outcome.at_rest, outcome.jump_m, outcome.gain_J);
  CHECK(outcome.taken_over > 15 * kRubbleSeeds);
  CHECK(outcome.in_vain < 0.1 * outcome.taken_over);
  CHECK(outcome.at_rest >= kRubbleSeeds - 1);  // within 15 s
  CHECK(outcome.jump_m < 1e-6);
  CHECK(outcome.gain_J < 1e-6);
}

}  // namespace cradle
