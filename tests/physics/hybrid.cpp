// The contact solver "hybrid": what rests by Newton's method, what moves by soft steps, and loads
// that go from one to the other without a jump.
#include <catch2/catch.hpp>
#include <random>
#include <string>
#include <vector>

#include "tests/physics/solver_cases.h"

namespace cradle {
namespace {

constexpr double kHybridYield = 1e-7;  // R by K of Newton's method: island_solver.h
constexpr double kJump_m = 1e-6;       // what a hand-over may move
constexpr double kGap_m = 0.002;       // between cubes that are set down
constexpr double kSoftest_m = 5e-4;    // what contacts may sink in by: WorldSettings

/// Cubes of 1 kg, 2 mm and 10 mrad out of place.
std::vector<BodyId> add_tower(World& world, int cubes, double gap_m, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  add(world, ground());
  std::vector<BodyId> bodies;
  for (int k = 0; k < cubes; ++k) {
    BodySpec spec = brick({0.5, 0.5, 0.5}, {0.002 * unit(random), 0.002 * unit(random), 0});
    spec.p_WBo.z = 0.5 + gap_m + (1 + gap_m) * k;
    const double half = 0.005 * unit(random);
    spec.q_WB = {std::cos(half), 0, 0, std::sin(half)};
    bodies.push_back(add(world, spec));
  }
  return bodies;
}

std::vector<BodyState> states(const World& world, const std::vector<BodyId>& bodies) {
  std::vector<BodyState> all;
  for (const BodyId body : bodies) all.push_back(state(world, body));
  return all;
}

/// m, of the corner of a cube that went farthest, or nearly.
double farthest_turned(const std::vector<BodyState>& from, const std::vector<BodyState>& to) {
  double most = 0;
  for (std::size_t k = 0; k < from.size(); ++k) {
    const Quat &p = from[k].q_WB, &q = to[k].q_WB;
    const double half = std::hypot(p.w - q.w, norm({p.x - q.x, p.y - q.y, p.z - q.z}));
    most = std::max(most, distance(from[k].p_WBo, to[k].p_WBo) + std::sqrt(3) * half);
  }
  return most;
}

/// J, of cubes of 1 kg.
double energy_of_cubes(const std::vector<BodyState>& cubes) {
  double sum = 0;
  for (const BodyState& s : cubes) {
    const double v = norm(s.v_WBcm), w = norm(s.w_WB);
    sum += kGravity * s.p_WBo.z + 0.5 * v * v + 0.5 / 6 * w * w;
  }
  return sum;
}

double fastest_of(const std::vector<BodyState>& bodies) {
  double most = 0;
  for (const BodyState& s : bodies) most = std::max(most, norm(s.v_WBcm) + norm(s.w_WB));
  return most;
}

bool is_soft(const StepReport& report) {
  return report.islands_at_rest + report.islands_by_newton < report.islands;
}

}  // namespace

TEST_CASE("Newton's method takes over from soft steps without a jump, and the tower is still") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    World world(settings_of("hybrid"));
    const auto cubes = add_tower(world, 10, kGap_m, seed);
    int taken_over = 0, last = -1, in_vain = 0;
    for (int tick = 0; tick < 180; ++tick) {
      const std::vector<BodyState> before = states(world, cubes);
      const StepReport report = world.step();
      in_vain += report.islands_makeshift;
      if (report.islands_taken_over == 0) continue;
      const std::vector<BodyState> after = states(world, cubes);
      CHECK(farthest_turned(before, after) < kJump_m);
      CHECK(energy_of_cubes(after) - energy_of_cubes(before) < 10 * kGravity * kJump_m);
      ++taken_over;
      last = tick;
    }
    CHECK(taken_over >= 1);
    CHECK(last < 120);
    CHECK(in_vain == 0);
    const std::vector<BodyState> rest = states(world, cubes);
    CHECK(fastest_of(rest) == 0);
    Worst worst;
    worst.run(world, 120);
    CHECK(farthest_turned(rest, states(world, cubes)) == 0);
    CHECK(worst.penetration_m < kSoftest_m);
  }
}

