/// Linear complementarity problems, by pivots: find z with
///   w = M z + q,  z >= 0,  w >= 0,  z . w = 0.
/// Mathematics alone; what contacts make of it is elsewhere. The method is described in lemke.cpp.
#pragma once

#include <Eigen/Core>

namespace cradle {

enum class LcpStatus {
  solved,   ///< z solves it, to LcpTolerances::residual
  ray,      ///< the path ended in a ray: no solution, if M is copositive-plus (as J M^-1 J^T is)
  spent,    ///< pivots ran out
  inexact,  ///< the path ended, but rounding on it was too much: z misses the tolerance
};

struct LcpSolution {
  LcpStatus status = LcpStatus::solved;
  Eigen::VectorXd z;    ///< 0 unless solved or inexact
  int pivots = 0;       ///< spent
  double residual = 0;  ///< of z, as lcp_residual
};

/// All are relative, without unit.
struct LcpTolerances {
  /// Of the largest of a column: what is smaller is rounding, no pivot ("degenerate").
  double pivot = 1e-11;
  /// Of q's largest: ratios so near to each other are one, and the lexicographic rule chooses among
  /// them ("degenerate").
  double tie = 1e-12;
  /// Of the largest of q, or 1: beyond it nothing is called solved ("positive semidefinite").
  double residual = 1e-9;
  /// Pivots, by the number of unknowns. Random problems take one to two each; only examples made
  /// for it take exponentially many ("Murty").
  int pivots_an_unknown = 10;
};

/// `M` is square, as large as `q`; both are finite.
LcpSolution lemke(const Eigen::MatrixXd& M, const Eigen::VectorXd& q,
                  const LcpTolerances& tolerances = {});

/// How far z is from a solution: max |min(z_i, w_i)|, 0 where it is one.
double lcp_residual(const Eigen::MatrixXd& M, const Eigen::VectorXd& q, const Eigen::VectorXd& z);

}  // namespace cradle
