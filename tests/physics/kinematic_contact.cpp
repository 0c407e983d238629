// What kinematic bodies do to bodies that lie on them: a contact goes with v + w x r of its place.
#include <catch2/catch.hpp>

#include "tests/physics/worlds.h"

namespace cradle {
namespace {

constexpr double kHalfTurn = 3.14159265358979;

struct Turntable {
  World world;
  BodyId box;
  double radius_m;
};

/// A box on a disc that turns about z at `w`, which has the box's velocity from the start.
Turntable turntable(double rate_hz, double w, double radius_m, double friction) {
  Turntable made{World(settings(rate_hz)), {}, radius_m};
  BodySpec disc;
  disc.kind = BodyKind::kinematic;
  disc.shape = Shape::cylinder(2, 0.1);
  disc.p_WBo = {3, -1, -0.1};
  disc.w_WB = {0, 0, w};
  disc.material.friction = friction;
  add(made.world, disc);
  BodySpec box = brick({0.1, 0.1, 0.1}, {3 + radius_m, -1, 0.1}, {0, w * radius_m, 0});
  box.w_WB = {0, 0, w};
  box.material.friction = friction;
  made.box = add(made.world, box);
  return made;
}

}  // namespace

TEST_CASE("a turntable takes along what friction can hold: once round, and where it was") {
  for (const double rate : {60.0, 240.0}) {
    const double w = 2;  // w^2 r = 4 m/s^2 of mu g = 4.9
    Turntable t = turntable(rate, w, 1, 0.5);
    const BodyState before = state(t.world, t.box);
    const auto ticks = static_cast<int>(std::lround(2 * kHalfTurn / w * rate));
    steps(t.world, ticks);
    const BodyState after = state(t.world, t.box);
    const double turned = w * ticks / rate;
    const Vec3 there{3 + std::cos(turned), -1 + std::sin(turned), before.p_WBo.z};
    INFO("at " << rate << " Hz: " << distance(after.p_WBo, there) << " m off, radius "
               << std::hypot(after.p_WBo.x - 3, after.p_WBo.y + 1));
    CHECK(distance(after.p_WBo, there) < 5e-3);
    CHECK(after.w_WB.z == Approx(w).epsilon(1e-3));
    CHECK(norm(after.v_WBcm) == Approx(w).epsilon(5e-3));
  }
}

TEST_CASE("a turntable throws off what friction cannot hold") {
  Turntable t = turntable(60, 2, 1.5, 0.5);  // w^2 r = 6 m/s^2 of mu g = 4.9
  steps(t.world, 60);
  const BodyState box = state(t.world, t.box);
  CHECK(std::hypot(box.p_WBo.x - 3, box.p_WBo.y + 1) > 1.6);
}

TEST_CASE("a turntable gives a box at its centre its spin, and moves it nowhere") {
  Turntable t = turntable(60, 3, 0, 0.5);
  World& world = t.world;
  steps(world, 120);
  const BodyState box = state(world, t.box);
  CHECK(box.w_WB.z == Approx(3).epsilon(1e-6));
  CHECK(std::hypot(box.p_WBo.x - 3, box.p_WBo.y + 1) < 1e-6);
}

TEST_CASE("a belt takes a box along: v by mu g, over v^2 / (2 mu g)") {
  World world(settings());
  BodySpec belt = brick({50, 1, 0.1}, {0, 0, -0.1}, {3, 0, 0});
  belt.kind = BodyKind::kinematic;
  add(world, belt);
  const BodyId box = add(world, brick({0.3, 0.3, 0.1}, {0, 0, 0.1}));
  const double a = 0.5 * kGravity, slips_s = 3 / a;
  steps(world, 60);
  CHECK(state(world, box).v_WBcm.x == Approx(3).epsilon(1e-9));
  CHECK(state(world, box).p_WBo.x == Approx(3 - 0.5 * a * slips_s * slips_s).epsilon(1e-3));
}

TEST_CASE("a seesaw lifts what lies far from its axis by w x r") {
  World world(settings(240));
  BodySpec beam = brick({2, 0.3, 0.05}, {0, 0, -0.05});
  beam.kind = BodyKind::kinematic;
  beam.w_WB = {0, -0.2, 0};  // its end at x = 2 rises
  beam.material.friction = 2;
  add(world, beam);
  BodySpec spec = brick({0.1, 0.1, 0.1}, {1.5, 0, 0.1});
  spec.material.friction = 2;
  const BodyId box = add(world, spec);
  steps(world, 120);
  const double turned = 0.2 * 0.5;
  const BodyState end = state(world, box);
  // It goes round with the beam: its centre is 1.5 m out and 0.15 m above the middle of the beam.
  CHECK(end.p_WBo.z ==
        Approx(-0.05 + 1.5 * std::sin(turned) + 0.15 * std::cos(turned)).margin(2e-3));
  CHECK(end.p_WBo.x == Approx(1.5 * std::cos(turned) - 0.15 * std::sin(turned)).margin(2e-3));
  CHECK(end.w_WB.y == Approx(-0.2).epsilon(0.02));
}

}  // namespace cradle
