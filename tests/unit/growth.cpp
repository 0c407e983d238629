// The rows of the benchmark that tell how cost grows: their scenes, their exponents.
#include "tests/bench/growth.h"

#include <malloc.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/bench/cases.h"
#include "tests/bench/run.h"

using namespace cradle;
using namespace cradle::bench;

namespace {

const GrowthCase& growth_case(std::string_view name) {
  return *std::ranges::find(growth_cases(), name, &GrowthCase::name);
}

double distance_m(const BodySpec& one, const BodySpec& other) {
  const Vec3 &a = one.p_WBo, &b = other.p_WBo;
  return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z);
}

}  // namespace

TEST_CASE("growth: scenes of the table's own number are the scenes of the table") {
  const Scene pile = growth_case("growth:T2").scene(2000), pile_there = scene_of(*find_case("T2"));
  REQUIRE(pile.bodies.size() == pile_there.bodies.size());
  for (std::size_t i = 1; i < pile.bodies.size(); ++i) {  // 0: the floor, which only is larger
    REQUIRE(pile.bodies[i] == pile_there.bodies[i]);
  }
  const Scene gas = growth_case("growth:T1").scene(10'000), gas_there = scene_of(*find_case("T1"));
  REQUIRE(gas.bodies.size() == gas_there.bodies.size());
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(distance_m(gas.bodies[i], gas_there.bodies[i]) < 1e-9);
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(gas.bodies[i].shape.parameters[k] ==
            Approx(gas_there.bodies[i].shape.parameters[k]).epsilon(1e-12));
    }
  }
  for (std::size_t i = 6; i < gas.bodies.size(); ++i) {
    REQUIRE(distance_m(gas.bodies[i], gas_there.bodies[i]) < 1e-9);
  }
}

TEST_CASE("growth: all that move are inside the walls, as many as asked for, at one density") {
  for (const GrowthCase& one : growth_cases()) {
    if (one.name == "growth:T4") continue;
    for (const int number : one.numbers) {
      const Scene scene = one.scene(number);
      INFO(one.name << " " << number);
      double x_max = 0, y_max = 0;
      int dynamic = 0;
      std::array<double, 2> inside{0, 0};  // half the room
      for (const BodySpec& b : scene.bodies) {
        if (b.kind != BodyKind::dynamic) {
          if (b.p_WBo.x > 0) inside[0] = b.p_WBo.x - b.shape.parameters[0];
          if (b.p_WBo.y > 0) inside[1] = b.p_WBo.y - b.shape.parameters[1];
          continue;
        }
        ++dynamic;
        x_max = std::max(x_max, std::abs(b.p_WBo.x));
        y_max = std::max(y_max, std::abs(b.p_WBo.y));
      }
      CHECK(dynamic == number);
      CHECK(x_max + 0.5 < inside[0]);
      CHECK(y_max + 0.5 < inside[1]);
      // 3 x 3 m for each column of twenty; 37.4 m for ten thousand.
      const double room = one.name == "growth:T2" ? 4 * inside[0] * inside[1] / 9 * 20
                                                  : 1e4 * std::pow(inside[0] / 18.7, 3);
      CHECK(room == Approx(number).epsilon(1e-9));
    }
  }
}

TEST_CASE("growth: an exponent is that of a power law, and a row counts work and memory") {
  const std::array<double, 3> x{10, 100, 1000}, y{3, 30 * std::sqrt(10), 3000};
  CHECK(exponent(x, std::array<double, 3>{2, 20, 200}) == Approx(1));
  CHECK(exponent(x, y) == Approx(1.5).epsilon(1e-12));
  GrowthCase small = growth_case("growth:T2");
  small.ticks = 3;
  const GrowthRow row = run(small, 1000);
  CHECK(row.work > 1000);
  if (mallinfo2().uordblks > 0) {  // a sanitizer's allocator does not tell
    CHECK(row.bytes / 1000 > 500);
    CHECK(row.bytes / 1000 < 1e5);
  }
  const std::array rows{row};
  CHECK(growth_line(Format::csv, small, rows).ends_with(",,\n"));
}
