// The report on work against precision: its measures, its files, and what README.md shows of it.
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/bench/precision_report.h"

namespace cradle::bench {
namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream stream(path);
  REQUIRE(stream);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

class TemporaryFolder {
 public:
  TemporaryFolder()
      : path_(std::filesystem::temp_directory_path() /
              ("cradle precision-" + std::to_string(::getpid()))) {}
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace

TEST_CASE("the cheapest setting is the least time among those that are good enough") {
  const std::vector<PrecisionCurve> curves{
      {"a", {{0.1, 1e-3, 10, 100}, {0.05, 1e-5, 20, 200}}},
      {"b", {{0.1, NAN, 10, 1}, {0.05, 1e-4, 20, 150}, {0.025, 1e-9, 40, 900}}}};
  CHECK(cheapest(curves, 1e-2).scheme == "a");
  CHECK(cheapest(curves, 1e-2).point.ns == 100);
  CHECK(cheapest(curves, 1e-4).scheme == "b");
  CHECK(cheapest(curves, 1e-5).point.step_s == 0.05);
  CHECK(cheapest(curves, 1e-8).point.ns == 900);
  CHECK(cheapest(curves, 1e-10).scheme.empty());
  CHECK(data_text(curves) ==
        "# a: step_s error evaluations ns\n0.1 0.001 10 100\n0.05 1e-05 20 200\n\n\n"
        "# b: step_s error evaluations ns\n0.1 nan 10 1\n0.05 0.0001 20 150\n0.025 1e-09 40 900\n");
}

TEST_CASE("the cases of the report tell good schemes from bad ones") {
  for (const PrecisionCase& which : precision_cases()) {
    CAPTURE(which.name);
    const int steps = static_cast<int>(std::lround(which.time_s * 240));
    const double best = which.error(which, *find_scheme("exact"), steps);
    const double worst = which.error(which, *find_scheme("explicit_euler"), steps);
    CHECK(best < (which.name == "P09" ? 1e-2 : 1e-9));
    CHECK(worst > 1e-3);
  }
}

TEST_CASE("a report has data, scripts, diagrams and a table") {
  const TemporaryFolder folder;
  write_precision_report(folder.path().string(), 3000);
  for (const PrecisionCase& which : precision_cases()) {
    CAPTURE(which.name);
    const std::string name(which.name);
    const std::string data = text_of(folder.path() / (name + ".dat"));
    for (const Scheme& scheme : schemes()) {
      CHECK_THAT(data, Catch::Matchers::Contains("# " + std::string(scheme.name) + ": "));
    }
    for (const char* diagram : {"_time.svg", "_work.svg"}) {
      const std::string svg = text_of(folder.path() / (name + diagram));
      CHECK_THAT(svg, Catch::Matchers::Contains("</svg>"));
      CHECK_THAT(svg, Catch::Matchers::Contains("semi implicit euler"));
    }
    CHECK_THAT(text_of(folder.path() / "table.md"), Catch::Matchers::Contains("\n| " + name));
  }
}

TEST_CASE("without gnuplot the report says what is missing, and leaves data and table") {
  const TemporaryFolder folder;
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", folder.path().c_str(), 1);
  CHECK_THROWS_WITH(write_precision_report(folder.path().string(), 100),
                    Catch::Matchers::Contains("gnuplot-nox"));
  ::setenv("PATH", path.c_str(), 1);
  CHECK(std::filesystem::exists(folder.path() / "P07.dat"));
  CHECK(std::filesystem::exists(folder.path() / "P07.gp"));
  CHECK(std::filesystem::exists(folder.path() / "table.md"));
  CHECK(!std::filesystem::exists(folder.path() / "P07_time.svg"));
}

TEST_CASE("README.md shows the report's table and diagram as the program made them") {
  const std::string readme = text_of(CRADLE_SOURCE_DIR "/README.md");
  const std::string table = text_of(CRADLE_SOURCE_DIR "/tests/bench/work_precision.md");
  CHECK_THAT(table, Catch::Matchers::StartsWith(table_head()));
  CHECK_THAT(readme, Catch::Matchers::Contains(table));
  CHECK_THAT(readme, Catch::Matchers::Contains("(tests/bench/work_precision.svg)"));
  CHECK_THAT(text_of(CRADLE_SOURCE_DIR "/tests/bench/work_precision.svg"),
             Catch::Matchers::Contains("P07"));
}

}  // namespace cradle::bench
