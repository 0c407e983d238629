/// Work against precision of the integration schemes: cases P01, P07, P08, P09 and P10, every
/// scheme, steps from 100 ms down, one body.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/dynamics/schemes/scheme.h"

namespace cradle::bench {

struct PrecisionCase {
  std::string_view name;
  std::string_view about;
  std::string_view error_kind;  ///< with its unit
  double time_s;                ///< simulated
  Inertia inertia;
  Flight start;
  FlightLoads (*loads)();
  /// Of a run with these steps. NaN where the scheme has no result.
  double (*error)(const PrecisionCase& which, const Scheme& scheme, int steps);
};

std::span<const PrecisionCase> precision_cases();

/// One run. Costs are those of a second of simulated time.
struct PrecisionPoint {
  double step_s = 0;
  double error = 0;
  double evaluations = 0;
  double ns = 0;  ///< least of several runs
};

struct PrecisionCurve {
  std::string scheme;
  std::vector<PrecisionPoint> points;  ///< by falling step
};

/// All schemes on one case; steps are halved down to rounding, or to `evaluations_max` a run.
std::vector<PrecisionCurve> sweep(const PrecisionCase& which, double evaluations_max);

/// The point of all curves that costs least time among those with `error` or less, with its scheme;
/// an empty scheme: none.
struct Cheapest {
  std::string scheme;
  PrecisionPoint point;
};
Cheapest cheapest(std::span<const PrecisionCurve> curves, double error);

}  // namespace cradle::bench
