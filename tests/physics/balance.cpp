// What became of energy and momentum: by what, in closed forms; and contact residuals.
#include <catch2/catch.hpp>
#include <cstring>
#include <functional>

#include "server/dynamics/contact/contact_balance.h"
#include "server/dynamics/contact/softness.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

/// Each tick has a balance, flight included.
WorldSettings watched(double rate_hz = 60, const Vec3& gravity_W = {0, 0, -kGravity},
                      const std::string& solver = WorldSettings{}.solver) {
  WorldSettings how = settings(rate_hz, gravity_W);
  how.solver = solver;
  how.balance_every = 1;
  how.balance_flight = true;
  return how;
}

/// Of a number of ticks: the sums, and the largest of what is not accounted for in any.
struct Sum : StepBalance {
  double worst_J = 0, worst_Ns = 0;
};
Sum run(World& world, int ticks) {
  Sum sum;
  for (int k = 0; k < ticks; ++k) {
    const StepBalance one = world.step().balance;
    CHECK(one.tick == world.tick());
    sum.kinetic_J += one.kinetic_J;
    sum.gravity_J += one.gravity_J;
    sum.wrenches_J += one.wrenches_J;
    sum.friction_J += one.friction_J;
    sum.impacts_J += one.impacts_J;
    sum.driven_J += one.driven_J;
    sum.unaccounted_J += one.unaccounted_J;
    sum.worst_J = std::max(sum.worst_J, std::abs(one.unaccounted_J));
    sum.worst_Ns = std::max(sum.worst_Ns, one.momentum_unaccounted_Ns);
  }
  return sum;
}

Wrench force(BodyId body, const Vec3& value, WrenchQuantity quantity = WrenchQuantity::force) {
  Wrench wrench;
  wrench.body = body;
  wrench.quantity = quantity;
  wrench.duration = WrenchDuration::until_cleared;
  if (quantity == WrenchQuantity::impulse) wrench.duration = WrenchDuration::this_tick;
  wrench.value = value;
  return wrench;
}

/// A block of 2 kg that lies on the ground, at rest in itself.
BodyId settled_block(World& world, double friction) {
  add(world, ground(friction));
  BodySpec spec = brick({0.5, 0.5, 0.1}, {0, 0, 0.1});
  spec.mass_kg = 2;
  spec.material.friction = friction;
  const BodyId block = add(world, spec);
  steps(world, 60);
  return block;
}

}  // namespace

TEST_CASE("balance: friction takes mu m g d of a block that slides to a stop") {
  const std::string solver = GENERATE("soft", "hybrid");
  World world(watched(60, {0, 0, -kGravity}, solver));
  const BodyId block = settled_block(world, 0.4);
  const double x0 = state(world, block).p_WBo.x;
  world.push(std::array{force(block, {6, 0, 0}, WrenchQuantity::impulse)});  // 3 m/s
  const Sum sum = run(world, 120);
  const double way = state(world, block).p_WBo.x - x0;
  CHECK(sum.wrenches_J == Approx(9).epsilon(1e-9));  // m v^2 / 2
  CHECK(way == Approx(9 / (2 * 0.4 * kGravity)).epsilon(1e-3));
  CHECK(sum.friction_J == Approx(-0.4 * 2 * kGravity * way).epsilon(1e-4));
  CHECK(sum.friction_J == Approx(-9).epsilon(1e-4));
  CHECK(std::abs(sum.kinetic_J) < 1e-9);
  // Of 9 J. By soft steps it leans forward at once, as contacts sink in; where it has lain still by
  // "hybrid", all of it sinks in, by g / omega^2, which its contacts' springs take.
  const double omega = contact_angle() * 240;
  CHECK(sum.worst_J < (solver == "soft" ? 3e-5 : 2 * kGravity * kGravity / (omega * omega)));
  CHECK(sum.worst_Ns < 1e-12);
}

