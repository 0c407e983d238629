/// The narrow phase by itself: cost and error of a pair of shapes, with FCL's beside it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/bench/pair_scenes.h"
#include "tests/bench/report.h"

namespace cradle::bench {

struct PairCase {
  std::string name;  ///< "pair:sphere-box"
  PairShape A, B;
};

/// Every pair of shapes, in the order in which they are listed and run.
const std::vector<PairCase>& pair_cases();

/// What was found of a few hundred poses.
struct PairFigures {
  double ns = 0;      ///< a pair
  double points = 0;  ///< a pair
  double missed = 0;  ///< share of the poses in which none was found
  /// m, the largest difference of the deepest point's depth to the overlap along the normal by the
  /// support functions of the true shapes. Of an unsigned distance: to the true distance.
  double error_m = 0;
  /// m, the most by which the overlap along the normal exceeds the least that is known.
  double excess_m = 0;
};

/// One line of the report.
struct PairRow {
  std::string name;
  Situation situation = Situation::resting;
  PairFigures ours;
  std::optional<PairFigures> fcl;  ///< none where it has no such pair, threw or died
};

/// One row a situation.
std::vector<PairRow> run(const PairCase& which);

std::string pair_header(Format format);
std::string line(Format format, const PairRow& row);

}  // namespace cradle::bench
