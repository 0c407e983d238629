// Impacts of balls, found in parts of space side by side: what one finds, to the bit.
#include <catch2/catch.hpp>
#include <vector>

#include "tests/physics/flock.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

/// So many, by their own account; in turn.
class ManyThreads final : public Executor {
 public:
  explicit ManyThreads(int threads) : threads_(threads) {}
  void for_ranges(int count, int, RangeTask task) override {
    if (count > 0) task(0, count);
  }
  int threads() const override { return threads_; }

 private:
  int threads_;
};

/// A gas in a box, on a lattice that it soon leaves.
struct Gas {
  double pitch_m;    ///< of balls of radius 0.5
  double speed_mps;  ///< along each axis, at most
  double restitution, friction;
  double gravity_mps2;
};
constexpr Gas kGases[] = {
    {1.7, 5, 1, 0, 0},         // parts hardly ever disagree
    {1.25, 5, 1, 0.5, 0},      // chains of impacts
    {1.15, 12, 0.9, 0.3, 0},   // each ball has some in a tick
    {1.4, 8, 0.7, 0.3, 9.81},  // what comes to rest on the floor takes no part
    {1.06, 20, 1, 0.1, 0},     // impacts travel far: parts disagree
};
constexpr int kColumns = 8, kLayers = 36;

World world_of(const Gas& gas) {
  WorldSettings how = settings();
  how.gravity_W = {0, 0, -gas.gravity_mps2};
  how.balance_every = 4;
  World world(how);
  const double width = kColumns * gas.pitch_m, height = kLayers * gas.pitch_m;
  const auto put = [&](BodySpec spec) {
    spec.material.restitution = gas.restitution;
    spec.material.friction = gas.friction;
    add(world, spec);
  };
  const auto wall = [&](const Vec3& half, const Vec3& at) {
    BodySpec spec = brick(half, at);
    spec.kind = BodyKind::fixed;
    put(spec);
  };
  const double far = width / 2 + 2;
  for (const double side : {-far, far}) {
    wall({2, far + 2, height}, {side, 0, 0});
    wall({far + 2, 2, height}, {0, side, 0});
    wall({far + 2, far + 2, 2}, {0, 0, side < 0 ? -height / 2 - 2 : height / 2 + 2});
  }
  std::mt19937_64 random(7);
  for (int k = 0; k < kColumns * kColumns * kLayers; ++k) {
    const auto place = [&](int i, int count) { return (i + 0.5 - count / 2.0) * gas.pitch_m; };
    const Vector v = random_vector(random, gas.speed_mps);
    put(ball(0.5,
             {place(k % kColumns, kColumns), place(k / kColumns % kColumns, kColumns),
              place(k / kColumns / kColumns, kLayers)},
             {v.x(), v.y(), v.z()}));
  }
  return world;
}

/// What went on, tick by tick.
struct History {
  std::vector<std::vector<std::uint8_t>> hashes;
  std::vector<double> kinetic_J, impacts_J;
  std::int64_t impacts = 0, ordered = 0, spent = 0;
};
History history_of(const Gas& gas, Executor& executor) {
  World world = world_of(gas);
  History history;
  for (int tick = 0; tick < 8; ++tick) {
    const StepReport report = world.step(executor);
    const auto hash = world.hash();
    history.hashes.emplace_back(hash.begin(), hash.end());
    history.kinetic_J.push_back(report.balance.kinetic_J);
    history.impacts_J.push_back(report.balance.impacts_J);
    history.impacts += report.impacts;
    history.ordered += report.impacts_ordered;
    history.spent += report.impacts_spent;
  }
  return history;
}

}  // namespace

TEST_CASE("impacts are the same to the bit in one part of space and in many") {
  for (const Gas& gas : kGases) {
    CAPTURE(gas.pitch_m, gas.gravity_mps2);
    SerialExecutor alone;
    const History one = history_of(gas, alone);
    CHECK(one.impacts > 500);
    for (const int threads : {2, 5}) {
      CAPTURE(threads);
      ManyThreads many(threads);
      const History other = history_of(gas, many);
      CHECK(other.hashes == one.hashes);
      CHECK(other.kinetic_J == one.kinetic_J);
      CHECK(other.impacts_J == one.impacts_J);
      CHECK(other.impacts == one.impacts);
      CHECK(other.ordered == one.ordered);
      CHECK(other.spent == one.spent);
    }
  }
}

}  // namespace cradle
