// The report on work against precision of whole engines.
#include "tests/bench/engine_report.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <sstream>

#include "tests/bench/plot.h"
#include "tests/peers/libraries.h"

using namespace cradle;
using namespace cradle::bench;
using Catch::Matchers::Contains;

namespace {

class TemporaryFolder {
 public:
  TemporaryFolder()
      : path_(std::filesystem::temp_directory_path() /
              ("cradle engines-" + std::to_string(::getpid()))) {}
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

std::string text_of(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

}  // namespace

TEST_CASE("each way to spend more is a curve, and steps a tick let a box stop where it must") {
  const std::vector<PeerLibrary> libraries = libraries_here();
  const auto curves = sweep_engines(*find_case("A4"), libraries, 10);
  constexpr std::size_t kOurs =
      9;  // two methods by sub-steps and tolerances, five by shorter ticks
  REQUIRE(curves.size() == kOurs + 2 * libraries.size());
  CHECK(curves[0].engine == "cradle hybrid");
  CHECK(curves[0].points.size() == 2);  // 4 and 8 sub-steps
  CHECK(curves[1].points.size() == 1);  // 5 um
  CHECK(curves[2].engine == "cradle soft");
  for (std::size_t i = 4; i < kOurs; ++i) {
    INFO(curves[i].engine);
    CHECK(curves[i].unit == "steps a tick");
    REQUIRE(curves[i].points.size() == 3);  // 1, 2, 4
    for (const EnginePoint& point : curves[i].points) CHECK(point.outcome == "ok");
    // Of the first order, too; but for "penalty", which takes sub-steps of its own.
    if (curves[i].engine == "cradle penalty") continue;
    CHECK(curves[i].points[0].error == Approx(0.5 * 9.81 / 10 / 60).epsilon(0.2));
    CHECK(curves[i].points[2].error < 0.5 * curves[i].points[0].error);
  }
  for (std::size_t i = 0; i < libraries.size(); ++i) {
    const EngineCurve &iterations = curves[kOurs + 2 * i], &steps = curves[kOurs + 1 + 2 * i];
    INFO(iterations.engine);
    CHECK(iterations.unit == "iterations");
    REQUIRE(iterations.points.size() == 1);
    REQUIRE(steps.points.size() == 4);  // 1, 2, 4, 8
    // Of the first order: v0 dt / 2 of v0^2 / (2 mu g).
    CHECK(steps.points[0].error == Approx(0.5 * 9.81 / 10 / 60).epsilon(0.2));
    CHECK(steps.points[2].error < 0.5 * steps.points[0].error);
  }
}

TEST_CASE("a point that failed is in the data, and one without a number at the diagram's edge") {
  const double nan = std::nan("");
  const std::vector<EngineCurve> curves{
      {"cradle", "sub-steps", {{4, 10, 1e-3, "ok"}, {8, 20, 1e-5, "ok"}}},
      {"other", "iterations", {{10, 5, nan, "ok"}, {20, nan, nan, "crashed: Aborted"}}},
      {"other", "steps a tick", {{1, 7, 1e5, "ok"}, {2, 900, 1e-20, "ok"}}}};
  CHECK(data_text(curves) ==
        "# cradle: sub-steps us error shown\n4 10 0.001 0.001\n8 20 1e-05 1e-05\n"
        "\n\n# other: iterations us error shown\n10 5 nan 100\n# 20 crashed: Aborted\n"
        "20 nan nan 100\n"
        "\n\n# other: steps a tick us error shown\n1 7 100000 100\n2 900 1e-20 1e-12\n");
  CHECK(engine_table_lines(*find_case("A4"), curves) ==
        "| A4 stopping distance, relative | cradle | 4 sub-steps: 10 µs | 4 sub-steps: 10 µs | "
        "8 sub-steps: 20 µs | none |\n"
        "| A4 stopping distance, relative | other | 2 steps a tick: 900 µs |"
        " 2 steps a tick: 900 µs | 2 steps a tick: 900 µs | 2 steps a tick: 900 µs |\n");
}

TEST_CASE("the report of engines has data, diagrams and a table") {
  const TemporaryFolder folder;
  const std::vector<const Case*> cases{find_case("A4"), find_case("A8a")};
  write_engine_report(folder.path().string(), {}, 4, cases);
  for (const Case* which : cases) {
    const std::string name(which->name);
    CAPTURE(name);
    CHECK_THAT(text_of(folder.path() / (name + ".dat")), Contains("# cradle hybrid: sub-steps"));
    CHECK_THAT(text_of(folder.path() / (name + ".svg")), Contains("</svg>"));
    CHECK_THAT(text_of(folder.path() / "engines.md"), Contains("\n| " + name + " "));
  }
}
