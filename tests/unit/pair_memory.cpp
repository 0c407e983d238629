// Where pairs keep what they remember, while others come, go, sleep and wake.
#include "server/world/pair_memory.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <numeric>
#include <random>
#include <string>
#include <type_traits>

namespace cradle {
namespace {

constexpr int kBodies = 24;

/// Lists of places, by name.
std::map<std::string, std::vector<std::int32_t>> places_of(PairMemory& memory) {
  std::map<std::string, std::vector<std::int32_t>> places;
  memory.for_each_array([&](const char* name, const auto& values) {
    if constexpr (std::is_same_v<std::decay_t<decltype(values)>, std::vector<std::int32_t>>) {
      places[name] = values;
    }
  });
  return places;
}

/// A third of them touches by faces, others have no corners or are closed forms.
std::vector<Shape> shapes() {
  std::vector<Shape> all;
  for (int i = 0; i < kBodies; ++i) {
    const Shape kinds[] = {Shape::box({0.5, 0.5, 0.5}), Shape::sphere(0.5),
                           Shape::cylinder(0.5, 0.5)};
    all.push_back(kinds[i % 3]);
  }
  return all;
}

}  // namespace

TEST_CASE("each pair keeps a place of its own, whoever comes, goes, sleeps or wakes") {
  std::mt19937_64 random(1);
  const auto chance = [&random](int one_in) {
    return random() % static_cast<unsigned>(one_in) == 0;
  };
  PairMemory memory;
  SerialExecutor here;
  const std::vector<Shape> bodies = shapes();
  std::vector<std::int64_t> ids(kBodies);
  std::iota(ids.begin(), ids.end(), 1);
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> places;  // of pairs that are kept
  std::vector<BodyPair> pairs, asleep;
  int new_pairs = 0, kept_pairs = 0, woken_pairs = 0;
  for (int tick = 0; tick < 300; ++tick) {
    const auto woken = static_cast<std::int32_t>(random() % kBodies);
    memory.take_up(std::array{ids[static_cast<std::size_t>(woken)]});
    std::erase_if(asleep, [&](const BodyPair& pair) {
      const bool wakes = pair.a == woken || pair.b == woken;
      woken_pairs += wakes ? 1 : 0;
      return wakes;
    });
    const auto sleeps = [&](std::int32_t a, std::int32_t b) {
      return std::ranges::any_of(asleep,
                                 [&](const BodyPair& pair) { return pair.a == a && pair.b == b; });
    };
    pairs.clear();
    for (std::int32_t a = 0; a < kBodies; ++a) {
      for (std::int32_t b = a + 1; b < kBodies; ++b) {
        const bool was_there = places.contains({a, b});
        if (!sleeps(a, b) && (was_there ? !chance(9) : chance(20))) pairs.push_back({a, b});
      }
    }
    memory.follow(here, pairs, ids, bodies);

    auto lists = places_of(memory);
    const std::vector<std::int32_t> now = lists.at("places of kept pairs");
    REQUIRE(now.size() == pairs.size());
    REQUIRE(lists.at("places of pairs put by").size() == asleep.size());
    std::vector<std::int32_t> all;
    for (const auto& [name, list] : lists) all.insert(all.end(), list.begin(), list.end());
    std::ranges::sort(all);
    for (std::size_t k = 0; k < all.size(); ++k) REQUIRE(all[k] == static_cast<std::int32_t>(k));

    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> places_now;
    for (const BodyPair& pair : asleep) places_now[{pair.a, pair.b}] = places.at({pair.a, pair.b});
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const auto [a, b] = pairs[k];
      const auto before = places.find({a, b});
      places_now[{a, b}] = now[k];
      const ShapeKind A = bodies[static_cast<std::size_t>(a)].kind,
                      B = bodies[static_cast<std::size_t>(b)].kind;
      const bool is_worth_it = is_worth_keeping(A, B);
      if (before != places.end()) {
        ++kept_pairs;
        CHECK(now[k] == before->second);
        CHECK(memory.choice(k) == (is_worth_it ? 7u : 0u));
        continue;
      }
      ++new_pairs;
      CHECK(memory.choice(k) == 0);
      CHECK(memory.was_apart(k));
      CHECK(!memory.was_held(k));
      CHECK(!memory.is_slow(k));
      if (memory.begins_at_axis(k)) CHECK(memory.axis_A(k).isZero(0));
    }
    places = places_now;
    for (std::size_t k = 0; k < pairs.size(); ++k) {  // something to remember
      Manifold made;
      made.count = 1;
      made.points[0] = {Vector::Zero(), 0, 1};
      made.choice = 7;
      memory.holds(k, {}, {}, 0, 1, 0);
      memory.keep(k, {}, {}, 1, made);
    }
    for (const BodyPair& pair : pairs) {
      if (chance(30)) asleep.push_back(pair);
    }
    memory.put_by([&](std::int64_t a, std::int64_t b) {
      return sleeps(static_cast<std::int32_t>(a - 1), static_cast<std::int32_t>(b - 1));
    });
  }
  CHECK(new_pairs > 1000);
  CHECK(kept_pairs > 1000);
  CHECK(woken_pairs > 100);
}

}  // namespace cradle
