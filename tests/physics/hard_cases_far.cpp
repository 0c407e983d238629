// Hard cases of far worlds, of repetition, and of overlaps at the start.
#include <catch2/catch.hpp>
#include <random>
#include <thread>
#include <vector>

#include "server/collision/machine_lanes.h"
#include "server/dynamics/free_flight.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

/// Places of bodies after a second, seen from a place that everything stands about.
std::vector<Vec3> run_at(const Vec3& origin, int ticks, const std::vector<BodySpec>& specs) {
  World world(settings());
  std::vector<BodyId> bodies;
  for (BodySpec spec : specs) {
    spec.p_WBo = {spec.p_WBo.x + origin.x, spec.p_WBo.y + origin.y, spec.p_WBo.z + origin.z};
    bodies.push_back(add(world, spec));
  }
  steps(world, ticks);
  std::vector<Vec3> places;
  for (const BodyId body : bodies) places.push_back(state(world, body).p_WBo - origin);
  return places;
}

double largest_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::fmax(most, distance(a[i], b[i]));
  return most;
}

/// On two threads, the halves in either order.
class TwoThreads final : public Executor {
 public:
  void for_ranges(int count, int least, RangeTask task) override {
    if (count < 2 * least) return count > 0 ? task(0, count) : void();
    const int half = count / 2;
    std::thread other([&] {
      if (half > 0) task(0, half);
    });
    if (count > half) task(half, count);
    other.join();
  }
  int threads() const override { return 2; }
};

/// Of a heap of balls, bricks and rods that fall on each other.
std::vector<std::array<std::uint8_t, 8>> hashes(int lanes, Executor& executor) {
  WorldSettings how = settings();
  how.lanes = lanes;
  World world(how);
  add(world, ground());
  std::mt19937_64 random(43);
  const auto any = [&](double size) {
    return (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5) * 2 * size;
  };
  for (int i = 0; i < 60; ++i) {
    const Vec3 at{any(1.5), any(1.5), 0.5 + 0.2 * i};
    BodySpec spec = i % 3 == 0 ? ball(0.3, at) : brick({0.3, 0.2, 0.25}, at);
    if (i % 3 == 2) spec.shape = Shape::capsule(0.15, 0.4);
    spec.w_WB = {any(9), any(9), any(9)};
    if (i % 5 == 0) spec.material.restitution = 0.5;
    add(world, spec);
  }
  std::vector<std::array<std::uint8_t, 8>> found;
  for (int tick = 0; tick < 240; ++tick) {
    world.step(executor);
    found.push_back(world.hash());
  }
  return found;
}

}  // namespace

TEST_CASE("P38: ten thousand kilometres from the origin all goes as at it") {
  // P13 and a stack of ten at 1e7 m: the same, relative to their size, within 1e-8 (Box3D has 1e-3,
  // in float). Doubles are 1.9e-9 m apart there.
  const Vec3 far{1e7, -1e7, 1e7};
  BodySpec sphere = ball(0.5, {0, 0, 0.5}, {2, 0, 0});
  sphere.material.friction = 0.2;
  const std::vector<BodySpec> sliding{ground(0.2), sphere};
  std::vector<BodySpec> stack{ground()};
  for (int i = 0; i < 10; ++i) stack.push_back(brick({0.5, 0.5, 0.5}, {0, 0, 0.5 + i}));
  const double of_sliding = largest_difference(run_at({}, 60, sliding), run_at(far, 60, sliding));
  const double of_stack = largest_difference(run_at({}, 600, stack), run_at(far, 600, stack));
  CAPTURE(of_sliding, of_stack);
  CHECK(of_sliding / 1.5 < 1e-8);  // m that the sphere goes
  CHECK(of_stack / 10 < 1e-8);
}

TEST_CASE("P43: the same inputs give the same bits, on one and two threads and in any lanes") {
  // Box3D's test_determinism and Jolt's PhysicsDeterminismTests. By the hash of every tick.
  SerialExecutor serial;
  TwoThreads two;
  const auto first = hashes(0, serial);
  CHECK(hashes(0, serial) == first);
  CHECK(hashes(0, two) == first);
  for (const int lanes : machine_lanes()) {
    CAPTURE(lanes);
    CHECK(hashes(lanes, serial) == first);
    CHECK(hashes(lanes, two) == first);
  }
}

TEST_CASE("P44: ten cubes that overlap by 5 cm each part without a leap") {
  // As Solver2D's and Box3D's OverlapRecovery: at rest, for 5 s. The overlap is resolved to the
  // slop (0.5 mm a contact), the top rises no more than 1 cm above where it should rest, and all
  // end slower than 1e-3 m/s.
  for (const int sub_steps : {0, 4, 8, 32}) {
    CAPTURE(sub_steps);
    WorldSettings how = settings();
    how.sub_steps = sub_steps;
    World world(how);
    add(world, ground());
    std::vector<BodyId> cubes;
    for (int i = 0; i < 10; ++i) {
      cubes.push_back(add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.45 + 0.95 * i})));
    }
    double overshoot = -1;
    for (int tick = 0; tick < 300; ++tick) {
      world.step();
      for (std::size_t i = 0; i < cubes.size(); ++i) {
        const double rest = 0.5 + static_cast<double>(i);
        overshoot = std::fmax(overshoot, state(world, cubes[i]).p_WBo.z - rest);
      }
    }
    CAPTURE(overshoot);
    CHECK(overshoot < 1e-2);
    double below = 0;
    for (const BodyId cube : cubes) {
      const BodyState s = state(world, cube);
      if (sub_steps == 0) CHECK(below + 0.5 - s.p_WBo.z < 1.01 * 0.5e-3);
      CHECK(norm(s.v_WBcm) < 1e-3);
      CHECK(std::hypot(s.p_WBo.x, s.p_WBo.y) < 1e-2);
      below = s.p_WBo.z + 0.5;
    }
  }
}

}  // namespace cradle