TEST_CASE("balance: a block that is pushed gets what the force does, less friction") {
  World world(watched(60, {0, 0, -kGravity}, "soft"));
  const BodyId block = settled_block(world, 0.25);
  world.push(std::array{force(block, {8, 0, 0})});
  // Friction sets in at the end of the first sub-step: until then the block moves as if there were
  // none. That way of a dt^2 / 2 is not accounted for.
  const StepBalance first = world.step().balance;
  const double h = 1.0 / 240;
  CHECK(first.unaccounted_J == Approx(-8 * 0.5 * 0.25 * kGravity * h * h).epsilon(1e-3));
  const double x0 = state(world, block).p_WBo.x, v0 = state(world, block).v_WBcm.x;
  const Sum sum = run(world, 60);
  const double way = state(world, block).p_WBo.x - x0, a = 8.0 / 2 - 0.25 * kGravity;
  CHECK(way == Approx(v0 + 0.5 * a).epsilon(1e-5));
  CHECK(sum.wrenches_J == Approx(8 * way).epsilon(1e-9));
  CHECK(sum.friction_J == Approx(-0.25 * 2 * kGravity * way).epsilon(1e-5));
  CHECK(sum.kinetic_J == Approx(0.5 * 2 * ((v0 + a) * (v0 + a) - v0 * v0)).epsilon(1e-5));
  CHECK(sum.worst_J < 1e-7);
  CHECK(sum.worst_Ns < 1e-12);
}

TEST_CASE("balance: a body that falls has what gravity gives it, to rounding") {
  World world(watched());
  BodySpec spec = brick({0.1, 0.2, 0.3}, {0, 0, 100}, {3, 0, 4});
  spec.mass_kg = 5;
  spec.w_WB = {1, 2, 3};
  const BodyId body = add(world, spec);
  const BodyId pushed = add(world, ball(0.5, {9, 0, 100}));
  world.push(std::array{force(pushed, {2, 0, 0})});
  const Sum sum = run(world, 60);
  const double fall = 0.5 * kGravity - 4, way = state(world, pushed).p_WBo.x - 9;
  CHECK(100 - state(world, body).p_WBo.z == Approx(fall));
  CHECK(way == Approx(1));
  CHECK(sum.gravity_J == Approx(5 * kGravity * fall + kGravity * 0.5 * kGravity));
  CHECK(sum.wrenches_J == Approx(2 * way));
  CHECK(sum.worst_J < 1e-11);
  CHECK(sum.worst_Ns < 1e-12);
}

TEST_CASE("balance: a scheme that errs in flight is seen to") {
  WorldSettings how = watched();
  how.scheme = "explicit_euler";
  World world(how);
  add(world, ball(0.5, {0, 0, 100}));
  // Each tick it gains m (g dt)^2 / 2.
  const Sum sum = run(world, 60);
  CHECK(sum.unaccounted_J == Approx(60 * 0.5 * kGravity * kGravity / 3600));
}

TEST_CASE("balance: an impact takes (1 - e^2) of the energy along the normal") {
  const auto bounce = [](const BodySpec& falling, double e) {
    World world(watched(60, {0, 0, 0}));
    BodySpec floor = ground(0);
    floor.material.restitution = e;
    add(world, floor);
    BodySpec spec = falling;
    spec.mass_kg = 3;
    spec.v_WBcm = {1, 0, -4};
    spec.material.restitution = e;
    spec.material.friction = 0;
    add(world, spec);
    return run(world, 30);
  };
  const double along_n = 0.5 * 3 * 16;
  for (const double e : {0.0, 0.5, 1.0}) {
    INFO("e = " << e);
    const Sum of_ball = bounce(ball(0.2, {0, 0, 0.9}), e);  // by events
    CHECK(of_ball.impacts_J == Approx(-(1 - e * e) * along_n).margin(1e-12));
    CHECK(of_ball.worst_J < 1e-12);
    const Sum of_box = bounce(brick({0.2, 0.2, 0.2}, {0, 0, 0.9}), e);  // in its sub-step
    CHECK(of_box.impacts_J == Approx(-(1 - e * e) * along_n).epsilon(1e-9).margin(1e-9));
    CHECK(of_box.worst_J < 1e-9);
    CHECK(of_box.worst_Ns < 1e-12);
  }
}

