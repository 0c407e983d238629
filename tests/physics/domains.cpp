// Who may be solved side by side: domains, and colours.
#include "server/dynamics/contact/domains.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <set>

#include "server/dynamics/contact/colouring.h"
#include "tests/physics/flock.h"

namespace cradle {
namespace {

/// Bodies of islands of these sizes, mixed, each island in a box of its own.
struct Crowd {
  std::vector<std::int32_t> slots, islands;
  std::vector<int> sizes;
  std::vector<Vector> x;

  Crowd(const std::vector<int>& sizes_of_islands, std::uint64_t seed) : sizes(sizes_of_islands) {
    for (std::size_t island = 0; island < sizes.size(); ++island) {
      std::mt19937_64 random(seed + island);  // the same wherever else there is
      for (int k = 0; k < sizes[island]; ++k) {
        islands.push_back(static_cast<std::int32_t>(island));
        const double far = 1000 * static_cast<double>(island);
        x.push_back(random_vector(random, 10).cwiseProduct(Vector(3, 1, 0.3)) + Vector(far, 0, 0));
      }
    }
    std::vector<std::size_t> order(islands.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    std::shuffle(order.begin(), order.end(), std::mt19937_64(seed));
    std::vector<std::int32_t> mixed;
    for (const std::size_t k : order) {
      slots.push_back(static_cast<std::int32_t>(k));
      mixed.push_back(islands[k]);
    }
    islands = mixed;
  }

  /// One island of these bodies, and, if there is a place for it, one of a body before them.
  explicit Crowd(const std::vector<Vector>& at, const std::optional<Vector>& first = {})
      : sizes{static_cast<int>(at.size())}, x(at) {
    islands.assign(at.size(), 0);
    for (std::size_t k = 0; k < at.size(); ++k) slots.push_back(static_cast<std::int32_t>(k));
    if (!first) return;
    x.push_back(*first);
    slots.insert(slots.begin(), static_cast<std::int32_t>(at.size()));
    islands.insert(islands.begin(), 1);
    sizes.push_back(1);
  }
};

/// The slots of each domain, of one island.
std::vector<std::set<std::int32_t>> domains_of(const Crowd& crowd, std::int32_t island) {
  Domains domains;
  domains.find(crowd.slots, crowd.islands, crowd.sizes, crowd.x);
  std::vector<std::int32_t> slots = crowd.slots, of_islands = crowd.islands, room;
  domains.sort(std::span(slots), room);
  domains.sort(std::span(of_islands), room);
  std::map<std::int32_t, std::set<std::int32_t>> found;
  for (std::size_t k = 0; k < slots.size(); ++k) {
    const std::int32_t domain = domains.count() == 1 ? 0 : domains.by_place()[k];
    if (of_islands[k] == island) found[domain].insert(slots[k]);
  }
  std::vector<std::set<std::int32_t>> all;
  for (const auto& [domain, members] : found) all.push_back(members);
  return all;
}

/// Of numbers that share a subtree of so many levels.
std::int32_t subtree(std::int32_t domain, std::size_t level) {
  return domain / (std::int32_t{1} << level);
}

}  // namespace

TEST_CASE("a subtree has both domains, and no smaller one has") {
  for (const std::size_t count : std::array<std::size_t, 8>{1, 2, 3, 4, 7, 8, 13, 64}) {
    CAPTURE(count);
    const TaskTree tree(count);
    for (std::int32_t a = 0; a < static_cast<std::int32_t>(count); ++a) {
      for (std::int32_t b = 0; b < static_cast<std::int32_t>(count); ++b) {
        const std::int32_t task = tree.of(a, b);
        std::size_t level = 0;
        while (subtree(a, level) != subtree(b, level)) ++level;
        REQUIRE(level < tree.levels());
        CHECK(task == tree.begin(level) + subtree(a, level));
        CHECK(task < tree.end(level));
      }
    }
    CHECK(tree.begin(0) == 0);
    CHECK(tree.end(0) == static_cast<std::int32_t>(count));
    CHECK(tree.end(tree.levels() - 1) == static_cast<std::int32_t>(tree.tasks()));
  }
}

TEST_CASE("large islands are halved where their bodies are, small ones stay whole") {
  const std::vector<int> sizes{50, 900, 3300, 799, 10};
  const Crowd crowd(sizes, 1);
  Domains domains;
  domains.find(crowd.slots, crowd.islands, crowd.sizes, crowd.x);
  // 4 of the third, 2 of the second; and of the three small ones 799 + 50 or 10 and the rest.
  CHECK(domains.count() >= 7);
  CHECK(domains.count() <= 9);
  CHECK(std::ranges::is_sorted(domains.by_place()));
  for (std::size_t island = 0; island < sizes.size(); ++island) {
    CAPTURE(island);
    const auto parts = domains_of(crowd, static_cast<std::int32_t>(island));
    CHECK(parts.size() == (sizes[island] == 3300 ? 4u : sizes[island] == 900 ? 2u : 1u));
    std::size_t sum = 0;
    for (const auto& part : parts) {
      CHECK(static_cast<double>(part.size() * parts.size()) > 0.8 * sizes[island]);
      sum += part.size();
    }
    CHECK(sum == static_cast<std::size_t>(sizes[island]));
  }
  // Along x, where they lie farthest apart.
  const auto halves = domains_of(crowd, 1);
  REQUIRE(halves.size() == 2);
  double last = -1e9, first = 1e9;
  for (const std::int32_t slot : halves[0]) {
    last = std::max(last, crowd.x[static_cast<std::size_t>(slot)].x());
  }
  for (const std::int32_t slot : halves[1]) {
    first = std::min(first, crowd.x[static_cast<std::size_t>(slot)].x());
  }
  CHECK(last < first);
}

TEST_CASE("an island is divided in the same way whatever others there are") {
  const auto alone = domains_of(Crowd({1000}, 7), 0);
  CHECK(alone.size() == 2);
  CHECK(domains_of(Crowd({1000, 5000, 30}, 7), 0) == alone);
  CHECK(domains_of(Crowd({1000, 3, 800, 200, 12000}, 7), 0) == alone);
}

TEST_CASE("so are grids and walls, whose bodies lie in the middle of them, too") {
  // Where the sums are rounded otherwise, a middle row goes to the other half, or the other axis is
  // the longer one.
  const auto grid = [](int nx, int ny, int nz) {
    std::vector<Vector> x;
    for (int i = 0; i < nx * ny * nz; ++i) {
      x.push_back(0.4 * Vector(i % nx, i / nx % ny, i / nx / ny));
    }
    return x;
  };
  for (const std::vector<Vector>& x :
       {grid(31, 31, 1), grid(10, 10, 10), grid(41, 1, 21), grid(60, 60, 1)}) {
    const int size = static_cast<int>(x.size());
    const auto alone = domains_of(Crowd(x), 0);
    CHECK(alone.size() == (size < 3200 ? 2 : 4));
    for (const Vector& first :
         {Vector(50.3, 7.7, 0.35), Vector(-1e5, 3e4, 17), Vector(1e-3, 0.7, -2.2)}) {
      CAPTURE(size, first.transpose());
      CHECK(domains_of(Crowd(x, first), 0) == alone);
    }
  }
}

TEST_CASE("bodies that cannot be told apart, or have no place, are in some domain") {
  constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
  std::vector<Vector> x(1000, Vector(3, 4, 5));
  Domains domains;
  for (const double last : {5.0, kNowhere, std::numeric_limits<double>::infinity()}) {
    x.back().z() = last;
    const Crowd crowd(x);
    domains.find(crowd.slots, crowd.islands, crowd.sizes, crowd.x);
    CHECK(domains.count() == 2);
    CHECK(std::ranges::is_sorted(domains.by_place()));
    CHECK(domains.by_place().size() == x.size());
    std::vector<std::int32_t> slots = crowd.slots, room;
    domains.sort(std::span(slots), room);
    std::ranges::sort(slots);
    CHECK(slots == crowd.slots);
  }
}

TEST_CASE("a crowd too small to divide is one domain, in the order that it has") {
  const Crowd crowd({300, 400}, 3);
  Domains domains;
  domains.find(crowd.slots, crowd.islands, crowd.sizes, crowd.x);
  CHECK(domains.count() == 1);
  std::vector<std::int32_t> slots = crowd.slots, room;
  domains.sort(std::span(slots), room);
  CHECK(slots == crowd.slots);
}

TEST_CASE("a body with more contacts than there are colours has them one after another") {
  std::vector<ColouredPair> pairs;
  for (std::int32_t k = 0; k < 80; ++k) pairs.push_back({0, k + 1});
  pairs.push_back({7, 99});
  Colouring colouring;
  std::vector<std::uint8_t> colours(pairs.size());
  colouring.begin(100);
  CHECK(colouring.colour(pairs, colours) == kColours + 1);
  for (int k = 0; k < 80; ++k) {
    CHECK(colours[static_cast<std::size_t>(k)] == std::min(k, kColours));
  }
  CHECK(colours[80] == 0);  // what another pair has taken at body 7 is colour 6
}

}  // namespace cradle
