// The same bits at every width, whatever flies beside a body.
#include <catch2/catch.hpp>

#include "server/collision/machine_lanes.h"
#include "tests/physics/flock.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

/// Points, round and other bodies, slow and fast, pushed and not, in a random order.
Flock mixed(std::size_t count) {
  std::mt19937_64 random(7);
  Flock flock;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t shape = random() % 4;
    const Vector J = shape == 0   ? Vector(Vector::Zero())
                     : shape == 1 ? Vector(Vector::Constant(uniform(random, 0.1, 3)))
                                  : random_inertia(random);
    constexpr Course courses[] = {Course::falls,  Course::falls, Course::falls,
                                  Course::pushed, Course::still, Course::driven};
    const std::size_t body = flock.add(courses[random() % 6], J);
    flock.x[body] = random_vector(random, 10);
    flock.v[body] = random_vector(random, 3);
    flock.q[body] = Rotation(Eigen::Vector4d::Random()).normalized();
    // Up to 2 rad a tick: one step or thirteen.
    if (random() % 5 != 0) {
      flock.w[body] = 60 * std::pow(10, uniform(random, -3, 0.3)) * random_axis(random);
    }
    if (flock.course[body] != Course::pushed) continue;
    flock.acceleration[body] = random_vector(random, 20);
    if (random() % 3 != 0) flock.torque_W[body] = random_vector(random, 30);
    if (random() % 3 != 0) flock.torque_P[body] = random_vector(random, 30);
  }
  return flock;
}

}  // namespace

TEST_CASE("bodies fly to the same bits at every width") {
  const auto lanes = machine_lanes();
  REQUIRE(lanes.front() == 1);
  REQUIRE(lanes.size() >= 2);
  const Flock start = mixed(1003);
  Flock one = start;
  one.fly({1.0 / 60, {0, 0, -9.81}, 1}, 100);
  CHECK_FALSE(same_bits(start, one));
  for (const int width : lanes) {
    INFO(width << " lanes");
    Flock flock = start;
    flock.fly({1.0 / 60, {0, 0, -9.81}, width}, 100);
    CHECK(same_bits(flock, one));
  }
}

TEST_CASE("bodies in a row fly to the same bits at every width") {
  // Whole vectors are moved here, where mixed bodies are gathered one by one.
  Flock start;
  std::mt19937_64 random(3);
  for (int i = 0; i < 259; ++i) {
    const std::size_t body = start.add(Course::falls, {1, 2, 3});
    start.x[body] = random_vector(random, 10);
    start.v[body] = random_vector(random, 3);
    start.w[body] = random_vector(random, 4);
  }
  Flock one = start;
  one.fly({1.0 / 60, Vector::Zero(), 1}, 100);
  for (const int width : machine_lanes()) {
    INFO(width << " lanes");
    Flock flock = start;
    flock.fly({1.0 / 60, Vector::Zero(), width}, 100);
    CHECK(same_bits(flock, one));
  }
}

TEST_CASE("a body flies to the same bits alone, and in any range") {
  const FlightTick tick{1.0 / 60, {0, 0, -9.81}, 0};
  const Flock start = mixed(301);
  Flock together = start;
  together.fly(tick);
  Flock apart = start;
  for (const auto& [begin, end] : {std::pair{200, 301}, {0, 13}, {13, 14}, {14, 200}}) {
    fly_all(tick, apart.arrays(), begin, end);
  }
  CHECK(same_bits(together, apart));
  Flock alone = start;
  for (int i = 0; i < 301; ++i) fly_all(tick, alone.arrays(), i, i + 1);
  CHECK(same_bits(together, alone));
}

TEST_CASE("a body that leaves the limits stays where it was, and its neighbours fly") {
  for (const int width : machine_lanes()) {
    INFO(width << " lanes");
    Flock flock;
    for (int i = 0; i < 24; ++i) {
      flock.add(Course::pushed, {1, 2, 3});
      flock.v.back() = flock.w.back() = {1, 1, 1};
      flock.q.back() = Rotation(1, 2, 3, 4).normalized();
    }
    const Rotation q = flock.q[0];
    flock.x[3] = {0, 1e8, 0};                // 17 mm beyond the limit
    flock.torque_W[9] = {1e15, 0, 0};        // far too fast
    flock.acceleration[10] = {0, 0, 1e9};    // likewise
    flock.torque_P[17] = {0, 1e300, 1e300};  // no number
    flock.x[20] = {0, 1e8 - 1, 0};           // just within
    flock.fly({1.0 / 60, Vector::Zero(), width});
    for (std::size_t i = 0; i < flock.size(); ++i) {
      INFO(i);
      const bool is_lost = i == 3 || i == 9 || i == 10 || i == 17;
      CHECK(static_cast<bool>(flock.lost[i]) == is_lost);
      CHECK((flock.q[i].coeffs() == q.coeffs()) == is_lost);
      if (!is_lost) CHECK(flock.x[i].x() == Approx(1.0 / 60));
      if (is_lost) CHECK(flock.x[i].x() == 0);
    }
    CHECK_FALSE(flock.w[17].allFinite());
  }
}

TEST_CASE("a world has the same hash at every width") {
  std::vector<std::array<std::uint8_t, 8>> hashes;
  for (const int width : machine_lanes()) {
    WorldSettings how = settings();
    how.lanes = width;
    World world(how);
    add(world, ground());
    std::mt19937_64 random(5);
    std::vector<Wrench> wrenches;
    for (int i = 0; i < 100; ++i) {
      const Vector at = random_vector(random, 5) + Vector(0, 0, 7);
      BodySpec spec = i % 3 == 0 ? ball(0.1, to_plain(at)) : brick({0.1, 0.2, 0.3}, to_plain(at));
      if (i % 5 == 0) {
        spec.shape = Shape{};
        spec.inertia_kgm2 = {1, 2, 2.5};
      }
      spec.w_WB = to_plain(random_vector(random, 30));
      const BodyId body = add(world, spec);
      if (i % 4 != 0) continue;
      Wrench& wrench = wrenches.emplace_back();
      wrench.body = body;
      wrench.frame = i % 8 == 0 ? WrenchFrame::body : WrenchFrame::world;
      wrench.quantity = WrenchQuantity::torque;
      wrench.value = {0.01, 0.02, -0.01};
      wrench.duration = WrenchDuration::until_cleared;
    }
    REQUIRE(world.push(wrenches).result == Result::ok);
    steps(world, 120);
    hashes.push_back(world.hash());
  }
  for (const auto& hash : hashes) CHECK(hash == hashes.front());
}

}  // namespace cradle