TEST_CASE("soft steps take over from Newton's method without a jump, and give back what rests") {
  // A milligramme falls on the tower: nothing that it does can be seen, but that it is not at rest.
  for (const double gap_m : {0.0, kGap_m}) {
    for (unsigned seed = 1; seed <= 10; ++seed) {
      CAPTURE(gap_m, seed);
      World world(settings_of("hybrid"));
      const auto cubes = add_tower(world, 10, gap_m, seed);
      steps(world, 240);
      const std::vector<BodyState> rest = states(world, cubes);
      REQUIRE(fastest_of(rest) == 0);
      BodySpec fly = brick({0.1, 0.1, 0.1}, rest.back().p_WBo, {0, 0, -0.5});
      fly.p_WBo.z += 0.65;
      fly.mass_kg = 1e-6;
      add(world, fly);
      int soft = 0;
      for (int tick = 0; tick < 120; ++tick) {
        const std::vector<BodyState> before = states(world, cubes);
        const bool was_soft = is_soft(world.step());
        const std::vector<BodyState> after = states(world, cubes);
        CHECK(farthest_turned(before, after) < kJump_m);
        CHECK(energy_of_cubes(after) - energy_of_cubes(before) < 10 * kGravity * kJump_m);
        soft += was_soft ? 1 : 0;
      }
      CHECK(soft > 5);
      CHECK(!is_soft(world.step()));
      CHECK(farthest_turned(rest, states(world, cubes)) < 2 * kJump_m);
    }
  }
}

TEST_CASE("a stack that is put down touching is exact from the first tick, and costs a look") {
  // As by Newton: dt^2 kHybridYield K F, with K = 8 1/kg at a corner that carries 19 g / 4.
  World world(settings_of("hybrid"));
  const auto cubes = add_stack(world, 20);
  Worst worst;
  worst.run(world, 10);
  CHECK(worst.penetration_m == Approx(kHybridYield * 8 * 19 * kGravity / 4 / 3600).epsilon(1e-3));
  const std::vector<BodyState> rest = states(world, cubes);
  for (int tick = 0; tick < 60; ++tick) {
    const StepReport report = world.step();
    CHECK(report.islands_at_rest == 1);
    CHECK(report.islands_makeshift == 0);
  }
  CHECK(farthest_turned(rest, states(world, cubes)) == 0);

  // A8: a tonne on a cube, and on ten.
  for (const int under : {1, 10}) {
    CAPTURE(under);
    World heavy(settings_of("hybrid"));
    add_stack(heavy, under);
    BodySpec tonne = brick({0.5, 0.5, 0.5}, {0, 0, under + 0.5});
    tonne.mass_kg = 1000;
    const BodyId top = add(heavy, tonne);
    Worst deepest;
    deepest.run(heavy, 120);
    CHECK(deepest.makeshift == 0);
    CHECK(deepest.penetration_m < kHybridYield * 8 * (1000 + under) * kGravity / 4 / 3600 * 1.01);
    CHECK(heavy.step().islands_at_rest == 1);
    CHECK(distance(state(heavy, top).p_WBo, {0, 0, under + 0.5}) < 1e-5);
  }
}

TEST_CASE("what strikes a stack is met by soft steps, which give back what comes to rest") {
  World world(settings_of("hybrid")), again(settings_of("hybrid"));
  for (World* of : {&world, &again}) {
    add_tower(*of, 10, 0, 3);
    steps(*of, 60);
    add(*of, brick({0.5, 0.5, 0.5}, {-3, 0.1, 8}, {10, 0, 0}));
  }
  REQUIRE(!is_soft(world.step()));
  again.step();
  int soft = 0;
  for (int tick = 0; tick < 900; ++tick) {
    soft += is_soft(world.step()) ? 1 : 0;
    again.step();
  }
  CHECK(soft > 30);
  const StepReport last = world.step();
  again.step();
  CHECK(!is_soft(last));
  CHECK(last.penetration_max_m < kSoftest_m);
  CHECK(world.hash() == again.hash());  // the same bits, twice
}

TEST_CASE("what begins to slide or fall, and an overlap that is pushed out, are for soft steps") {
  // To the bit: a block of 1 kg that is pushed by 8 N, and one that is let go 1 cm above the
  // ground; and one that begins 10 cm deep comes up.
  World hybrid(settings_of("hybrid")), soft(settings_of("soft"));
  std::vector<BodyId> pushed, fallen, deep;
  for (World* world : {&hybrid, &soft}) {
    add(*world, ground());
    pushed.push_back(add(*world, brick({0.5, 0.5, 0.1}, {0, 0, 0.1})));
    fallen.push_back(add(*world, brick({0.5, 0.5, 0.5}, {0, -5, 0.51})));
    deep.push_back(add(*world, brick({0.5, 0.5, 0.5}, {0, 5, 0.4})));
    Wrench push;
    push.body = pushed.back();
    push.duration = WrenchDuration::until_cleared;
    push.value = {8, 0, 0};
    REQUIRE(world->push(std::array{push}).result == Result::ok);
  }
  for (int tick = 0; tick < 60; ++tick) {
    hybrid.step();
    soft.step();
    CHECK(distance(state(hybrid, pushed[0]).p_WBo, state(soft, pushed[1]).p_WBo) == 0);
    if (tick > 2) continue;
    CHECK(distance(state(hybrid, fallen[0]).p_WBo, state(soft, fallen[1]).p_WBo) == 0);
  }
  CHECK(state(soft, pushed[1]).p_WBo.x > 1);
  steps(hybrid, 180);
  CHECK(state(hybrid, deep[0]).p_WBo.z > 0.5 - kSoftest_m);
}

