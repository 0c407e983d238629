#include "tests/bench/report.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/trace.h"

namespace cradle::bench {
namespace {

struct Column {
  std::string_view name;
  std::size_t width;  // in the table
};

constexpr Column kColumns[] = {{"scene", 5},
                               {"engine", 6},
                               {"method", 8},
                               {"dt_s", 8},
                               {"substeps", 8},
                               {"threads", 7},
                               {"lanes", 5},
                               {"us_per_tick_median", 18},
                               {"us_per_tick_mean", 16},
                               {"us_per_tick_p99", 15},
                               {"ns_per_body", 11},
                               {"error", 10},
                               {"error_kind", 40},
                               {"energy_drift", 12},
                               {"momentum_drift", 14},
                               {"penetration_max_m", 17},
                               {"penetration_mean_m", 18},
                               {"hash", 16}};

constexpr int kDigits = 4;  // of a number in the table

std::string text_of(double value, Format format) {
  if (std::isnan(value)) return "nan";  // whatever its sign
  std::array<char, 32> text;            // the shortest form of a double has at most 24
  const auto end = format == Format::csv ? std::to_chars(text.begin(), text.end(), value)
                                         : std::to_chars(text.begin(), text.end(), value,
                                                         std::chars_format::general, kDigits);
  return {text.begin(), end.ptr};
}

std::string text_of(const std::optional<double>& value, Format format) {
  return value ? text_of(*value, format) : std::string();
}

std::string joined(const std::vector<std::string>& cells, Format format) {
  std::string text;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (format == Format::csv) {
      text += (i > 0 ? "," : "") + csv_field(cells[i]);
      continue;
    }
    text += cells[i];
    const std::size_t rest = kColumns[i].width - std::min(kColumns[i].width, cells[i].size());
    if (i + 1 < cells.size()) text.append(rest + 2, ' ');
  }
  return text + '\n';
}

}  // namespace

std::string header(Format format) {
  std::vector<std::string> names;
  for (const Column& column : kColumns) names.emplace_back(column.name);
  return joined(names, format);
}

std::string line(Format format, const Row& row) {
  const auto text = [&](const auto& value) { return text_of(value, format); };
  return joined(
      {row.scene, row.engine, row.method, text(row.dt_s), std::to_string(row.sub_steps),
       std::to_string(row.threads), std::to_string(row.lanes), text(row.us_per_tick.median_us),
       text(row.us_per_tick.mean_us), text(row.us_per_tick.p99_us), text(row.ns_per_body),
       text(row.error), row.error_kind, text(row.energy_drift), text(row.momentum_drift),
       text(row.penetration_max_m), text(row.penetration_mean_m), row.hash},
      format);
}

}  // namespace cradle::bench
