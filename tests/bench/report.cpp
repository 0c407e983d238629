#include "tests/bench/report.h"

#include <string>
#include <string_view>

#include "tests/bench/table.h"

namespace cradle::bench {
namespace {

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

}  // namespace

std::string header(Format format) { return names_line(kColumns, format); }

std::string line(Format format, const Row& row) {
  const auto text = [&](const auto& value) { return text_of(value, format); };
  return cells_line(
      kColumns,
      {row.scene, row.engine, row.method, text(row.dt_s), std::to_string(row.sub_steps),
       std::to_string(row.threads), std::to_string(row.lanes), text(row.us_per_tick.median_us),
       text(row.us_per_tick.mean_us), text(row.us_per_tick.p99_us), text(row.ns_per_body),
       text(row.error), row.error_kind, text(row.energy_drift), text(row.momentum_drift),
       text(row.penetration_max_m), text(row.penetration_mean_m), row.hash},
      format);
}

}  // namespace cradle::bench
