#include "server/collision/in_order.h"

#include <catch2/catch.hpp>
#include <random>
#include <vector>

#include "server/thread_pool.h"

using namespace cradle;

namespace {

TEST_CASE("lists made side by side are in the order of what they are made of", "[collision]") {
  std::mt19937 random(7);
  ThreadPool pool(3);
  InOrder in_order;
  for (const std::size_t count : {0u, 1u, 255u, 256u, 257u, 3000u, 100u}) {
    std::vector<std::uint8_t> numbers(count);  // of entries for each
    for (std::uint8_t& number : numbers) number = static_cast<std::uint8_t>(random() % 3);
    std::vector<std::size_t> expected;
    for (std::size_t k = 0; k < count; ++k) expected.insert(expected.end(), numbers[k], k);
    std::vector<std::size_t> made(5000, 1);
    const auto number = [&](std::size_t begin, std::size_t end) {
      std::size_t sum = 0;
      for (std::size_t k = begin; k < end; ++k) sum += numbers[k];
      return sum;
    };
    const auto write = [&](std::size_t begin, std::size_t end, std::size_t to) {
      for (std::size_t k = begin; k < end; ++k) {
        for (int n = 0; n < numbers[k]; ++n) made[to++] = k;
      }
    };
    const auto room = [&](std::size_t entries) { made.resize(entries); };
    in_order.list(pool, count, number, room, write);
    CHECK(made == expected);
  }
}

TEST_CASE("marked indices are seen once each, in order", "[collision]") {
  std::mt19937 random(11);
  for (const std::size_t count : {0u, 1u, 256u, 257u, 1000u}) {
    for (const unsigned one_in : {1u, 2u, 50u}) {
      std::vector<std::uint8_t> marks(count);
      for (std::uint8_t& mark : marks) mark = random() % one_in == 0 ? 1 : 0;
      std::vector<std::size_t> expected, seen;
      for (std::size_t k = 0; k < count; ++k) {
        if (marks[k] != 0) expected.push_back(k);
      }
      for_all_marked(marks, [&](std::size_t k) { seen.push_back(k); });
      CHECK(seen == expected);
    }
  }
}

}  // namespace
