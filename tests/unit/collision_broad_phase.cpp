// The broad phase against all pairs by brute force, over scenes that move, change and go wrong.
#include <algorithm>
#include <catch2/catch.hpp>
#include <random>

#include "server/collision/broad_phase.h"

using namespace cradle;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Bodies that drift in a cubic room with a floor and a slope.
struct BoxesAndPlanes {
  explicit BoxesAndPlanes(std::size_t size) {
    for (std::size_t slot = 0; slot < size; ++slot) add();
    boxes[0] = boxes[1] = {};
    planes = {{0, Vector::UnitZ(), -3}, {1, Vector(-3, 0, 4) / 5, -3}};
  }

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  }
  Vector vector(double size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }
  std::size_t any_slot() { return 2 + random() % (boxes.size() - 2); }

  void add() {
    const Vector middle = vector(4), half = vector(0.8).cwiseAbs();
    boxes.push_back({middle - half, middle + half});
    moves.push_back(random() % 4 != 0);
  }
  void step() {
    for (std::size_t slot = 2; slot < boxes.size(); ++slot) {
      if (!moves[slot]) continue;
      const Vector by = vector(0.1);
      boxes[slot].lower += by;
      boxes[slot].upper += by;
    }
  }

  BroadPhaseInput input(bool renumbered = false) const {
    return {boxes, moves, planes, renumbered};
  }

  std::vector<BodyPair> brute_force() const {
    std::vector<BodyPair> pairs;
    const auto count = static_cast<std::int32_t>(boxes.size());
    for (std::int32_t a = 0; a < count; ++a) {
      for (std::int32_t b = a + 1; b < count; ++b) {
        if ((at(moves, a) || at(moves, b)) && meet(a, b)) pairs.push_back({a, b});
      }
    }
    return pairs;
  }

  std::mt19937_64 random{7};
  std::vector<Aabb> boxes;
  std::vector<std::uint8_t> moves;
  std::vector<Plane> planes;

 private:
  template <typename T>
  static const T& at(const std::vector<T>& items, std::int32_t slot) {
    return items[static_cast<std::size_t>(slot)];
  }
  bool meet(std::int32_t a, std::int32_t b) const {
    for (const Plane& plane : planes) {
      if (plane.slot == a) return dips(at(boxes, b), plane);
      if (plane.slot == b) return dips(at(boxes, a), plane);
    }
    const Aabb &one = at(boxes, a), &other = at(boxes, b);
    return is_sound(one) && is_sound(other) && one.overlaps(other);
  }
  static bool is_sound(const Aabb& box) {
    return !box.is_empty() && box.lower.allFinite() && box.upper.allFinite();
  }
  static bool dips(const Aabb& box, const Plane& plane) {
    if (!is_sound(box)) return false;
    double lowest = kInfinity;
    for (int k = 0; k < 8; ++k) {
      const Vector corner(k & 1 ? box.upper.x() : box.lower.x(),
                          k & 2 ? box.upper.y() : box.lower.y(),
                          k & 4 ? box.upper.z() : box.lower.z());
      lowest = std::min(lowest, plane.normal_W.dot(corner));
    }
    return lowest <= plane.offset;
  }
};

std::vector<BodyPair> replaced_pairs_of(BroadPhase& broad_phase, const BroadPhaseInput& input) {
  std::vector<BodyPair> pairs{{-1, -1}};  // to be replaced
  broad_phase.find_pairs(input, pairs);
  return pairs;
}

const Aabb kUnitBox{{0, 0, 0}, {1, 1, 1}};

/// Sections of a test, one a broad phase.
std::unique_ptr<BroadPhase> each_broad_phase() {
  const std::string name = GENERATE(from_range(broad_phase_names()));
  UNSCOPED_INFO(name);
  return make_broad_phase(name);
}

}  // namespace

TEST_CASE(
    "the broad phase finds the pairs of brute force while bodies move, come, go and turn bad") {
  BoxesAndPlanes scene(160);
  const auto broad_phase = each_broad_phase();
  std::size_t most = 0;
  for (int step = 0; step < 300; ++step) {
    CAPTURE(step);
    scene.step();
    bool renumbered = false;
    if (step % 17 == 5) scene.add();
    if (step % 23 == 7) scene.boxes[scene.any_slot()] = {};
    if (step % 29 == 8) scene.boxes[scene.any_slot()].lower.x() = kNan;
    if (step % 31 == 9) scene.boxes[scene.any_slot()].upper.z() = kInfinity;
    if (step % 37 == 3) scene.moves[scene.any_slot()] ^= 1;
    if (step % 41 == 2) {
      std::shuffle(scene.boxes.begin() + 2, scene.boxes.end(), scene.random);
      renumbered = true;
    }
    if (step % 43 == 4) {
      scene.boxes.pop_back();
      scene.moves.pop_back();
    }
    const auto pairs = replaced_pairs_of(*broad_phase, scene.input(renumbered));
    REQUIRE(pairs == scene.brute_force());
    REQUIRE(std::is_sorted(pairs.begin(), pairs.end()));
    REQUIRE(std::adjacent_find(pairs.begin(), pairs.end()) == pairs.end());
    most = std::max(most, pairs.size());
  }
  CHECK(most > 100);  // else the scene tests nothing
}

