// Too many bodies in one place: which pairs stay, and that the work stays within bounds, too.
#include <catch2/catch.hpp>

#include "tests/bench/box_scene.h"

using namespace cradle;
using namespace cradle::bench;

namespace {

/// All pairs, planes too; if they are too many, the rule of BroadPhase::find_pairs, to the letter.
std::vector<BodyPair> by_the_rule(const BoxScene& scene, std::int64_t& crowded) {
  std::vector<BodyPair> all = scene.brute_force();
  for (const Plane& plane : scene.planes) {
    for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
      const Aabb& box = scene.boxes[i];
      const auto slot = static_cast<std::int32_t>(i);
      const bool moves = scene.moves[i] != 0 || scene.moves[static_cast<std::size_t>(plane.slot)];
      if (!moves || box.is_empty() || box.lower.z() > plane.offset) continue;  // all face upwards
      all.push_back({std::min(slot, plane.slot), std::max(slot, plane.slot)});
    }
  }
  std::sort(all.begin(), all.end());
  crowded = 0;
  const std::size_t slots = scene.boxes.size(), most = pairs_max(slots);
  const std::size_t k = partners_kept(slots);
  if (all.size() <= most) return all;
  std::vector<std::vector<std::int32_t>> partners(slots);
  for (const BodyPair& pair : all) {
    partners[static_cast<std::size_t>(pair.a)].push_back(pair.b);
    partners[static_cast<std::size_t>(pair.b)].push_back(pair.a);
  }
  for (auto& of_one : partners) std::sort(of_one.begin(), of_one.end());
  const auto keeps = [&](std::int32_t one, std::int32_t other) {
    const auto& of_one = partners[static_cast<std::size_t>(one)];
    return of_one.size() <= k || other < of_one[k];
  };
  std::vector<BodyPair> kept;
  for (const BodyPair& pair : all) {
    if (keeps(pair.a, pair.b) || keeps(pair.b, pair.a)) kept.push_back(pair);
  }
  for (const auto& of_one : partners) crowded += of_one.size() > k ? 1 : 0;
  return kept;
}

/// Bodies within one another, a few beside, some that never yield, one over all, and a floor.
BoxScene dense_scene(std::uint64_t seed) {
  BoxScene scene(seed);
  const auto count = 280 + scene.random() % 160;
  const double immovable = scene.uniform(0, 0.1);
  const std::size_t giant = scene.random() % count;
  for (std::size_t i = 0; i < count; ++i) {
    const bool is_beside = scene.random() % 8 == 0;
    const Vector middle = scene.vector(is_beside ? 20 : 0.45);
    const double half = i == giant ? 100 : scene.uniform(0.4, 0.6);
    scene.add(middle, Vector::Constant(half), scene.uniform(0, 1) >= immovable);
  }
  const auto floor = static_cast<std::int32_t>(scene.random() % count);
  scene.boxes[static_cast<std::size_t>(floor)] = {};
  scene.moves[static_cast<std::size_t>(floor)] = 0;
  scene.planes = {{floor, Vector::UnitZ(), 0}};
  return scene;
}

BoxScene one_point(std::size_t count, bool moves) {
  BoxScene scene(1);
  for (std::size_t i = 0; i < count; ++i) scene.add({1, 2, 3}, Vector::Ones(), moves);
  return scene;
}

}  // namespace

TEST_CASE("of too many pairs each body keeps those with its oldest partners") {
  const std::string name = GENERATE(from_range(broad_phase_names()));
  CAPTURE(name);
  const auto broad_phase = make_broad_phase(name);
  int crowds = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    const BoxScene scene = dense_scene(seed);
    std::int64_t crowded = 0;
    const std::vector<BodyPair> expected = by_the_rule(scene, crowded);
    std::vector<BodyPair> pairs;
    const BroadPhaseReport report = broad_phase->find_pairs(scene.input(), pairs);
    REQUIRE(pairs == expected);
    REQUIRE(report.crowded == crowded);
    REQUIRE((report.method == "crowd") == (crowded > 0));
    REQUIRE(pairs.size() <= pairs_max(scene.boxes.size()));
    crowds += crowded > 0 ? 1 : 0;
  }
  CHECK(crowds > 5);
  CHECK(crowds < 20);
}

TEST_CASE("a crowd that parts again leaves nothing behind") {
  BoxScene scene = one_point(1000, true);
  const auto broad_phase = make_kept_broad_phase();
  std::vector<BodyPair> pairs;
  CHECK(broad_phase->find_pairs(scene.input(), pairs).crowded == 1000);
  for (std::size_t i = 0; i < 1000; ++i) scene.move(i, Vector(1.5 * static_cast<double>(i), 0, 0));
  for (int step = 0; step < 3; ++step) {
    CHECK(broad_phase->find_pairs(scene.input(), pairs).crowded == 0);
    REQUIRE(pairs == scene.brute_force());
  }
}

TEST_CASE("many bodies in one point cost no more than the pairs that are kept") {
  const std::size_t count = 20'000;
  const auto broad_phase = make_kept_broad_phase();
  std::vector<BodyPair> pairs;
  for (int step = 0; step < 3; ++step) {
    const auto report = broad_phase->find_pairs(one_point(count, true).input(), pairs);
    CHECK(report.crowded == static_cast<std::int64_t>(count));
    CHECK(pairs.size() > count * (partners_kept(count) - 1));
    CHECK(pairs.size() <= count * partners_kept(count));
    const auto most = static_cast<std::int64_t>(pairs_max(count));
    CHECK(report.boxes_seen < 4 * most);
    CHECK(report.nodes_seen < 4 * most);
  }
}

TEST_CASE("bodies that never yield, all in one point, cost nothing but a look") {
  const std::size_t count = 200'000;
  BoxScene scene = one_point(count, false);
  scene.add({50, 0, 0}, Vector::Ones());
  const auto broad_phase = make_kept_broad_phase();
  std::vector<BodyPair> pairs;
  for (int step = 0; step < 3; ++step) {
    if (step == 2) scene.move(count, Vector(1, 0, 0));
    const auto report = broad_phase->find_pairs(scene.input(), pairs);
    CHECK(pairs.empty());
    CHECK(report.boxes_seen + report.nodes_seen < 3 * static_cast<std::int64_t>(count));
  }
}
