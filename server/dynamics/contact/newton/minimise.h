/// The minimum of an island's convex problem by Newton's method: see minimise.cpp.
#pragma once

#include "server/dynamics/contact/newton/contact_island.h"

namespace cradle {

struct MinimiseSettings {
  double tolerance = 1e-5;  ///< of the gradient, by `scale`
  double scale = 0;         ///< in the unknowns of the island
  int iterations_max = 50;
};

struct Minimum {
  bool is_found = false;
  int iterations = 0;
};

/// Keeps its memory from island to island.
class Minimiser {
 public:
  /// From `x`, which it overwrites, and by which the island's points have been looked at, before
  /// and after. No iteration where the gradient is small at once.
  Minimum minimise(ContactIsland& island, BlockCholesky& H, Eigen::VectorXd& x,
                   const MinimiseSettings& settings);

  /// Of the gradient there.
  double error(ContactIsland& island, const Eigen::VectorXd& x);

 private:
  double part_of(const ContactIsland& island, const Eigen::VectorXd& x) const;

  Eigen::VectorXd r_, d_;
};

}  // namespace cradle
