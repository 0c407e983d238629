// Our broad phase against brute force, over thousands of random sets and long random histories.
#include <catch2/catch.hpp>
#include <numeric>

#include "tests/bench/box_scene.h"

using namespace cradle;
using namespace cradle::bench;

namespace {

std::vector<BodyPair> pairs_of(BroadPhase& broad_phase, const BroadPhaseInput& input) {
  std::vector<BodyPair> pairs;
  broad_phase.find_pairs(input, pairs);
  return pairs;
}

/// Some bodies in a room whose size, far or near, and whose sizes differ from set to set.
BoxScene random_set(std::uint64_t seed) {
  BoxScene scene(seed);
  const auto count = static_cast<std::size_t>(std::exp(scene.uniform(0, 5)));
  const double room = std::exp(scene.uniform(-1, 3));
  const double spread = scene.random() % 2 == 0 ? 0 : scene.uniform(0, 3);  // of sizes
  const Vector flat(1, scene.random() % 3 == 0 ? 0 : 1, scene.random() % 3 == 0 ? 0 : 1);
  const Vector origin = scene.random() % 4 == 0 ? Vector(scene.vector(1e9)) : Vector(0, 0, 0);
  const double immovable = scene.random() % 2 == 0 ? 0 : scene.uniform(0, 1);
  for (std::size_t i = 0; i < count; ++i) {
    Vector half = scene.vector(1).cwiseAbs();
    if (spread == 0) half = Vector::Constant(scene.uniform(0.3, 0.7));
    half *= std::exp(scene.uniform(-spread, spread));
    Vector middle = origin + room * scene.vector(1).cwiseProduct(flat);
    if (scene.random() % 64 == 0) middle *= std::exp(scene.uniform(0, 40));  // an outlier
    scene.add(middle, half, scene.uniform(0, 1) >= immovable);
  }
  return scene;
}

void check_set(std::uint64_t seed) {
  CAPTURE(seed);
  BoxScene scene = random_set(seed);
  const auto broad_phase = make_kept_broad_phase();
  REQUIRE(pairs_of(*broad_phase, scene.input()) == scene.brute_force());
  for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
    if (scene.random() % 3 == 0) scene.move(i, scene.vector(0.1));
  }
  REQUIRE(pairs_of(*broad_phase, scene.input()) == scene.brute_force());
}

/// What may happen to a world between two ticks.
struct History {
  explicit History(std::uint64_t seed) : scene(seed) {
    while (scene.boxes.size() < kLeast) spawn();
  }

  void spawn() {
    const double size = scene.random() % 16 == 0 ? 4 : scene.uniform(0.3, 0.8);
    scene.add(scene.vector(room), Vector::Constant(size), scene.random() % 4 != 0);
    scene.velocities.back() = scene.vector(scene.random() % 64 == 0 ? 1.0 : 0.03);
    ids.push_back(ids.empty() ? 1000 : ids.back() + 1000);
  }
  /// Into the midst: the broad phase need not know that a world has the newest last.
  void squeeze_in() {
    spawn();
    const auto to = static_cast<long>(scene.any_slot());
    const auto rotate = [to](auto& list) {
      std::rotate(list.begin() + to, list.end() - 1, list.end());
    };
    rotate(scene.boxes);
    rotate(scene.moves);
    rotate(scene.velocities);
    ids.pop_back();
    const std::int64_t before = to == 0 ? 0 : ids[static_cast<std::size_t>(to) - 1];
    const bool is_last = static_cast<std::size_t>(to) == ids.size();
    const std::int64_t behind = is_last ? before + 2000 : ids[static_cast<std::size_t>(to)];
    ids.insert(ids.begin() + to, (before + behind) / 2);
  }
  void remove(std::size_t slot) {
    const auto at = [slot](auto& list) { list.erase(list.begin() + static_cast<long>(slot)); };
    at(scene.boxes);
    at(scene.moves);
    at(scene.velocities);
    at(ids);
  }
  BroadPhaseInput input(bool renumbered) {
    BroadPhaseInput now = scene.input(renumbered);
    if (scene.random() % 8 != 0) now.ids = ids;
    return now;
  }

