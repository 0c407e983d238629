// Islands at rest fall asleep, wake by whatever happens to them, and cost nothing in between.
#include "server/world/sleeping.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <thread>

#include "tests/physics/worlds.h"

namespace cradle {
namespace {

WorldSettings sleepy(double rate_hz = 60) {
  WorldSettings s = settings(rate_hz);
  s.is_sleeping = true;
  return s;
}

/// A stack of ten boxes on the ground.
struct Pile {
  explicit Pile(WorldSettings s = sleepy()) : world(s) {
    floor = add(world, ground());
    for (int k = 0; k < 10; ++k) {
      boxes.push_back(add(world, brick({0.5, 0.5, 0.5}, {0.01 * (k % 2), 0, 0.5 + k})));
    }
  }
  std::vector<BodyState> states() {
    std::vector<BodyState> all;
    world.snapshot(all);
    return all;
  }
  bool is_asleep() {
    return std::ranges::all_of(boxes, [this](BodyId b) { return state(world, b).asleep; });
  }
  bool is_awake() {
    return std::ranges::none_of(boxes, [this](BodyId b) { return state(world, b).asleep; });
  }
  World world;
  BodyId floor;
  std::vector<BodyId> boxes;
};

constexpr int kSoon = 180;  // ticks in which a stack of ten settles, and half a second more

Pile sleeping_pile() {
  Pile pile;
  steps(pile.world, kSoon);
  REQUIRE(pile.is_asleep());
  return pile;
}

std::int64_t count(const std::vector<Event>& events, EventKind kind) {
  return std::ranges::count_if(events, [kind](const Event& e) { return e.kind == kind; });
}

/// Each range by a thread of its own.
class Threads final : public Executor {
 public:
  explicit Threads(int count) : count_(count) {}
  void for_ranges(int count, int least, RangeTask task) override {
    if (count < 2 * least) return count > 0 ? task(0, count) : void();
    std::vector<std::jthread> threads;
    for (int k = 0; k < count_; ++k) {
      threads.emplace_back(task, count * k / count_, count * (k + 1) / count_);
    }
  }

  int threads() const override { return count_; }

