/// The report on work against precision: data, gnuplot scripts, diagrams and a table.
#pragma once

#include <string>

#include "tests/bench/precision.h"

namespace cradle::bench {

/// A curve is a block of lines "step_s error evaluations ns", two empty lines between blocks.
std::string data_text(std::span<const PrecisionCurve> curves);

/// A Markdown table, a line a case: the cheapest scheme and step for each error, and what a second
/// of simulated time costs one body there, in evaluations of force and torque and in time.
std::string table_head();
std::string table_line(const PrecisionCase& which, std::span<const PrecisionCurve> curves);

/// Makes the folder and in it, for each case, NAME.dat, NAME.gp, NAME_time.svg and NAME_work.svg;
/// and table.md. Throws std::filesystem::filesystem_error, OutputError of server/trace.h and
/// PlotError of plot.h; data, scripts and table are there then.
void write_precision_report(const std::string& folder, double evaluations_max = 3e6);

}  // namespace cradle::bench