  /// True: slots mean others now.
  bool step() {
    for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
      if (scene.moves[i] == 0 || (calm && i % 16 != 0)) continue;
      scene.move(i, scene.velocities[i]);
      if (scene.boxes[i].lower.norm() > 3 * room) {
        scene.move(i, scene.vector(room) - scene.boxes[i].lower);
      }
    }
    bool renumbered = false;
    switch (scene.random() % 24) {
      case 0:
        for (int k = 0; k < 4; ++k) spawn();
        scene.boxes.end()[-2] = scene.boxes.end()[-3] = scene.boxes.back();  // together
        renumbered = scene.random() % 2 == 0;
        break;
      case 1:
        remove(scene.any_slot());
        renumbered = true;
        break;
      case 2:  // the last one: all others stay where they are
        remove(scene.boxes.size() - 1);
        break;
      case 3:
        scene.move(scene.any_slot(), scene.vector(2 * room));
        break;
      case 4:
        scene.moves[scene.any_slot()] ^= 1;
        break;
      case 5:
        scene.boxes[scene.any_slot()] = {};
        break;
      case 6:
        scene.velocities[scene.any_slot()] = scene.vector(0.05);
        break;
      case 7:
        calm = !calm;
        break;
      case 8:
        std::shuffle(scene.boxes.begin(), scene.boxes.end(), scene.random);
        renumbered = scene.random() % 2 == 0;  // or all have leapt
        break;
      case 9: {
        const std::size_t slot = scene.any_slot();
        const Vector middle = scene.vector(room);
        scene.boxes[slot] = {middle, middle + Vector::Constant(scene.uniform(0, 2))};
        break;
      }
      case 10:
        for (int k = 0; k < 9; ++k) remove(scene.any_slot());
        for (int k = 0; k < 7; ++k) spawn();
        renumbered = true;
        break;
      case 11:
        squeeze_in();
        renumbered = true;
        break;
      default:
        break;
    }
    while (scene.boxes.size() < kLeast) spawn();
    while (scene.boxes.size() > 2 * kLeast) remove(scene.boxes.size() - 1);
    return renumbered;
  }

  static constexpr std::size_t kLeast = 220;
  static constexpr double room = 7;
  BoxScene scene;
  std::vector<std::int64_t> ids;
  bool calm = true;
};

}  // namespace

TEST_CASE("five thousand random sets have the pairs of brute force") {
  for (std::uint64_t seed = 1; seed <= 5000; ++seed) check_set(seed);
}

TEST_CASE("through long random histories the pairs are those of brute force") {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    History history(seed);
    const auto broad_phase = make_kept_broad_phase();
    for (int step = 0; step < 1500; ++step) {
      CAPTURE(seed, step);
      const bool renumbered = history.step();
      REQUIRE(pairs_of(*broad_phase, history.input(renumbered)) == history.scene.brute_force());
    }
  }
}

TEST_CASE("the pairs of thousands of bodies, on the move for long, are those of FCL") {
  BoxScene scene = drifting_boxes(4000);
  const auto ours = make_kept_broad_phase(), fcl = make_fcl_broad_phase();
  for (int step = 0; step < 200; ++step) {
    CAPTURE(step);
    drift(scene, step < 100 ? 4000 : 200);
    REQUIRE(pairs_of(*ours, scene.input()) == pairs_of(*fcl, scene.input()));
  }
}

TEST_CASE("bodies in another order make the same pairs") {
  BoxScene scene = drifting_boxes(500);
  std::vector<std::size_t> places(scene.boxes.size());
  std::iota(places.begin(), places.end(), std::size_t{0});
  const auto expected = pairs_of(*make_kept_broad_phase(), scene.input());
  REQUIRE(expected.size() > 300);
  for (int trial = 0; trial < 20; ++trial) {
    std::shuffle(places.begin(), places.end(), scene.random);
    BoxScene other(1);
    for (const std::size_t place : places) {
      other.boxes.push_back(scene.boxes[place]);
      other.moves.push_back(1);
    }
    auto pairs = pairs_of(*make_kept_broad_phase(), other.input());
    for (BodyPair& pair : pairs) {
      const auto a = static_cast<std::int32_t>(places[static_cast<std::size_t>(pair.a)]);
      const auto b = static_cast<std::int32_t>(places[static_cast<std::size_t>(pair.b)]);
      pair = {std::min(a, b), std::max(a, b)};
    }
    std::sort(pairs.begin(), pairs.end());
    REQUIRE(pairs == expected);
  }
}