TEST_CASE("bodies that come and go where none has a usable box leave nothing behind") {
  const auto broad_phase = each_broad_phase();
  BoxesAndPlanes scene(20);
  REQUIRE(replaced_pairs_of(*broad_phase, scene.input()) == scene.brute_force());
  scene.boxes.assign(1, {});
  scene.moves.assign(1, 1);
  scene.planes.clear();
  for (const std::int64_t id : {100, 200, 300}) {
    BroadPhaseInput input = scene.input(true);
    input.ids = std::span(&id, 1);
    CHECK(replaced_pairs_of(*broad_phase, input).empty());
  }
}

TEST_CASE("the pairs do not depend on earlier calls") {
  BoxesAndPlanes scene(100);
  const auto old = each_broad_phase();
  for (int step = 0; step < 50; ++step) {
    scene.step();
    const auto expected = scene.brute_force();
    REQUIRE(replaced_pairs_of(*old, scene.input()) == expected);
  }
}

TEST_CASE("the broad phase bears no boxes, one box, and boxes that all vanish") {
  const auto broad_phase = each_broad_phase();
  std::vector<Aabb> boxes;
  std::vector<std::uint8_t> moves;
  const auto pairs = [&] { return replaced_pairs_of(*broad_phase, {boxes, moves, {}, false}); };
  for (int call = 0; call < 50; ++call) REQUIRE(pairs().empty());
  boxes = {kUnitBox};
  moves = {1};
  for (int call = 0; call < 50; ++call) REQUIRE(pairs().empty());
  boxes = {kUnitBox, kUnitBox};
  moves = {1, 1};
  for (int call = 0; call < 50; ++call) REQUIRE(pairs() == std::vector<BodyPair>{{0, 1}});
  boxes = {{}, {}};
  for (int call = 0; call < 50; ++call) REQUIRE(pairs().empty());
  boxes.clear();
  moves.clear();
  REQUIRE(pairs().empty());
}

TEST_CASE("boxes that touch are a pair, boxes one rounding apart are none") {
  const auto broad_phase = each_broad_phase();
  const Vector beside(1, 0, 0), off(std::nextafter(1.0, 2.0), 0, 0);
  const std::vector<std::uint8_t> moves{1, 1};
  std::vector<Aabb> boxes{kUnitBox, {beside, beside + Vector::Ones()}};
  CHECK(replaced_pairs_of(*broad_phase, {boxes, moves, {}, false}).size() == 1);
  boxes[1].lower = off;
  CHECK(replaced_pairs_of(*broad_phase, {boxes, moves, {}, false}).empty());
}

TEST_CASE("two slots that do not move are no pair, be they boxes or planes") {
  const auto broad_phase = each_broad_phase();
  const std::vector<Aabb> boxes{kUnitBox, kUnitBox, kUnitBox, {}};
  const std::vector<std::uint8_t> moves{0, 0, 1, 0};
  const std::vector<Plane> planes{{3, Vector::UnitZ(), 0}};
  const std::vector<BodyPair> expected{{0, 2}, {1, 2}, {2, 3}};
  CHECK(replaced_pairs_of(*broad_phase, {boxes, moves, planes, false}) == expected);
}

TEST_CASE("boxes that are not finite, or huge beyond measure, meet nothing") {
  const double huge = std::numeric_limits<double>::max();
  const Vector one = Vector::Ones();
  const std::vector<Aabb> bad{
      {one * -kInfinity, one * kInfinity}, {one * -huge, one * huge}, {one * kNan, one},
      {one * -1e154, one * 1e154},         {-one, one * kInfinity},
  };
  std::vector<Aabb> boxes{kUnitBox, kUnitBox, {}};
  boxes.insert(boxes.end(), bad.begin(), bad.end());
  const std::vector<std::uint8_t> moves(boxes.size(), 1);
  const std::vector<Plane> planes{{2, Vector::UnitZ(), 0}};
  const std::vector<BodyPair> expected{{0, 1}, {0, 2}, {1, 2}};
  const auto broad_phase = each_broad_phase();
  for (int call = 0; call < 50; ++call) {
    REQUIRE(replaced_pairs_of(*broad_phase, {boxes, moves, planes, false}) == expected);
  }
}