TEST_CASE("what slides or rolls on slowly is not stopped by the hybrid") {
  for (const double v : {0.003, 0.03}) {
    CAPTURE(v);
    World ice(settings_of("hybrid"));
    add(ice, ground(0));
    BodySpec box = brick({0.5, 0.5, 0.5}, {0, 0, 0.5}, {v, 0, 0});
    box.material.friction = 0;
    const BodyId slides = add(ice, box);
    World plane(settings_of("hybrid"));
    add(plane, ground());
    BodySpec wheel = ball(0.5, {0, 0, 0.5}, {v, 0, 0});
    wheel.w_WB = {0, v / 0.5, 0};
    const BodyId rolls = add(plane, wheel);
    World space(settings_of("hybrid", {}));
    add(space, brick({0.5, 0.5, 0.5}, {0, 0, 0}));
    const BodyId passes = add(space, brick({0.5, 0.5, 0.5}, {1.005, 0, 0}, {0, v, 0}));
    steps(ice, 300);
    steps(plane, 300);
    steps(space, 300);
    CHECK(state(ice, slides).v_WBcm.x == Approx(v).epsilon(1e-9));
    CHECK(state(plane, rolls).v_WBcm.x == Approx(v).epsilon(1e-9));
    CHECK(state(space, passes).v_WBcm.y == Approx(v).epsilon(1e-9));
  }
}

TEST_CASE("loads that grow on what rests do not make it sink in anew") {
  // A stack that grows by a cube a second, half a millimetre above the last.
  World world(settings_of("hybrid"));
  add(world, ground());
  std::vector<BodyId> cubes;
  double top = 0;
  Worst worst;
  for (int k = 0; k < 15; ++k) {
    cubes.push_back(add(world, brick({0.5, 0.5, 0.5}, {0, 0, top + 0.5005})));
    worst.run(world, 60);
    top = state(world, cubes.back()).p_WBo.z + 0.5;
  }
  CHECK(worst.penetration_m < 0.2 * kSoftest_m);
  CHECK(top > 15 - kSoftest_m);
  // And as it is taken away again, nothing comes up.
  const double lowest = state(world, cubes.front()).p_WBo.z;
  for (std::size_t k = cubes.size() - 1; k > 0; --k) {
    world.despawn(std::array{cubes[k]});
    steps(world, 30);
  }
  CHECK(state(world, cubes.front()).p_WBo.z == Approx(lowest).margin(kJump_m));
}

namespace {

constexpr int kRows = 30;

/// A pyramid of 465 cubes, at rest: of 900 contacts, 30 with the ground and two below each other.
struct LargeWall {
  World world;

  explicit LargeWall(const Vec3& gravity_W = {0, 0, -kGravity})
      : world(settings_of("hybrid", gravity_W)) {
    add(world, ground());
    for (int row = 0; row < kRows; ++row) {
      for (int k = 0; k < kRows - row; ++k) {
        add(world, brick({0.5, 0.5, 0.5}, {1.05 * (k - 0.5 * (kRows - row - 1)), 0, 0.5 + row}));
      }
    }
    steps(world, 60);
    REQUIRE(world.step().islands_at_rest == 1);
  }
};

/// On its top, about the y axis.
BodySpec roller(double radius_m) {
  BodySpec spec = ball(radius_m, {0, 0, kRows + radius_m});
  spec.shape = Shape::cylinder(radius_m, 0.5);
  spec.q_WB = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};
  return spec;
}

}  // namespace

TEST_CASE("what sways a little on a large wall is stopped half way while it is held") {
  // An ellipsoid that rocks: omega^2 = m g (a^2 / c - c) / (I + m c^2), I = m (a^2 + c^2) / 5; from
  // the turn to the bottom is a quarter of a period, 11 ticks; that it is past is seen within
  // three. What is left then is below what may be out of balance at rest (settling.cpp).
  World world = LargeWall().world;
  constexpr double a = 0.25, c = 0.15, angle = 2e-4;
  BodySpec rocker = ball(c, {0, 0, kRows + std::hypot(a * std::sin(angle), c * std::cos(angle))});
  rocker.shape = Shape::ellipsoid({a, a, c});
  rocker.q_WB = {std::cos(angle / 2), 0, std::sin(angle / 2), 0};
  const BodyId body = add(world, rocker);
  const double omega2 = kGravity * (a * a / c - c) / ((a * a + c * c) / 5 + c * c);
  const int quarter = static_cast<int>(60 * std::acos(0) / std::sqrt(omega2));
  for (int tick = 1; tick < quarter; ++tick) {
    REQUIRE(world.step().islands_by_newton == 1);
    REQUIRE(fastest_of({state(world, body)}) > 0);
  }
  steps(world, 5);
  CHECK(fastest_of({state(world, body)}) == 0);
  CHECK(std::abs(2 * state(world, body).q_WB.y) < std::sin(3 * std::sqrt(omega2) / 60) * angle);
  CHECK(world.step().islands_at_rest == 1);
}