TEST_CASE("balance: momentum is what loads and the ground give, in a heap that falls in") {
  const std::string solver = GENERATE("soft", "hybrid");
  // Newton's method stops where so much of a weight's impulse is left.
  const double left_Ns = solver == "soft" ? 1e-10 : 1e-6 * kGravity / 60;
  World world(watched(60, {0, 0, -kGravity}, solver));
  add(world, ground());
  for (int i = 0; i < 40; ++i) {
    const Vec3 at{0.07 * (i % 7), 0.05 * (i % 5), 0.3 + 0.45 * i};
    BodySpec spec = brick({0.3, 0.2, 0.1 + 0.002 * i}, at);
    if (i % 3 == 0) spec.shape = Shape::capsule(0.15, 0.3);
    if (i % 5 == 0) spec.material.restitution = 0.4;
    spec.w_WB = {1.0 * (i % 4), 2, 1.0 * (i % 3)};
    add(world, spec);
  }
  Sum sum;
  for (int k = 0; k < 240; ++k) {
    const StepReport report = world.step();
    sum.friction_J += report.balance.friction_J;
    sum.impacts_J += report.balance.impacts_J;
    sum.unaccounted_J += report.balance.unaccounted_J;
    // What stops on its way to be seen next tick loses what gravity would have given it.
    const double lost = report.stopped_at_impact * kGravity / 60;
    CHECK(report.balance.momentum_unaccounted_Ns <= lost + left_Ns);
  }
  CHECK(sum.friction_J < -1);
  CHECK(sum.impacts_J < -100);
  INFO(sum.unaccounted_J << " J of " << sum.impacts_J);
  CHECK(std::abs(sum.unaccounted_J) < 0.05 * std::abs(sum.impacts_J));
}

TEST_CASE("balance: what a belt does to a box that it takes along") {
  for (const bool is_belt_first : {true, false}) {
    INFO("belt first: " << is_belt_first);
    World world(watched());
    BodySpec belt = brick({20, 1, 0.1}, {0, 0, -0.1}, {2, 0, 0});
    belt.kind = BodyKind::kinematic;
    BodySpec spec = brick({0.3, 0.3, 0.1}, {0, 0, 0.1});
    spec.mass_kg = 4;
    if (is_belt_first) add(world, belt);
    const BodyId box = add(world, spec);
    if (!is_belt_first) add(world, belt);
    const Sum sum = run(world, 60);
    CHECK(state(world, box).v_WBcm.x == Approx(2).epsilon(1e-9));
    // The belt goes twice as far as the box while it slips: half of what it does becomes heat.
    CHECK(sum.kinetic_J == Approx(8).epsilon(1e-4));
    CHECK(sum.driven_J == Approx(16).epsilon(1e-3));
    CHECK(sum.friction_J == Approx(-8).epsilon(1e-3));
    CHECK(sum.worst_Ns < 1e-12);
  }
}

TEST_CASE("balance: pushing an overlap out is accounted for by nothing") {
  World world(watched());
  add(world, ground());
  const BodyId box = add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.4}));
  const Sum sum = run(world, 120);
  const double rise = state(world, box).p_WBo.z - 0.4;
  CHECK(rise == Approx(0.1).margin(1e-3));
  CHECK(sum.gravity_J == Approx(-kGravity * rise));
  CHECK(sum.unaccounted_J == Approx(kGravity * rise).epsilon(0.05));
}

TEST_CASE("balance: every so many ticks, or never, and the motion is the same") {
  const auto hash = [](int every) {
    WorldSettings how = settings();
    how.balance_every = every;
    World world(how);
    add(world, ground());
    for (int i = 0; i < 6; ++i) add(world, brick({0.3, 0.2, 0.1}, {0.1 * i, 0, 0.2 + 0.3 * i}));
    for (Tick tick = 1; tick <= 40; ++tick) {
      const StepReport report = world.step();
      CHECK(report.balance.tick == (every == 0 ? 0 : tick - tick % every));
    }
    return world.hash();
  };
  const auto never = hash(0);
  CHECK(hash(1) == never);
  CHECK(hash(7) == never);
}