 private:
  int count_;
};

Quat about_y(double angle) { return {std::cos(angle / 2), 0, std::sin(angle / 2), 0}; }

/// True if the body never sleeps in so many ticks.
bool stays_awake(World& world, BodyId body, int ticks) {
  for (int k = 0; k < ticks; ++k) {
    world.step();
    if (state(world, body).asleep) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("a stack of ten boxes falls asleep within three seconds, is told, and stays to the bit") {
  Pile pile = sleeping_pile();
  const std::vector<Event> events = pile.world.take_events();
  CHECK(count(events, EventKind::slept) == 10);
  CHECK(count(events, EventKind::woke) == 0);
  CHECK(events.back().tick > 30);
  CHECK(events.back().tick <= kSoon);
  CHECK(pile.world.awake_count() == 0);
  const std::vector<BodyState> before = pile.states();
  for (const BodyState& s : before) {
    CHECK(norm(s.v_WBcm) + norm(s.w_WB) == 0);
    CHECK(s.in_contact);
  }
  for (int k = 0; k < 600; ++k) {
    const StepReport report = pile.world.step();
    REQUIRE(report.sleeping == 10);
    REQUIRE(report.pairs == 0);
    REQUIRE(report.bodies_in_contact == 0);
  }
  CHECK(pile.states() == before);
  CHECK(pile.world.take_events().empty());
}

TEST_CASE("a stack wakes as a whole by whatever happens to it") {
  Pile pile = sleeping_pile();
  World& world = pile.world;
  pile.world.take_events();
  const auto wakes = [&](const char* cause, const std::function<void()>& change) {
    INFO(cause);
    change();
    world.step();
    const std::vector<Event> events = world.take_events();
    CHECK(count(events, EventKind::woke) == 10);
    CHECK(std::ranges::all_of(events, [&](const Event& e) { return e.tick == world.tick(); }));
    CHECK(pile.is_awake());
  };
  Motion motion;
  SECTION("a wrench") {
    wakes("push", [&] {
      Wrench wrench;
      wrench.body = pile.boxes[4];
      wrench.value = {0.1, 0, 0};
      world.push(std::array{wrench});
    });
  }
  SECTION("a motion") {
    wakes("velocity", [&] {
      motion.body = pile.boxes[9];
      motion.sets_velocity = true;
      motion.v_WBcm = {0, 0, 1};
      world.set_motion(std::array{motion});
    });
  }
  SECTION("gravity") {
    wakes("gravity", [&] { world.set_gravity({0, 0.1, -9.81}); });
  }
  SECTION("the floor is removed") {
    wakes("despawn", [&] { world.despawn(std::array{pile.floor}); });
    CHECK(state(world, pile.boxes[0]).v_WBcm.z < -0.1);
  }
  SECTION("the floor is moved away") {
    wakes("set_motion", [&] {
      motion.body = pile.floor;
      motion.sets_pose = true;
      motion.p_WBo = {0, 0, -3};
      world.set_motion(std::array{motion});
    });
    CHECK(state(world, pile.boxes[0]).v_WBcm.z < -0.1);
  }
  SECTION("a wall is moved into it") {
    BodySpec wall = brick({0.5, 0.5, 5}, {-5, 0, 5});
    wall.kind = BodyKind::fixed;
    const BodyId id = add(world, wall);
    steps(world, 2);
    REQUIRE(pile.is_asleep());
    world.take_events();
    wakes("set_motion", [&] {
      motion.body = id;
      motion.sets_pose = true;
      motion.p_WBo = {-0.95, 0, 5};
      world.set_motion(std::array{motion});
    });
  }
  SECTION("a wall is made in it") {
    BodySpec wall = brick({0.5, 0.5, 5}, {-0.95, 0, 5});
    wall.kind = BodyKind::fixed;
    add(world, wall);
    world.take_events();
    wakes("spawn", [] {});
  }
  SECTION("drag") {
    wakes("drag", [&] { world.set_drag(pile.boxes[3], {0.1, 0, 0}); });
  }
  SECTION("a spring") {
    wakes("spring", [&] {
      Spring spring;
      spring.a = pile.boxes[3];
      spring.point_b = {3, 0, 3};
      spring.stiffness = 1;
      world.add_springs(std::array{spring});
    });
  }
  SECTION("a body that comes slowly") {
    const BodyId other = add(world, ball(0.2, {-0.75, 0, 0.199}, {0.3, 0, 0}));
    int ticks = 0;
    while (pile.is_asleep() && ticks < 60) {
      world.step();
      ++ticks;
    }
    CHECK(pile.is_awake());
    CHECK(ticks > 5);  // not before they touch
    CHECK(std::abs(state(world, other).p_WBo.x + 0.7) < 0.01);
  }
  SECTION("a kinematic body that drives into it") {
    BodySpec ram = brick({0.2, 0.2, 0.2}, {-0.8, 0, 5.3}, {0.3, 0, 0});
    ram.kind = BodyKind::kinematic;
    const BodyId id = add(world, ram);
    int ticks = 0;
    while (pile.is_asleep() && ticks < 60) {
      world.step();
      ++ticks;
    }
    CHECK(pile.is_awake());
    CHECK(ticks > 10);
    CHECK(std::abs(state(world, id).p_WBo.x + 0.7) < 0.02);
  }
  SECTION("a ball that flies, slow or too fast to be seen beside it") {
    const double speed = GENERATE(3.0, 400.0);
    CAPTURE(speed);
    Pile twin(settings());
    steps(twin.world, kSoon);
    const BodySpec thrown = ball(0.1, {-0.61 - 0.02 * speed, 0, 5.3}, {speed, 0, 0});
    const BodyId other = add(world, thrown), twin_other = add(twin.world, thrown);
    world.take_events();
    steps(world, 2);
    steps(twin.world, 2);
    CHECK(pile.is_awake());
    // As if it had never slept: to 1 % of the ball's way.
    const double near_m = 1e-3 + 0.01 * speed / 60;
    const BodyState hit = state(world, pile.boxes[5]), here = state(world, other);
    CHECK(hit.v_WBcm.x > 0.1 * speed);
    CHECK(distance(hit.p_WBo, state(twin.world, twin.boxes[5]).p_WBo) < near_m);
    CHECK(distance(here.p_WBo, state(twin.world, twin_other).p_WBo) < near_m);
  }
}

TEST_CASE("what passes close by, or comes to rest beside it, does not wake a stack") {
  Pile pile = sleeping_pile();
  World& world = pile.world;
  const BodyId passing = add(world, ball(0.1, {-0.61, -3, 5}, {0, 30, 0}));
  const BodyId resting = add(world, brick({0.5, 0.5, 0.5}, {-1.01, 0, 0.5}));
  for (int k = 0; k < kSoon; ++k) {
    world.step();
    REQUIRE(pile.is_asleep());
  }
  CHECK(state(world, passing).p_WBo.y > 20);
  CHECK(state(world, resting).asleep);
}

TEST_CASE("a stack that wakes moves by less than 1e-6 m, and its energy does not rise") {
  // An uneven stack sways a little when it falls asleep, and goes on with that from rest: then it
  // is the first tick that tells.
  const double offset_m = GENERATE(0.0, 0.01);
  const double heaviest_kg = GENERATE(1.0, 5.0);
  CAPTURE(offset_m, heaviest_kg);
  World world(sleepy());
  add(world, ground());
  std::vector<BodyId> boxes;
  for (int k = 0; k < 10; ++k) {
    BodySpec spec = brick({0.5, 0.5, 0.5}, {offset_m * (k % 2), 0, 0.5 + k});
    if (k == 9) spec.mass_kg = heaviest_kg;
    boxes.push_back(add(world, spec));
  }
  steps(world, 2 * kSoon);
  REQUIRE(world.awake_count() == 0);
  std::vector<BodyState> before, after;
  world.snapshot(before);
  const auto energy = [&] {
    return world.totals().kinetic_energy_J + world.totals().potential_energy_J;
  };
  const double energy_before = energy();
  Wrench nothing;
  nothing.body = boxes[0];
  world.push(std::array{nothing});
  const double sway_m = kSleep.acceleration * kGravity * kSleep.window_s * kSleep.window_s;
  double first = 0, most = 0, gained = 0;
  for (int k = 0; k < 2 * kSoon; ++k) {
    world.step();
    if (k == 0) CHECK(world.awake_count() == 10);
    world.snapshot(after);
    for (std::size_t i = 0; i < after.size(); ++i) {
      most = std::max(most, distance(before[i].p_WBo, after[i].p_WBo));
    }
    if (k == 0) first = most;
    gained = std::max(gained, energy() - energy_before);
  }
  CAPTURE(first, most, gained);
  CHECK(first < 1e-6);
  CHECK(most < (offset_m == 0 ? 1e-6 : sway_m));
  CHECK(gained < 1e-7 * energy_before);
  CHECK(world.awake_count() == 0);  // it sleeps again
}

TEST_CASE("what begins slowly or turns back stays awake") {
  World world(sleepy());
  SECTION("a box just above the friction angle") {
    const double friction = 0.5, angle = std::atan(friction) + 1e-3;
    BodySpec slope = ground(friction);
    slope.q_WB = about_y(angle);
    add(world, slope);
    BodySpec box = brick({0.2, 0.2, 0.2}, {0.2 * std::sin(angle), 0, 0.2 * std::cos(angle)});
    box.q_WB = slope.q_WB;
    box.material.friction = friction;
    const BodyId id = add(world, box);
    CHECK(stays_awake(world, id, 300));
  }
  SECTION("a domino that hardly tips") {
    add(world, ground());
    const double angle = std::atan(0.1 / 1.0) + 1e-3;  // beyond its edge by a milliradian
    BodySpec domino = brick({0.1, 0.5, 1}, {});
    domino.p_WBo = {0.1 - 0.1 * std::cos(angle) + std::sin(angle), 0,
                    0.1 * std::sin(angle) + std::cos(angle)};
    domino.q_WB = about_y(angle);
    const BodyId id = add(world, domino);
    CHECK(stays_awake(world, id, 90));
    steps(world, 120);
    CHECK(state(world, id).p_WBo.z < 0.2);  // it fell
  }
  SECTION("the apex of a throw, alone and as a pair that touches") {
    world.set_gravity({0, 0, -0.05});
    const BodyId one = add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0}, {0, 0, 0.1}));
    add(world, brick({0.5, 0.5, 0.5}, {0, 0, 1}, {0, 0, 0.1}));
    CHECK(stays_awake(world, one, 240));
  }
  SECTION("a cylinder that rolls to and fro in a trough") {
    for (const double side : {-1.0, 1.0}) {
      BodySpec slope = ground();
      slope.q_WB = about_y(side * 0.02);
      add(world, slope);
    }
    const BodyId id = add(world, ball(0.2, {0.1, 0, 0.2 + 0.002}));
    CHECK(stays_awake(world, id, 600));
  }
  SECTION("a tumbler that rocks by less than a tenth of a millimetre, but fast") {
    // Its period is 0.27 s: omega^2 = g e / (0.4 r^2 + (r - e)^2), with e how far Bcm is below Bo.
    World fast(sleepy(2000));
    add(fast, ground());
    BodySpec tumbler = ball(0.02, {0, 0, 0.02});
    tumbler.sets_centre_of_mass = true;
    tumbler.p_BoBcm = {0, 0, -0.012};
    tumbler.q_WB = about_y(1e-3);
    const BodyId id = add(fast, tumbler);
    CHECK(stays_awake(fast, id, 2400));
  }
  SECTION("a box that drag holds back on its way down") {
    const double angle = 0.6;
    BodySpec slope = ground(0);
    slope.q_WB = about_y(angle);
    add(world, slope);
    BodySpec box = brick({0.2, 0.2, 0.2}, {0.2 * std::sin(angle), 0, 0.2 * std::cos(angle)});
    box.q_WB = slope.q_WB;
    const BodyId id = add(world, box);
    world.set_drag(id, {1e5, 0, 0});
    CHECK(stays_awake(world, id, 120));
  }
  SECTION("a box on a kinematic floor that moves") {
    BodySpec belt = brick({5, 5, 0.1}, {0, 0, -0.1}, {1e-5, 0, 0});
    belt.kind = BodyKind::kinematic;
    add(world, belt);
    const BodyId id = add(world, brick({0.2, 0.2, 0.2}, {0, 0, 0.2}));
    CHECK(stays_awake(world, id, 120));
  }
  SECTION("a box with a force, and one on a spring") {
    add(world, ground());
    const BodyId pushed = add(world, brick({0.2, 0.2, 0.2}, {0, 0, 0.2}));
    const BodyId sprung = add(world, brick({0.2, 0.2, 0.2}, {5, 0, 0.2}));
    Wrench wrench;
    wrench.body = pushed;
    wrench.value = {0.1, 0, 0};
    wrench.duration = WrenchDuration::until_cleared;
    world.push(std::array{wrench});
    Spring spring;
    spring.a = sprung;
    spring.point_b = {5, 0, 3};
    spring.stiffness = 1;
    world.add_springs(std::array{spring});
    CHECK(stays_awake(world, pushed, 120));
    CHECK_FALSE(state(world, sprung).asleep);
    world.clear_wrenches(std::array{pushed});
    CHECK_FALSE(stays_awake(world, pushed, 120));
  }
}

TEST_CASE("at ten ticks a second a box sleeps, too, and at 1000") {
  const double rate_hz = GENERATE(10.0, 240.0, 1000.0);
  CAPTURE(rate_hz);
  World world(sleepy(rate_hz));
  add(world, ground());
  const BodyId box = add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5}));
  CHECK_FALSE(stays_awake(world, box, static_cast<int>(3 * rate_hz)));
}