TEST_CASE("what rolls on a large wall is not solved with it for as long as it rolls") {
  // Down a slope of 10 microrad: x = a t^2 / 2, a = 2/3 g slope.
  constexpr double kSlope = 1e-5, kRadius = 0.2;
  World world = LargeWall({kSlope * kGravity, 0, -kGravity}).world;
  const BodyId rolls = add(world, roller(kRadius));
  int by_newton = 0;
  for (int tick = 0; tick < 180; ++tick) by_newton += world.step().islands_by_newton;
  CHECK(by_newton == 15);
  CHECK(state(world, rolls).p_WBo.x == Approx(kGravity * kSlope / 3 * 9).epsilon(0.05));
}

TEST_CASE("what was set going rolls on on a large wall") {
  World world = LargeWall().world;
  constexpr double kRadius = 0.2, kSpeed = 2e-3;
  const BodyId rolls = add(world, roller(kRadius));
  steps(world, 5);
  SECTION("by a push: v = 2/3 F t / m, by the friction of what does not slide") {
    Wrench push;
    push.body = rolls;
    push.value = {1.5 * kSpeed * 60 / 8, 0, 0};
    push.duration = WrenchDuration::ticks;
    push.ticks = 8;
    REQUIRE(world.push(std::array{push}).result == Result::ok);
  }
  SECTION("at once") {
    Motion starts;
    starts.body = rolls;
    starts.sets_velocity = true;
    starts.v_WBcm = {kSpeed, 0, 0};
    starts.w_WB = {0, kSpeed / kRadius, 0};
    REQUIRE(world.set_motion(std::array{starts}).result == Result::ok);
  }
  steps(world, 120);
  CHECK(state(world, rolls).v_WBcm.x == Approx(kSpeed).epsilon(0.01));
}

TEST_CASE("a tower on a conveyor goes along with it by the hybrid") {
  World world(settings_of("hybrid"));
  BodySpec belt = brick({5, 5, 0.5}, {0, 0, -0.5});
  belt.kind = BodyKind::kinematic;
  const BodyId moves = add(world, belt);
  std::vector<BodyId> cubes;
  for (int k = 0; k < 5; ++k) {
    cubes.push_back(add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5 + k})));
  }
  steps(world, 60);
  Motion starts;
  starts.body = moves;
  starts.sets_velocity = true;
  starts.v_WBcm = {0.05, 0, 0};
  REQUIRE(world.set_motion(std::array{starts}).result == Result::ok);
  steps(world, 300);
  CHECK(state(world, cubes.back()).p_WBo.x ==
        Approx(state(world, moves).p_WBo.x).margin(kSoftest_m));
  CHECK(state(world, cubes.back()).v_WBcm.x == Approx(0.05).epsilon(1e-3));
}

TEST_CASE("what Newton's method does not know is left to soft steps by the hybrid") {
  World hybrid(settings_of("hybrid")), soft(settings_of("soft"));
  std::vector<BodyId> bodies;
  for (World* world : {&hybrid, &soft}) {
    add(*world, ground());
    BodySpec wheel = ball(0.5, {0, 0, 0.5}, {0.005, 0, 0});
    wheel.w_WB = {0, 0.01, 0};
    wheel.material.rolling_friction_m = 0.005;
    bodies.push_back(add(*world, wheel));
    steps(*world, 300);
  }
  CHECK(distance(state(hybrid, bodies[0]).p_WBo, state(soft, bodies[1]).p_WBo) == 0);
}

TEST_CASE("by the hybrid, too, what is still falls asleep, and wakes as it was") {
  WorldSettings how = settings_of("hybrid");
  how.is_sleeping = true;
  World world(how);
  const auto cubes = add_tower(world, 5, kGap_m, 1);
  StepReport report;
  for (int tick = 0; tick < 180; ++tick) report = world.step();
  REQUIRE(report.sleeping == 5);
  const std::vector<BodyState> before = states(world, cubes);
  Wrench touch;
  touch.body = cubes.front();
  touch.value = {0, 0, 1e-9};
  REQUIRE(world.push(std::array{touch}).result == Result::ok);
  report = world.step();
  CHECK(report.sleeping == 0);
  CHECK(!is_soft(report));
  steps(world, 5);
  CHECK(farthest_turned(before, states(world, cubes)) < 1e-9);
}

}  // namespace cradle
