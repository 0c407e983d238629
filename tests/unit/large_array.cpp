#include "server/collision/large_array.h"

#include <catch2/catch.hpp>
#include <cstdint>
#include <fstream>
#include <numeric>
#include <string>

using namespace cradle;

namespace {

constexpr std::size_t kPage = LargePages<int>::kPage;

bool begins_a_page(const void* p) { return reinterpret_cast<std::uintptr_t>(p) % kPage == 0; }

/// The flags of the mapping that `p` is in, as Linux tells them; empty: it does not.
std::string flags_at(const void* p) {
  const auto at = reinterpret_cast<std::uintptr_t>(p);
  std::ifstream maps("/proc/self/smaps");
  bool is_here = false;
  for (std::string line; std::getline(maps, line);) {
    unsigned long long begin = 0, end = 0;
    if (std::sscanf(line.c_str(), "%llx-%llx ", &begin, &end) == 2) {
      is_here = begin <= at && at < end;
    }
    if (is_here && line.starts_with("VmFlags:")) return line + ' ';
  }
  return {};
}

}  // namespace

TEST_CASE("an array of megabytes lies in large pages, a small one where any does") {
  LargeArray<std::int64_t> numbers(10);
  std::iota(numbers.begin(), numbers.end(), 0);
  const std::size_t many = 3 * kPage / sizeof(std::int64_t) / 2;
  numbers.resize(many);
  CHECK(begins_a_page(numbers.data()));
  for (std::int64_t k = 0; k < 10; ++k) CHECK(numbers[static_cast<std::size_t>(k)] == k);
  CHECK(numbers.back() == 0);
  const std::string flags = flags_at(numbers.data());
  const bool has_large_pages =
      std::ifstream("/sys/kernel/mm/transparent_hugepage/enabled").good() && !flags.empty();
  if (has_large_pages) CHECK(flags.find(" hg ") != std::string::npos);

  struct alignas(64) Line {
    double numbers[8];
  };
  const LargeArray<Line> lines(3);
  CHECK(reinterpret_cast<std::uintptr_t>(lines.data()) % alignof(Line) == 0);
}
