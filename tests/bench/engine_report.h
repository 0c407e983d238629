/// Work against precision of whole engines: a scene a diagram, a curve a way to spend more time.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tests/bench/side_by_side.h"

namespace cradle::bench {

/// T3, A4, A7, A8a, A8b, S3.
std::vector<const Case*> engine_cases();

struct EnginePoint {
  int setting = 0;
  double us = 0;        ///< a tick, the case's time; NaN if the run failed
  double error = 0;     ///< NaN too
  std::string outcome;  ///< "ok", or why it failed
};
struct EngineCurve {
  std::string engine;
  std::string unit;  ///< of the setting: "sub-steps", "iterations", "steps a tick", ...
  std::vector<EnginePoint> points;
};

/// Cradle by each of its methods, with 4 to 64 sub-steps, with stated tolerances, or with shorter
/// ticks; each library with more iterations,
/// and with more steps a tick. Every run in a process of its own. Settings above `settings_max` are
/// left out.
std::vector<EngineCurve> sweep_engines(const Case& which, std::span<const PeerLibrary> libraries,
                                       int settings_max = 5000);

/// A curve is a block of lines "setting us error shown", two empty lines between blocks. Shown is
/// the error, kept within the diagram: what is not a number stands at its upper edge.
std::string data_text(std::span<const EngineCurve> curves);

/// A Markdown table, a line an engine of a case: the cheapest setting for each error.
std::string engine_table_head();
std::string engine_table_lines(const Case& which, std::span<const EngineCurve> curves);

/// Makes the folder and in it, for each case, NAME.dat, NAME.gp and NAME.svg; and engines.md.
/// Throws as write_precision_report does.
void write_engine_report(const std::string& folder, std::span<const PeerLibrary> libraries,
                         int settings_max = 5000,
                         const std::vector<const Case*>& cases = engine_cases());

}  // namespace cradle::bench
