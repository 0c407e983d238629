/// How cost and memory grow with the number of bodies: T1 and T2 at constant density, and T4.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/scene.h"
#include "server/stopwatch.h"
#include "server/world/world.h"
#include "tests/bench/report.h"

namespace cradle::bench {

struct GrowthCase {
  std::string_view name;     ///< "growth:T1"
  std::vector<int> numbers;  ///< of dynamic bodies, ascending
  int from;                  ///< exponents of time count from here on
  int warm_up, ticks;        ///< not timed, and timed
  Scene (*scene)(int number);
  std::string_view about;
  /// A body, that it takes after the first tick: there before, as `memory_mib` has it in a server.
  std::size_t bytes_to_come = 0;
};

/// In the order in which they are listed and run.
std::span<const GrowthCase> growth_cases();

/// One number of bodies. Means over the timed ticks.
struct GrowthRow {
  std::string name;
  int bodies = 0;
  TickTimes us_per_tick;
  double work = 0;      ///< a tick: see work_of
  double contacts = 0;  ///< points that touch, a tick
  double bytes = 0;     ///< of the heap, that the world holds after the last tick
};

GrowthRow run(const GrowthCase& which, int number);

/// Of a tick, counted: boxes, nodes, cells, pairs and contacts looked at, impacts, and bodies
/// moved: once each in flight, once a sub-step in contact.
std::int64_t work_of(const StepReport& report, int bodies);

/// p of y ~ x^p by least squares in the logarithms, over two rows or more.
double exponent(std::span<const double> x, std::span<const double> y);

std::string growth_header(Format format);
/// The last of `rows`, with the exponents of all up to it where there are two: of work over all, of
/// time from `from` on.
std::string growth_line(Format format, const GrowthCase& which, std::span<const GrowthRow> rows);

/// Makes the folder and in it growth.csv, growth.dat, growth.gp and growth.svg. Throws as
/// write_precision_report does. Numbers above `most` are left out.
void write_growth_report(const std::string& folder, int most = 1'000'000);

}  // namespace cradle::bench