TEST_CASE("residual: what the laws of contact allow has none") {
  const double K = 2, mu = 0.5;
  const auto of = [&](const Vector& impulse, const Vector& velocity) {
    return residual_of(K, mu, impulse, velocity);
  };
  const double at_limit = 3 * mu;
  for (const auto& [impulse, velocity] :
       {std::pair{Vector(0, 0, 0), Vector(1, 5, 5)},             // opens
        std::pair{Vector(3, 1, 1), Vector(0, 0, 0)},             // sticks
        std::pair{Vector(3, -at_limit, 0), Vector(0, 7, 0)}}) {  // slides
    const PointResidual r = of(impulse, velocity);
    CHECK(r.natural_mps < 1e-14);
    CHECK(r.signorini_mps == 0);
    CHECK(r.cone_mps == 0);
    CHECK(r.complementarity_J < 1e-14);
  }
}

TEST_CASE("residual: a wrong impulse has one, by how much it is wrong") {
  const double K = 2, mu = 0.5;
  // It presses while it opens at 0.1 m/s: 6 m/s of impulse stand against 0.1 of opening.
  const PointResidual opens = residual_of(K, mu, {3, 0, 0}, {0.1, 0, 0});
  CHECK(opens.signorini_mps == Approx(0.1));
  CHECK(opens.natural_mps == Approx(0.1));
  CHECK(opens.complementarity_J == Approx(0.3));
  // Nothing presses while it sinks in at 0.2 m/s.
  const PointResidual sinks = residual_of(K, mu, {0, 0, 0}, {-0.2, 0, 0});
  CHECK(sinks.signorini_mps == Approx(0.2));
  CHECK(sinks.natural_mps == Approx(0.2));
  // Friction is beyond mu lambda by 0.5 N s: 1 m/s, and the cone is nearer than that.
  const PointResidual beyond = residual_of(K, mu, {3, 2, 0}, {0, 0, 0});
  CHECK(beyond.cone_mps == Approx(1));
  CHECK(beyond.natural_mps == Approx(1 / std::sqrt(1.25)));
  // It slides without friction.
  const PointResidual smooth = residual_of(K, mu, {3, 0, 0}, {0, 4, 0});
  CHECK(smooth.signorini_mps == 0);
  CHECK(smooth.complementarity_J == Approx(3 * mu * 4));
  CHECK(smooth.natural_mps > 1);
}

TEST_CASE("residual: of a block that slides next to none: friction opposes it at its limit") {
  World world(settings());
  const BodyId block = settled_block(world, 0.3);
  world.push(std::array{force(block, {8, 0, 0}, WrenchQuantity::impulse)});  // 4 m/s
  steps(world, 40);
  const StepReport report = world.step();
  CHECK(state(world, block).v_WBcm.x > 1);
  CHECK(report.residual_mps < 1e-6);
  CHECK(report.residual_cone_mps < 1e-12);
  CHECK(report.residual_complementarity_J < 1e-8);
}

TEST_CASE("residual: of a block at rest next to none, of a heap that falls in more") {
  World world(settings());
  settled_block(world, 0.5);
  steps(world, 60);
  const StepReport at_rest = world.step();
  CHECK(at_rest.contacts == 4);
  CHECK(at_rest.residual_mps < 1e-6 * kGravity / 60);  // what Newton's method leaves
  CHECK(at_rest.residual_relative < 1e-6);
  WorldSettings by_soft_steps = settings();
  by_soft_steps.solver = "soft";
  World soft(by_soft_steps);
  settled_block(soft, 0.5);
  steps(soft, 60);
  const StepReport soft_at_rest = soft.step();
  CHECK(soft_at_rest.residual_mps < 1e-9);
  CHECK(soft_at_rest.residual_relative < 1e-8);
  World heap(settings());
  add(heap, ground());
  for (int i = 0; i < 30; ++i)
    add(heap, brick({0.3, 0.2, 0.1}, {0.05 * (i % 5), 0, 0.2 + 0.3 * i}));
  double most = 0;
  for (int k = 0; k < 120; ++k) {
    const StepReport report = heap.step();
    CHECK(report.residual_relative <= 1.5);
    // The projection onto the cone leaves at least this of a normal error.
    const double least = report.residual_signorini_mps / std::sqrt(1 + 0.5 * 0.5);
    CHECK(report.residual_mps >= least - 1e-12);
    most = std::max(most, report.residual_mps);
  }
  CHECK(most > 1e-4);
}

}  // namespace cradle
