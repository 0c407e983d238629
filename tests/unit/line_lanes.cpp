// Lines of bodies to lanes of floats and back: at each width what one number at a time gives, also
// at those that this machine's kernels do not have.
#include "server/dynamics/contact/line_lanes.h"

#include <catch2/catch.hpp>
#include <random>
#include <vector>

namespace cradle {
namespace {

template <int lanes>
struct Floats {
  typedef float Type __attribute__((vector_size(lanes * sizeof(float))));
};
using Four = Floats<4>;
using Eight = Floats<8>;
using Sixteen = Floats<16>;

constexpr std::size_t kLines = 40;

/// More than a float can tell apart.
std::vector<BodyLine> random_lines() {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-10, 10);
  std::vector<BodyLine> lines(kLines);
  for (BodyLine& line : lines) {
    for (double& x : line.all) x = number(random);
  }
  return lines;
}

/// Each lane's own, and none that follows the one before.
std::size_t line_of(int lane) { return (7 * static_cast<std::size_t>(lane) + 3) % kLines; }

}  // namespace

TEMPLATE_TEST_CASE("a line's numbers come to its lane", "", Four, Eight, Sixteen) {
  using V = typename TestType::Type;
  const std::vector<BodyLine> lines = random_lines();
  const auto from = [&](int l) { return lines[line_of(l)].all; };
  V rows[kLineNumbers], upper[4];
  load_line_rows(rows, from);
  load_four_rows(upper, [&](int l) { return from(l) + 4; });
  for (int k = 0; k < kLineNumbers; ++k) {
    for (int l = 0; l < kLanes<V>; ++l) {
      CAPTURE(k, l);
      CHECK(rows[k][l] == static_cast<float>(from(l)[k]));
      if (k >= 4) CHECK(upper[k - 4][l] == rows[k][l]);
    }
  }
}

TEMPLATE_TEST_CASE("a lane's numbers go to its line", "", Four, Eight, Sixteen) {
  using V = typename TestType::Type;
  V rows[4];
  for (int k = 0; k < 4; ++k) {
    for (int l = 0; l < kLanes<V>; ++l) rows[k][l] = static_cast<float>(100 * l + k);
  }
  std::vector<BodyLine> lines = random_lines();
  const std::vector<BodyLine> before = lines;
  std::vector<int> times(kLines, 0);
  put_four_rows(rows, [&](int l, const FourFloats& four) {
    ++times[line_of(l)];
    store_four(lines[line_of(l)].all + 2, four);
  });
  for (int l = 0; l < kLanes<V>; ++l) {
    CHECK(times[line_of(l)] == 1);
    for (int k = 0; k < kLineNumbers; ++k) {
      const bool is_put = k >= 2 && k < 6;
      CHECK(lines[line_of(l)].all[k] == (is_put ? 100 * l + k - 2 : before[line_of(l)].all[k]));
    }
  }
}

TEMPLATE_TEST_CASE("a line changes by its lane's numbers, and not at all by zeros", "", Four, Eight,
                   Sixteen) {
  using V = typename TestType::Type;
  std::vector<BodyLine> lines = random_lines();
  const std::vector<BodyLine> before = lines;
  V rows[kLineNumbers];
  for (int k = 0; k < kLineNumbers; ++k) {
    for (int l = 0; l < kLanes<V>; ++l) {
      rows[k][l] = l % 3 == 0 ? 0 : 1e-3f * static_cast<float>(10 * l + k + 1);
    }
  }
  V by[kLineNumbers];
  std::copy_n(rows, kLineNumbers, by);
  change_line_rows(by, [&](int l) { return lines[line_of(l)].all; });
  for (int l = 0; l < kLanes<V>; ++l) {
    for (int k = 0; k < kLineNumbers; ++k) {
      CAPTURE(k, l);
      CHECK(lines[line_of(l)].all[k] == before[line_of(l)].all[k] + double{rows[k][l]});
    }
  }
}

}  // namespace cradle
