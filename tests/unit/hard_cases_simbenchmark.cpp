// Hard cases P21 to P24, at default settings: SimBenchmark's scenes, which the benchmark has as S1
// to S4, against what SimBenchmark has published (github.com/leggedrobotics/SimBenchmark).
#include <catch2/catch.hpp>

#include "tests/bench/run.h"

namespace cradle::bench {
namespace {

double error_of_case(std::string_view name, double dt_s, std::optional<int> sub_steps = {}) {
  Options options;
  options.dt_s = dt_s;
  options.sub_steps = sub_steps;
  return run(*find_case(name), options).error;
}

}  // namespace

TEST_CASE("P21: 49 elastic spheres bounce for 20 s and keep their energy") {
  // The mean square of the energy's change, J^2. ODE has 1.9e4 at 10 ms and 185 at 1 ms, RaiSim 186
  // and 1.9e-2; 1e-6 is asked of an accurate mode.
  CHECK(error_of_case("S2", 1e-2) < 1e-6);
  CHECK(error_of_case("S2", 1e-3) < 1e-6);
}

TEST_CASE("P22: 216 spheres fall and come to rest") {
  // The mean sum of squared overlaps, m^2. ODE has 0.016 at 10 ms and 1.5e-4 at 1 ms.
  CHECK(error_of_case("S3", 1e-2) <= 0.016);
  CHECK(error_of_case("S3", 1e-3) <= 1.5e-4);
}

TEST_CASE("P23: 216 elastic spheres fall and keep their energy") {
  // As P21. ODE has 112 at 1 ms; from 10 ms on all that were measured have 5e6 or more.
  CHECK(error_of_case("S4", 1e-3) <= 112);
  CHECK(error_of_case("S4", 1e-1) < 1e12);  // a number, that is
}

TEST_CASE("P24: a box is pushed from under 25 spheres, in two directions") {
  // The mean square of the velocities' error, (m/s)^2; 1e-8 is asked for, 6e-10 is left of the
  // first milliseconds, until all contacts carry.
  for (const std::string_view name : {"S1", "S1t"}) {
    CAPTURE(name);
    CHECK(error_of_case(name, 1e-3) < 1e-8);
  }
}

}  // namespace cradle::bench
