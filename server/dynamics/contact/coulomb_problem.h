/// Contact with friction in one step, as mathematics: no bodies, just what their points do to each
/// other. For the baselines and the oracles of contact.
///
///   u = W lambda + b, and for each point, with un, ut, ln, lt its normal and tangential parts:
///   0 <= ln, 0 <= un, ln un = 0;  |lt| <= mu ln;  lt |ut| = -mu ln ut
/// W = J M^-1 J^T (1/kg; symmetric, semidefinite), b (m/s) the velocities without impulses, plus
/// s / h along n where there is a gap s; lambda (N s). Sources: Stewart and Trinkle (1996); Acary
/// and Brogliato (2008), chapter 13.
#pragma once

#include <Eigen/Core>

#include "server/dynamics/contact/contact_balance.h"

namespace cradle {

struct CoulombProblem {
  Eigen::MatrixXd W;         ///< 1/kg; rows n, t1, t2 of the first point, of the second, ...
  Eigen::VectorXd b;         ///< m/s
  Eigen::VectorXd friction;  ///< mu of each point
  int tangents = 2;          ///< 1 in the plane: rows n, t1

  Eigen::Index points() const { return friction.size(); }
  Eigen::Index row(Eigen::Index point) const { return point * (1 + tangents); }
  Eigen::Index rows() const { return row(points()); }
  /// 1/kg, of a point along n; above 0.
  double K(Eigen::Index point) const { return W(row(point), row(point)); }
  Eigen::VectorXd velocities(const Eigen::VectorXd& impulses) const { return W * impulses + b; }
};

/// How far impulses are from the laws above, for the true cone.
ContactResidual residual_of(const CoulombProblem& problem, const Eigen::VectorXd& impulses);

/// The same problem with K = 1 at each point and b of size 1, so that one tolerance fits all.
struct ScaledCoulomb {
  explicit ScaledCoulomb(const CoulombProblem& of);

  CoulombProblem problem;
  Eigen::VectorXd roots;  ///< of K, by row
  double size = 1;        ///< of b, once the rows are scaled

  /// N s, of the problem as it was.
  Eigen::VectorXd impulses(const Eigen::VectorXd& scaled) const {
    return size * scaled.cwiseQuotient(roots);
  }
};

}  // namespace cradle