TEST_CASE("a heap of sleeping islands costs nothing, and what lands wakes its own alone") {
  World world(sleepy());
  add(world, ground());
  std::vector<BodyId> lower;
  for (int k = 0; k < 400; ++k) {
    const double x = 1.5 * (k % 20), y = 1.5 * (k / 20);
    lower.push_back(add(world, brick({0.5, 0.5, 0.5}, {x, y, 0.5})));
    add(world, brick({0.5, 0.5, 0.5}, {x, y, 1.5}));
  }
  StepReport report;
  for (int k = 0; k < kSoon; ++k) report = world.step();
  CHECK(report.sleeping == 800);
  CHECK(report.pairs == 0);
  add(world, ball(0.3, {15, 15, 2.6}));
  world.take_events();
  std::int64_t pairs_max = 0, sleeping_min = 800;
  for (int k = 0; k < 60; ++k) {
    report = world.step();
    pairs_max = std::max(pairs_max, report.pairs);
    sleeping_min = std::min(sleeping_min, report.sleeping);
  }
  CHECK(sleeping_min == 798);
  CHECK(pairs_max >= 3);
  CHECK(pairs_max <= 4);
  CHECK(count(world.take_events(), EventKind::woke) == 2);
}

TEST_CASE("worlds with sleepers are the same with any lanes and threads") {
  const auto run = [](int lanes, int threads) {
    WorldSettings s = sleepy();
    s.lanes = lanes;
    World world(s);
    add(world, ground());
    for (int k = 0; k < 60; ++k) {
      add(world, brick({0.3, 0.3, 0.3}, {0.7 * (k % 5), 0.7 * (k / 5 % 4), 0.3 + 0.61 * (k / 20)}));
    }
    Threads pool(threads);
    for (int k = 0; k < 150; ++k) world.step(pool);
    CHECK(world.awake_count() < 60);
    add(world, ball(0.3, {-1, 0.2, 0.9}, {6, 1, 0}));
    for (int k = 0; k < 120; ++k) world.step(pool);
    return world.hash();
  };
  const auto first = run(1, 1);
  CHECK(run(0, 1) == first);
  CHECK(run(1, 3) == first);
}

TEST_CASE("where sleeping is off nobody sleeps") {
  Pile pile(settings());
  steps(pile.world, 2 * kSoon);
  CHECK(pile.is_awake());
  CHECK(pile.world.take_events().size() == 11);  // they came, and that was all
}

}  // namespace cradle
