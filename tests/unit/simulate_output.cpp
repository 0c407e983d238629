// The lines that `cradled simulate` writes, and its figures of time.
#include <catch2/catch.hpp>
#include <limits>

#include "server/trace.h"

namespace cradle {

TEST_CASE("a line of a trace has every digit of every number, in the order of its header") {
  BodyState state;
  state.p_WBo = {1.0 / 3, 2, 3};
  state.q_WB = {4, 5, 6, 7};
  state.v_WBcm = {8, 9, 10};
  state.w_WB = {11, 12, -0.1};
  CHECK(trace_line(6, 0.1, "ball", state) ==
        "6,0.10000000000000001,ball,0.33333333333333331,2,3,4,5,6,7,8,9,10,11,12,"
        "-0.10000000000000001\n");
  CHECK(std::string(kTraceHeader) == "tick,time_s,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n");
}

TEST_CASE("names that CSV would misread are quoted as RFC 4180 says") {
  CHECK(csv_field("plain name") == "plain name");
  CHECK(csv_field("a,b") == "\"a,b\"");
  CHECK(csv_field("the \"big\" one") == "\"the \"\"big\"\" one\"");
}

TEST_CASE("a summary is JSON whatever its strings and numbers are") {
  Summary summary;
  summary.scene = "a\"b\\c\nd";
  summary.totals.kinetic_energy_J = std::numeric_limits<double>::quiet_NaN();
  summary.totals.momentum_Ns = {1, -2, std::numeric_limits<double>::infinity()};
  summary.hash = {0, 1, 0x7f, 0x80, 0xff, 16, 15, 9};
  const std::string json = to_json(summary);
  using Catch::Matchers::Contains;
  CHECK_THAT(json, Contains(R"("scene": "a\"b\\c\u000ad")"));
  CHECK_THAT(json, Contains(R"("kinetic_energy_J": null)"));
  CHECK_THAT(json, Contains(R"("momentum_Ns": [1, -2, null])"));
  CHECK_THAT(json, Contains(R"("hash": "00017f80ff100f09")"));
}

TEST_CASE("median and 99th percentile of tick times are by nearest rank") {
  std::vector<double> times;
  for (int i = 200; i >= 1; --i) times.push_back(i);
  // Of 1 .. 200: rank 100, rank 198, and (1 + 200) / 2.
  CHECK(summarise(times).median_us == 100);
  CHECK(summarise(times).p99_us == 198);
  CHECK(summarise(times).mean_us == 100.5);
  CHECK(summarise({7}).median_us == 7);
  CHECK(summarise({7}).p99_us == 7);
  CHECK(summarise({}).mean_us == 0);
}

}  // namespace cradle
