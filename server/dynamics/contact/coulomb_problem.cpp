#include "server/dynamics/contact/coulomb_problem.h"

#include <cassert>
#include <cmath>

namespace cradle {

ContactResidual residual_of(const CoulombProblem& problem, const Eigen::VectorXd& impulses) {
  const Eigen::VectorXd u = problem.velocities(impulses);
  ContactResidual residual;
  const auto at = [&](const Eigen::VectorXd& x, Eigen::Index row) {
    return Vector(x[row], x[row + 1], problem.tangents > 1 ? x[row + 2] : 0);
  };
  for (Eigen::Index i = 0; i < problem.points(); ++i) {
    const Eigen::Index row = problem.row(i);
    residual.add(problem.K(i), problem.friction[i], at(impulses, row), at(u, row));
  }
  return residual;
}

ScaledCoulomb::ScaledCoulomb(const CoulombProblem& of) : problem(of), roots(of.rows()) {
  for (Eigen::Index i = 0; i < of.points(); ++i) {
    assert(of.K(i) > 0 && "one of a contact's bodies yields");
    roots.segment(of.row(i), 1 + of.tangents).setConstant(std::sqrt(of.K(i)));
  }
  const auto inverse = roots.cwiseInverse().asDiagonal();
  problem.W = inverse * of.W * inverse;
  problem.b = inverse * of.b;
  const double most = of.rows() > 0 ? problem.b.cwiseAbs().maxCoeff() : 0;
  if (most > 0) size = most;
  problem.b /= size;
}

}  // namespace cradle
