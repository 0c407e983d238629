// The world as a whole: ids, atomic commands, quarantine, hash.
#include <cradle/limits.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstring>
#include <limits>

#include "tests/physics/worlds.h"

namespace cradle {
namespace {

/// A world with something of everything: contact, flight, wrenches, a removed body.
World busy_world() {
  WorldSettings chosen = settings();
  chosen.is_sleeping = true;
  World world(chosen);
  const Vector corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  world.add_geometry(make_hull(corners).geometry);
  add(world, ground());
  for (int i = 0; i < 4; ++i) add(world, brick({0.5, 0.5, 0.5}, {0.1 * i, 0, 0.5 + i}));
  const BodyId lid = add(world, brick({0.5, 0.5, 0.5}, {0.4, 0, 4.5}));
  const BodyId gone = add(world, ball(0.5, {5, 0, 9}));
  BodySpec named = ball(0.5, {-5, 0, 9}, {1, 0, 0});
  named.name = "named";
  Wrench wrench;
  wrench.body = add(world, named);
  wrench.value = {0.1, 0, 0};
  wrench.duration = WrenchDuration::ticks;
  wrench.ticks = 1000;
  world.push(std::array{wrench});
  world.set_drag(wrench.body, {0.1, 0.2, 0.3});
  Spring spring;
  spring.a = wrench.body;
  spring.b = gone;
  world.add_springs(std::array{spring});
  spring.b = {};
  spring.point_b = {-5, 0, 12};
  spring.stiffness = 3;
  world.add_springs(std::array{spring});
  const BodyId sleeper = add(world, brick({0.5, 0.5, 0.5}, {30, 0, 0.5}));
  const BodyId beside = add(world, brick({0.5, 0.5, 0.5}, {-9, 0, 0.5}));  // leaves a free place
  steps(world, 20);
  world.despawn(std::array{lid, gone, beside});
  steps(world, 30);
  add(world, brick({0.5, 0.5, 0.5}, {20, 0, 0.5}));  // in contact, and still awake
  steps(world, 1);
  REQUIRE(state(world, sleeper).asleep);
  return world;
}

}  // namespace

TEST_CASE("the same commands give the same hash on every run") {
  World a = busy_world();
  World b = busy_world();
  CHECK(a.hash() == b.hash());
  a.step();
  CHECK(a.hash() != b.hash());
  b.step();
  CHECK(a.hash() == b.hash());
}

TEST_CASE("flipping one bit of any part of the state changes the hash") {
  World world = busy_world();
  const auto before = world.hash();
  std::vector<std::string> names;
  for (World::StatePart& part : world.state_parts()) {
    names.push_back(part.name);
    CAPTURE(part.name);
    REQUIRE(!part.bytes.empty());
    for (const std::size_t at : {std::size_t{0}, part.bytes.size() / 2, part.bytes.size() - 1}) {
      part.bytes[at] ^= std::byte{4};
      CHECK(world.hash() != before);
      part.bytes[at] ^= std::byte{4};
    }
  }
  CHECK(world.hash() == before);
  for (const char* needed : {"wrenches", "springs", "drag", "scheme", "contact forces", "next_id",
                             "tick", "gravity", "x", "q", "v", "w", "quarantined", "id", "dt"}) {
    CAPTURE(needed);
    CHECK(std::count(names.begin(), names.end(), needed) == 1);
  }
}

TEST_CASE("a world that continues from equal bytes of its parts stays equal") {
  // If the parts are all that influences the next tick, copying them must make two worlds one.
  World a = busy_world();
  World b = busy_world();
  steps(b, 1);  // something else in its caches
  World c = busy_world();
  auto from = a.state_parts();
  auto to = c.state_parts();
  for (std::size_t i = 0; i < from.size(); ++i) {
    REQUIRE(from[i].bytes.size() == to[i].bytes.size());
    std::copy(from[i].bytes.begin(), from[i].bytes.end(), to[i].bytes.begin());
  }
  for (int i = 0; i < 50; ++i) {
    a.step();
    c.step();
    REQUIRE(a.hash() == c.hash());
  }
}

TEST_CASE("ids grow with creation and are never used again") {
  World world(settings());
  const BodyId first = add(world, ball(0.5, {}));
  world.despawn(std::array{first});
  const BodyId second = add(world, ball(0.5, {}));
  CHECK(second > first);
  BodyState s;
  CHECK_FALSE(world.find(first, s));
  CHECK(world.despawn(std::array{first}).result == Result::unknown_body);
}

TEST_CASE("a batch happens as a whole or not at all") {
  World world(settings());
  const auto before = world.hash();
  BodySpec bad = ball(-1, {});
  const Outcome spawned = world.spawn(std::array{ball(0.5, {}), ball(0.5, {3, 0, 0}), bad});
  CHECK(spawned.result == Result::bad_shape);
  CHECK(spawned.item == 2);
  CHECK(world.hash() == before);

  const BodyId a = add(world, ball(0.5, {}));
  const auto with_a = world.hash();
  const Outcome removed = world.despawn(std::array{a, BodyId{99}});
  CHECK(removed.result == Result::unknown_body);
  CHECK(removed.item == 1);
  CHECK(world.hash() == with_a);

  BodySpec named = ball(0.5, {9, 0, 0});
  named.name = "twin";
  CHECK(world.spawn(std::array{named, named}).result == Result::duplicate_name);
  CHECK(world.spawn(std::array{named}).result == Result::ok);
  CHECK(world.spawn(std::array{named}).result == Result::duplicate_name);
}

TEST_CASE("the bodies of a batch have consecutive ids") {
  World world(settings());
  add(world, ball(0.5, {}));
  const Outcome outcome = world.spawn(std::vector<BodySpec>(5, ball(0.5, {3, 0, 0})));
  std::vector<BodyState> states;
  world.snapshot(states);
  REQUIRE(states.size() == 6);
  for (std::int64_t i = 0; i < 5; ++i) {
    CHECK(states[static_cast<std::size_t>(i) + 1].body.value == outcome.body.value + i);
  }
}

TEST_CASE("a runaway body is quarantined and the world lives on") {
  World world(settings());
  add(world, ground());
  const BodyId steady = add(world, ball(0.5, {0, 0, 0.5}));
  const BodyId runaway = add(world, ball(0.5, {0.9, 0, 0.6}));
  steps(world, 10);
  const Vec3 last = state(world, runaway).p_WBo;
  world.take_events();
  Wrench push;
  push.body = runaway;
  push.value = {-1e17, 0, 0};  // towards its neighbour
  world.push(std::array{push});
  world.step();
  const BodyState s = state(world, runaway);
  CHECK(s.quarantined);
  CHECK(s.p_WBo == last);
  CHECK(norm(s.v_WBcm) == 0);
  const std::vector<Event> events = world.take_events();
  REQUIRE(events.size() == 1);
  CHECK(events[0].kind == EventKind::quarantined);
  CHECK(events[0].body == runaway);
  CHECK(events[0].reason == Result::out_of_range);
  steps(world, 60);
  CHECK(distance(state(world, steady).p_WBo, {0, 0, 0.5}) < 0.1);
  CHECK(world.quarantined_count() == 1);

  // A pose and velocities bring it back.
  Motion motion;
  motion.body = runaway;
  motion.sets_pose = motion.sets_velocity = true;
  motion.p_WBo = {5, 0, 5};
  REQUIRE(world.set_motion(std::array{motion}).result == Result::ok);
  world.step();
  CHECK_FALSE(state(world, runaway).quarantined);
  CHECK(state(world, runaway).v_WBcm.z < 0);
}

TEST_CASE("a number that is not one is quarantined wherever it comes from") {
  World world(settings());
  const BodyId body = add(world, ball(0.5, {}));
  const BodyId other = add(world, ball(0.5, {9, 0, 0}));
  for (World::StatePart& part : world.state_parts()) {
    if (part.name != "w") continue;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    std::memcpy(part.bytes.data(), &nan, sizeof nan);
  }
  world.step();
  CHECK(state(world, body).quarantined);
  CHECK_FALSE(state(world, other).quarantined);
  const auto events = world.take_events();
  CHECK(std::count_if(events.begin(), events.end(), [](const Event& e) {
          return e.kind == EventKind::quarantined && e.reason == Result::not_finite;
        }) == 1);
}

TEST_CASE("mass and inertia follow from density, or override it") {
  // P04: a 2 x 4 x 6 m box at 1234 kg/m^3 is 59 232 kg, J = m/12 (52, 40, 20).
  const auto energy_of_spin = [](BodySpec spec, const Vec3& w) {
    World world(weightless());
    spec.w_WB = w;
    add(world, spec);
    return 2 * world.totals().kinetic_energy_J;  // J about the axis of a unit spin
  };
  BodySpec box = brick({1, 2, 3}, {});
  box.mass_kg = 0;
  box.density_kgpm3 = 1234;
  CHECK(energy_of_spin(box, {1, 0, 0}) == Approx(59232.0 / 12 * 52).epsilon(1e-12));
  CHECK(energy_of_spin(box, {0, 1, 0}) == Approx(59232.0 / 12 * 40).epsilon(1e-12));
  CHECK(energy_of_spin(box, {0, 0, 1}) == Approx(59232.0 / 12 * 20).epsilon(1e-12));
  box.mass_kg = 2;
  CHECK(energy_of_spin(box, {1, 0, 0}) == Approx(2.0 / 12 * 52).epsilon(1e-12));
  box.inertia_kgm2 = {3, 2, 1};
  CHECK(energy_of_spin(box, {1, 0, 0}) == Approx(3).epsilon(1e-12));
  BodySpec sphere = ball(2, {});
  CHECK(energy_of_spin(sphere, {0, 1, 0}) == Approx(0.4 * 4).epsilon(1e-12));
}

TEST_CASE("a body of impossible mass is refused") {
  World world(settings());
  const auto result = [&](auto&& change) {
    BodySpec spec = brick({0.5, 0.5, 0.5}, {});
    change(spec);
    return world.spawn(std::array{spec}).result;
  };
  CHECK(result([](BodySpec& s) { s.mass_kg = -1; }) == Result::bad_mass);
  CHECK(result([](BodySpec& s) { s.mass_kg = 0, s.density_kgpm3 = 0; }) == Result::bad_mass);
  CHECK(result([](BodySpec& s) { s.inertia_kgm2 = {1, 1, 3}; }) == Result::bad_mass);
  CHECK(result([](BodySpec& s) { s.inertia_kgm2 = {1, 1, -1}; }) == Result::bad_mass);
  CHECK(result([](BodySpec& s) { s.inertia_kgm2 = {1, 1, 2}; }) == Result::ok);
  CHECK(result([](BodySpec& s) { s.mass_kg = 2 * limits::kMassMax_kg; }) == Result::out_of_range);
}

}  // namespace cradle
