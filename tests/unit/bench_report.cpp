// What a run of the benchmark reports, and how it is printed.
#include <catch2/catch.hpp>
#include <limits>

#include "tests/bench/report.h"

using namespace cradle;
using namespace cradle::bench;

TEST_CASE("a run takes its options, and counts its ticks by them") {
  Options options;
  options.dt_s = 0.02;
  options.sub_steps = 3;
  options.threads = 2;
  options.lanes = 1;
  const Row row = run(*find_case("A10"), options);
  CHECK(row.dt_s == Approx(0.02));
  CHECK(row.sub_steps == 3);
  CHECK(row.threads == 2);
  CHECK(row.lanes == 1);
  CHECK(row.us_per_tick.mean_us > 0);
  CHECK(row.ns_per_body == 1000 * row.us_per_tick.median_us);
  CHECK(row.hash.size() == 16);
  CHECK(row.hash == run(*find_case("A10"), options).hash);
  CHECK(row.hash != run(*find_case("A10"), Options{}).hash);
}

TEST_CASE("a row of CSV keeps every bit, what is not a number, and what there is not") {
  Row row;
  row.scene = "A3";
  row.engine = "cradle";
  row.method = "soft";
  row.dt_s = 0.1;
  row.sub_steps = 4;
  row.lanes = 8;
  row.us_per_tick = {1.5, 2.5, 3.5};
  row.ns_per_body = 4.5;
  row.error = -std::numeric_limits<double>::quiet_NaN();
  row.error_kind = "apex, relative";
  row.energy_drift = -1.0 / 3;
  row.penetration_max_m = 1e-300;
  row.hash = "0123456789abcdef";
  CHECK(line(Format::csv, row) ==
        "A3,cradle,soft,0.1,4,1,8,1.5,2.5,3.5,4.5,nan,\"apex, "
        "relative\",-0.3333333333333333,,1e-300,0,"
        "0123456789abcdef\n");
  CHECK(
      header(Format::csv) ==
      "scene,engine,method,dt_s,substeps,threads,lanes,us_per_tick_median,us_per_tick_mean,"
      "us_per_tick_p99,ns_per_body,error,error_kind,energy_drift,momentum_drift,penetration_max_m,"
      "penetration_mean_m,hash\n");
}

TEST_CASE("the columns of the table stand below their names") {
  Row row;
  row.scene = "A3";
  row.error = 1.0 / 3;
  row.hash = "0123456789abcdef";
  const std::string names = header(Format::table);
  const std::string cells = line(Format::table, row);
  CHECK(cells.find("0.3333") == names.find("error"));
  CHECK(cells.find(row.hash) == names.find("hash"));
}
