/// Contact with friction as a linear complementarity problem: coulomb_lcp.cpp.
#pragma once

#include "server/dynamics/contact/coulomb_problem.h"
#include "server/dynamics/lcp/lemke.h"

namespace cradle {

struct CoulombLcpSettings {
  int directions = 8;  ///< of a point's friction, evenly round; two in the plane
  /// Times that they are turned to where points slide and solved again. 0: the polyhedral cone as
  /// it is.
  int turns_max = 0;
  /// m/s by m/s: the true cone's residual, by the largest of b, that is good enough to turn no
  /// more.
  double residual = 1e-12;
  /// Added to K of each point along n, by K, where pivots find nothing without it: redundant points
  /// leave W singular, and its degenerate bases are lost to rounding ("a stack by pivots"). 0: no
  /// second try; else there is a third, with ten times as much.
  double give = 0;
};

struct CoulombLcpSolution {
  LcpStatus status = LcpStatus::solved;
  Eigen::VectorXd impulses;  ///< N s; 0 unless solved
  int pivots = 0;            ///< of all turns
  int turns = 0;
  ContactResidual residual;  ///< by the true cone
};

CoulombLcpSolution solve_by_lcp(const CoulombProblem& problem,
                                const CoulombLcpSettings& settings = {});

}  // namespace cradle
