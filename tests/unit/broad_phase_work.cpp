// How much the broad phase does, counted, not timed: growth with the number of bodies, over ten
// thousand steps, and in worlds that are made to hurt.
#include <catch2/catch.hpp>
#include <functional>

#include "server/collision/box_grid.h"
#include "server/collision/box_tree.h"
#include "tests/bench/box_scene.h"

using namespace cradle;
using namespace cradle::bench;

namespace {

/// Boxes and nodes looked at, a body and step, from step `from` on. `step` moves the scene.
double work(BroadPhase& broad_phase, BoxScene& scene, const std::function<void()>& step, int steps,
            int from = 0) {
  std::vector<BodyPair> pairs;
  std::int64_t sum = 0;
  for (int k = 0; k < steps; ++k) {
    step();
    const BroadPhaseReport report = broad_phase.find_pairs(scene.input(), pairs);
    REQUIRE(report.crowded == 0);
    if (k >= from) sum += report.boxes_seen + report.nodes_seen;
  }
  return static_cast<double>(sum) / (steps - from) / static_cast<double>(scene.boxes.size());
}

/// `count` drifting boxes of which `part` move; their sizes spread by up to e^spread either way.
double drifting_work(std::size_t count, double part, double spread) {
  BoxScene scene = drifting_boxes(count);
  if (spread > 0) {
    for (Aabb& box : scene.boxes) {
      const Vector middle = 0.5 * (box.lower + box.upper);
      const double factor = std::exp(scene.uniform(-spread, spread));
      box = {middle + factor * (box.lower - middle), middle + factor * (box.upper - middle)};
    }
  }
  const auto moving = static_cast<std::size_t>(part * static_cast<double>(count));
  const auto broad_phase = make_kept_broad_phase();
  return work(
      *broad_phase, scene, [&] { drift(scene, moving); }, 48, 12);
}

}  // namespace

TEST_CASE("work grows with the number of bodies by an exponent of at most 1.05") {
  struct Kind {
    double part, spread;
  };
  const auto kind = GENERATE(Kind{1, 0}, Kind{0.05, 0}, Kind{1, 1.2});
  CAPTURE(kind.part, kind.spread);
  const double small = drifting_work(1'000, kind.part, kind.spread);
  const double large = drifting_work(100'000, kind.part, kind.spread);
  CAPTURE(small, large);
  CHECK(1 + std::log10(large / small) / 2 <= 1.05);
}

TEST_CASE("after ten thousand steps a step is as much work as at first") {
  const double part = GENERATE(1.0, 0.05);
  const std::size_t count = part == 1 ? 1000 : 10'000;
  BoxScene scene = drifting_boxes(count);
  const auto moving = static_cast<std::size_t>(part * static_cast<double>(count));
  const auto broad_phase = make_kept_broad_phase();
  const auto step = [&] { drift(scene, moving); };
  work(*broad_phase, scene, step, 100);
  const double first = work(*broad_phase, scene, step, 1000);
  work(*broad_phase, scene, step, 8000);
  const double last = work(*broad_phase, scene, step, 1000);
  CHECK(last < 1.05 * first);
}

TEST_CASE("bodies that move by turns do not make the young many") {
  BoxScene scene = drifting_boxes(10'000);
  std::size_t next = 0;
  const auto step = [&] {
    for (int k = 0; k < 100; ++k, next = (next + 37) % 10'000) scene.move(next, scene.vector(0.3));
  };
  const auto broad_phase = make_kept_broad_phase();
  CHECK(work(*broad_phase, scene, step, 300, 100) < 2.1);
}

TEST_CASE("a small flock far from all others is found at once") {
  std::vector<FloatBox> boxes(100'000);
  std::vector<std::int32_t> slots(boxes.size());
  BoxScene scene(1);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Vector middle = scene.vector(37) + Vector::Constant(i % 25 == 0 ? 20'000 : 0);
    boxes[i] = to_float({middle, middle + Vector::Ones()}, Vector::Zero());
    slots[i] = static_cast<std::int32_t>(i);
  }
  BoxTree tree;
  tree.build(boxes, slots, MortonCurve(boxes, slots));
  std::int64_t nodes = 0;
  for (std::size_t i = 0; i < boxes.size(); i += 1000) {
    nodes += tree.query(boxes[i], [](std::int32_t) {});
  }
  CHECK(nodes / 100 < 200);
}

TEST_CASE("the grid declines boxes of different sizes, and too many in a cell") {
  const auto suits = [](const BoxScene& scene) {
    std::vector<FloatBox> boxes;
    std::vector<std::int32_t> slots;
    for (const Aabb& box : scene.boxes) {
      slots.push_back(static_cast<std::int32_t>(boxes.size()));
      boxes.push_back(to_float(box, Vector::Zero()));
    }
    return BoxGrid().build(boxes, slots);
  };
  BoxScene scene = drifting_boxes(1000);
  CHECK(suits(scene));
  CHECK_FALSE(suits(BoxScene(1)));
  for (std::size_t i = 0; i < 1000; i += 10) scene.boxes[i].upper.z() += 10;
  CHECK_FALSE(suits(scene));
  scene = drifting_boxes(1000);
  for (std::size_t i = 0; i < 500; ++i) scene.boxes[i] = scene.boxes[0];
  CHECK_FALSE(suits(scene));
}

TEST_CASE("worlds made to hurt take at most ten times the work of a regular one") {
  const std::size_t count = 20'000;
  const double regular = drifting_work(count, 1, 0);
  BoxScene scene = drifting_boxes(count);
  const auto broad_phase = make_kept_broad_phase();
  const auto check = [&](const std::function<void()>& step) {
    const double hurt = work(*broad_phase, scene, step, 24);
    CAPTURE(hurt, regular);
    CHECK(hurt <= 10 * regular);
  };
  SECTION("one huge body over many small ones") {
    const bool first = GENERATE(true, false), moves = GENERATE(true, false);
    const std::size_t slot = first ? 0 : count - 1;
    scene.boxes[slot] = {Vector::Constant(-1e3), Vector::Constant(1e3)};
    scene.moves[slot] = moves ? 1 : 0;
    check([&] { drift(scene, count - 1); });
  }
  SECTION("all leap in each step") {
    check([&] { scene = drifting_boxes(count, scene.random()); });
  }
  SECTION("a line along an axis, or along a diagonal") {
    const Vector along =
        GENERATE(Vector(1, 0, 0), Vector(0, 1, 0), Vector(0, 0, 1), Vector(1, 1, 1));
    for (std::size_t i = 0; i < count; ++i) {
      scene.move(i, -0.5 * (scene.boxes[i].lower + scene.boxes[i].upper));
      scene.move(i, 2 * static_cast<double>(i) * along);
    }
    check([&] {
      for (std::size_t i = 0; i < count; ++i) scene.move(i, scene.velocities[i]);
    });
  }
  SECTION("one body a world away") {
    const double far = GENERATE(1e6, 1e12, 1e90);
    scene.move(7, Vector::Constant(far));
    check([&] { drift(scene, 7); });
  }
  SECTION("a flock far from the origin, and dust all around") {
    for (std::size_t i = 0; i < count; ++i) scene.move(i, Vector(1e7, -1e7, 1e7));
    for (std::size_t i = 0; i < count; i += 20) scene.move(i, scene.vector(1e6));
    check([&] {
      for (std::size_t i = 0; i < count; ++i) scene.move(i, scene.velocities[i]);
    });
  }
}
