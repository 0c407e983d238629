#include "server/large_pages.h"

#include <malloc.h>
#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

using namespace cradle;

namespace {

constexpr std::size_t kLarge = std::size_t{1} << 21;

/// The flags of the mapping that `p` is in, as Linux tells them; empty: it does not.
std::string flags_at(std::uintptr_t p) {
  std::ifstream maps("/proc/self/smaps");
  bool is_here = false;
  for (std::string line; std::getline(maps, line);) {
    unsigned long long begin = 0, end = 0;
    if (std::sscanf(line.c_str(), "%llx-%llx ", &begin, &end) == 2) is_here = begin <= p && p < end;
    if (is_here && line.starts_with("VmFlags:")) return line + ' ';
  }
  return {};
}

std::uintptr_t place_of(const std::vector<char>& bytes) {
  return reinterpret_cast<std::uintptr_t>(bytes.data());
}
/// Where an array of so many bytes lies, which is gone again.
std::uintptr_t place_of(std::size_t size) { return place_of(std::vector<char>(size, 1)); }

long page_faults() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt;
}

}  // namespace

TEST_CASE("nobody waits for a page of memory that was taken") {
  if (mallinfo2().arena == 0) return;  // a sanitizer's allocator
  keep_memory_in_large_pages();
  REQUIRE(take_memory(32 * kLarge));
  const long before = page_faults();
  std::vector<char> array;
  for (std::size_t size = 1; size <= 8 * kLarge; size *= 2) array.resize(size, 1);
  CHECK(page_faults() - before < 4);  // 8 of large pages, thousands of small ones
}

TEST_CASE("memory that there is not is not taken") {
  if (mallinfo2().arena == 0) return;  // a sanitizer's allocator
  CHECK(!take_memory(std::size_t{1} << 62));
}

TEST_CASE("memory stays, in large pages, whatever an array's size") {
  if (mallinfo2().arena == 0) return;  // a sanitizer's allocator
  keep_memory_in_large_pages();
  const std::uintptr_t first = place_of(3 * kLarge);
  CHECK(place_of(3 * kLarge) == first);
  CHECK(place_of(5 * kLarge) == first);
  const bool has_large_pages =
      std::ifstream("/sys/kernel/mm/transparent_hugepage/enabled").good() &&
      !flags_at(first).empty();
  if (!has_large_pages) return;
  CHECK(flags_at(place_of(40 * kLarge) + 20 * kLarge).find(" hg ") != std::string::npos);
  // Small ones, too, once there is no room left between what was there before.
  const std::vector<std::vector<char>> arrays(64, std::vector<char>(kLarge / 16, 1));
  CHECK(flags_at(place_of(arrays.back())).find(" hg ") != std::string::npos);
}
