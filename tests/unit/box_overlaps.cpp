// Boxes of a grid beside one: at every width the same ones as one by one.
#include <catch2/catch.hpp>
#include <random>
#include <vector>

#include "server/collision/box_grid.h"
#include "server/collision/box_kernels.h"
#include "server/collision/machine_lanes.h"

namespace cradle {
namespace {

constexpr std::size_t kBoxes = 300;

/// Columns, with room behind.
struct Columns {
  std::size_t stride = kBoxes + kGridLanes;
  std::vector<float> bounds = std::vector<float>(6 * (kBoxes + kGridLanes));

  float& lower(std::size_t axis, std::size_t box) { return bounds[axis * stride + box]; }
  float& upper(std::size_t axis, std::size_t box) { return bounds[(3 + axis) * stride + box]; }
  bool overlap(std::size_t a, std::size_t b) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (lower(k, a) > upper(k, b) || lower(k, b) > upper(k, a)) return false;
    }
    return true;
  }
};

/// On whole numbers, so that many only just touch.
Columns random_boxes(std::mt19937& random) {
  std::uniform_int_distribution<int> corner(0, 12), size(0, 4);
  Columns boxes;
  for (std::size_t box = 0; box < kBoxes; ++box) {
    for (std::size_t k = 0; k < 3; ++k) {
      boxes.lower(k, box) = static_cast<float>(corner(random));
      boxes.upper(k, box) = boxes.lower(k, box) + static_cast<float>(size(random));
    }
  }
  return boxes;
}

}  // namespace

TEST_CASE("boxes that overlap one are found in order, at every width, in ranges of any length") {
  std::mt19937 random(5);
  Columns boxes = random_boxes(random);
  std::uniform_int_distribution<std::uint32_t> place(0, kBoxes), length(0, 40);
  std::size_t hits = 0;
  for (int round = 0; round < 300; ++round) {
    const std::uint32_t box = place(random) % kBoxes;
    std::vector<GridRange> ranges(1 + static_cast<std::size_t>(round % 9));
    std::vector<std::uint32_t> expected;
    std::size_t room = kGridLanes;
    for (GridRange& range : ranges) {
      range.begin = place(random);  // some are empty, some end with the last box
      range.end = std::min<std::uint32_t>(kBoxes, range.begin + length(random));
      room += range.end - range.begin;
      for (std::uint32_t k = range.begin; k < range.end; ++k) {
        if (boxes.overlap(box, k)) expected.push_back(k);
      }
    }
    hits += expected.size();
    for (const int lanes : machine_lanes()) {
      std::vector<std::uint32_t> found(room);
      found.resize(box_kernels_of(lanes).find_overlaps({boxes.bounds.data(), boxes.stride}, box,
                                                       ranges.data(), ranges.size(), found.data()));
      CAPTURE(round, lanes);
      CHECK(found == expected);
    }
  }
  CHECK(hits > 1000);
}

TEST_CASE("a grid finds all pairs of a cell with more boxes than are looked at together") {
  constexpr std::int32_t kCrowd = 700, kOthers = 30'000, kInRow = 200;
  std::mt19937 random(6);
  std::uniform_real_distribution<float> place(0, 1);
  std::vector<FloatBox> boxes;
  std::vector<std::int32_t> slots;
  const auto add = [&](float x, float y, float z, float size) {
    slots.push_back(static_cast<std::int32_t>(slots.size()));
    boxes.push_back({{x, y, z, 0}, {x + size, y + size, z + size, 0}});
  };
  for (std::int32_t k = 0; k < kCrowd; ++k) add(place(random), place(random), place(random), 0.5F);
  for (std::int32_t k = 0; k < kOthers; ++k) {
    add(static_cast<float>(2 * (k % kInRow)), static_cast<float>(2 * (k / kInRow)), 5, 1);
  }
  BoxGrid grid;
  REQUIRE(grid.build(boxes, slots));
  std::vector<int> found(boxes.size(), 0), expected(boxes.size(), 0);
  grid.join(0, grid.boxes(), [&](std::int32_t a, std::int32_t b) {
    ++found[static_cast<std::size_t>(a)];
    ++found[static_cast<std::size_t>(b)];
    return true;
  });
  for (std::size_t a = 0; a < kCrowd; ++a) {
    for (std::size_t b = a + 1; b < kCrowd; ++b) {
      bool overlap = true;
      for (std::size_t k = 0; k < 3; ++k) {
        overlap &= boxes[a].lower[k] <= boxes[b].upper[k] && boxes[b].lower[k] <= boxes[a].upper[k];
      }
      expected[a] += overlap ? 1 : 0;
      expected[b] += overlap ? 1 : 0;
    }
  }
  CHECK(found == expected);
}

}  // namespace cradle
