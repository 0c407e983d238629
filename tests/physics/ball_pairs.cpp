// Balls that are apart from the broad phase go as they would if it knew them: it does where enough
// other bodies are in the world, and these may be far away.
#include <array>
#include <catch2/catch.hpp>
#include <cstring>
#include <random>
#include <vector>

#include "tests/physics/worlds.h"

namespace cradle {
namespace {

/// What a scene is to bring.
struct Mixture {
  const char* name;
  double gravity, speed, bouncing;
  bool is_sleeping;
};
constexpr Mixture kMixtures[] = {
    {"a gas", 0, 5, 1, false},
    {"a hot gas", 0, 60, 0.9, false},
    {"rain", 9.81, 2, 0.5, false},
    {"rain on sleepers", 9.81, 1, 0.2, true},
};

BodySpec fixed(BodySpec spec) {
  spec.kind = BodyKind::fixed;
  return spec;
}

/// A room with things in it; balls of many sizes above them, some of which overlap.
void fill(World& world, const Mixture& mixture, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto within = [&](double most) {
    return std::uniform_real_distribution<double>(-most, most)(random);
  };
  add(world, ground(0.3));
  for (const double sign : {-1.0, 1.0}) {
    add(world, fixed(brick({1, 9, 9}, {sign * 6, 0, 5})));
    add(world, fixed(brick({9, 1, 9}, {0, sign * 6, 5})));
  }
  add(world, fixed(brick({9, 9, 1}, {0, 0, 14})));
  BodySpec pillar = fixed(brick({1, 1, 1}, {2, 2, 3}));
  pillar.shape = Shape::capsule(0.5, 1);
  add(world, pillar);
  BodySpec cone = fixed(brick({1, 1, 1}, {-2, 2, 0.5}));
  cone.shape = Shape::cone(0.8, 0.5);
  add(world, cone);
  BodySpec paddle = brick({0.3, 2, 0.3}, {0, -2, 3}, {0.5, 0, 0});
  paddle.kind = BodyKind::kinematic;
  paddle.w_WB = {0, 0, 2};
  add(world, paddle);
  for (int k = 0; k < 6; ++k) {
    add(world, brick({0.3, 0.4, 0.3}, {within(4), within(4), 0.3 + k}, {within(1), 0, 0}));
  }
  for (int k = 0; k < 300; ++k) {
    const Vec3 x{1.1 * (k % 8) - 3.9 + within(0.35), 1.1 * (k / 8 % 8) - 3.9 + within(0.35),
                 3 + 1.1 * (k / 64) + 4 * (k / 256)};
    const double v = mixture.speed;
    BodySpec spec = ball(k % 7 == 0 ? 0.25 : 0.4, x, {within(v), within(v), within(v)});
    spec.material = {0.3, mixture.bouncing};
    add(world, spec);
  }
}

/// Far off, each by itself.
void add_bystanders(World& world) {
  for (int k = 0; k < 400; ++k) {
    add(world, fixed(brick({0.5, 0.5, 0.5}, {1e3 + 2 * (k % 20), 2.0 * (k / 20), 50})));
  }
}

bool are_same(const BodyState& one, const BodyState& other) {
  return std::memcmp(&one.p_WBo, &other.p_WBo, sizeof one.p_WBo) == 0 &&
         std::memcmp(&one.q_WB, &other.q_WB, sizeof one.q_WB) == 0 &&
         std::memcmp(&one.v_WBcm, &other.v_WBcm, sizeof one.v_WBcm) == 0 &&
         std::memcmp(&one.w_WB, &other.w_WB, sizeof one.w_WB) == 0;
}

}  // namespace

TEST_CASE("balls go the same way whether or not the broad phase knows them") {
  int apart = 0, contacts = 0, impacts = 0;
  for (const Mixture& mixture : kMixtures) {
    for (std::uint64_t seed = 0; seed < 8; ++seed) {
      CAPTURE(mixture.name, seed);
      WorldSettings chosen = settings(60, {0, 0, -mixture.gravity});
      chosen.is_sleeping = mixture.is_sleeping;
      World world(chosen), with_bystanders(chosen);
      fill(world, mixture, seed);
      fill(with_bystanders, mixture, seed);
      add_bystanders(with_bystanders);
      std::vector<BodyState> some, all;
      for (int tick = 0; tick < 90; ++tick) {
        CAPTURE(tick);
        const StepReport report = world.step(), same = with_bystanders.step();
        REQUIRE(same.pairs_by != "balls");
        apart += report.pairs_by == "balls" ? 1 : 0;
        contacts += report.pairs_by == "balls" ? static_cast<int>(report.contacts) : 0;
        impacts += report.impacts;
        REQUIRE(report.impacts == same.impacts);
        REQUIRE(report.pairs == same.pairs);
        REQUIRE(report.contacts == same.contacts);
        world.snapshot(some);
        with_bystanders.snapshot(all);
        for (std::size_t i = 0; i < some.size(); ++i) {
          CAPTURE(i);
          REQUIRE(are_same(some[i], all[i]));
        }
      }
    }
  }
  CHECK(apart > 300);
  CHECK(contacts > 1000);
  CHECK(impacts > 5000);
}

TEST_CASE("what leaves its box within a tick meets balls where they have flown to") {
  // A bullet strikes a cube at rest, which goes farther than it: after ticks in which nobody asked
  // where these balls are.
  int apart = 0, stopped = 0;
  for (int k = 0; k < 8; ++k) {
    World world(settings(60, {})), with_bystanders(settings(60, {}));
    std::array<BodyId, 2> struck;
    for (World* one : {&world, &with_bystanders}) {
      struck[one == &world ? 0 : 1] = add(*one, brick({0.02, 0.02, 0.02}, {}));
      BodySpec bullet = brick({0.05, 0.05, 0.05}, {-51 - 0.25 * k, 0.005, 0}, {600, 0, 0});
      bullet.mass_kg = 100;
      add(*one, bullet);
      for (int i = 0; i < 81; ++i) {  // a curtain that is drawn
        add(*one, ball(0.21, {10, 0.43 * (i % 9 - 4.0) - 0.2, 0.45 * (i / 9 - 4.0)}, {0, 2, 0}));
      }
    }
    add_bystanders(with_bystanders);
    for (int tick = 0; tick < 12; ++tick) {
      const StepReport report = world.step(), same = with_bystanders.step();
      CAPTURE(k, tick);
      REQUIRE(same.pairs_by != "balls");
      apart += report.pairs_by == "balls" ? 1 : 0;
      stopped += report.stopped_at_impact;
      REQUIRE(report.stopped_at_impact == same.stopped_at_impact);
      REQUIRE(are_same(state(world, struck[0]), state(with_bystanders, struck[1])));
    }
  }
  CHECK(apart > 60);
  CHECK(stopped > 8);
}

}  // namespace cradle
