// A rim beside the side of a cylinder or cone: every minimum is found, against sampling.
#include "server/collision/side_arc.h"

#include <catch2/catch.hpp>
#include <numbers>
#include <random>

using namespace cradle;

namespace {

constexpr int kSamples = 400;

/// The least of the local minima among samples; the ends count where the arc goes on as its mirror
/// image.
double least_of_minima(const SideArc& arc, double low, double high) {
  const double begin = std::acos(high), end = std::acos(low);
  const auto overlap = [&](int k) {
    const double angle = begin + (end - begin) * std::abs(k) / kSamples;
    return arc.overlap({std::cos(angle), std::sin(angle)});
  };
  double least = std::numeric_limits<double>::infinity();
  for (int k = high == 1 ? 0 : 1; k < (low == -1 ? kSamples + 1 : kSamples); ++k) {
    const int next = k == kSamples ? k - 1 : k + 1;
    const double here = overlap(k);
    if (here < overlap(k - 1) && here < overlap(next)) least = std::min(least, here);
  }
  return least;
}

}  // namespace

TEST_CASE("a rim beside a side: no minimum is missed, however nearly all is in one plane") {
  std::mt19937_64 engine(3);
  const auto uniform = [&](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(engine);
  };
  const auto length = [&] {  // often nothing, or nearly
    const double x = uniform(-1, 1);
    const std::array<double, 5> values = {0, 1e-16 * x, std::round(4 * x) / 4, x,
                                          x * std::pow(10, uniform(-12, 0))};
    return values[engine() % 5];
  };
  int found_two = 0, with_minimum = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    CAPTURE(trial);
    const double up = trial % 3 == 0 ? uniform(-0.9, 0.9) : 0;
    const double lean = trial % 2 == 0 ? uniform(0, std::numbers::pi) : length();
    const SideArc arc{length(), std::abs(length()), uniform(0.1, 1), up * std::cos(lean),
                      std::sqrt(1 - up * up) * std::abs(std::sin(lean))};
    const double low = trial % 5 == 0 ? uniform(-1, 0.4) : -1;
    const double high = trial % 5 == 1 ? uniform(-0.4, 1) : 1;
    CAPTURE(arc.d_u, arc.d_e, arc.r, arc.from, arc.turn, low, high);
    std::array<HalfAngle, 2> found;
    const std::size_t count = arc.minima(low, high, found);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < count; ++k) {
      const auto& [c, s] = found[k];
      REQUIRE(std::abs(c * c + s * s - 1) < 1e-12);
      REQUIRE(c >= low - 1e-12);
      REQUIRE(c <= high + 1e-12);
      least = std::min(least, arc.overlap(found[k]));
    }
    const double sampled = least_of_minima(arc, low, high);
    REQUIRE(least <= sampled + 1e-9);
    found_two += count == 2;
    with_minimum += std::isfinite(sampled);
  }
  CHECK(found_two > 1000);
  CHECK(with_minimum > 15000);
}
