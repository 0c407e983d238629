// Contact with Coulomb friction in one step, its cone made a polyhedron, by Lemke's pivots.
//
// Sources: Stewart and Trinkle (1996), "An implicit time-stepping scheme for rigid body dynamics
// with inelastic collisions and Coulomb friction"; Anitescu and Potra (1997), who prove that
// Lemke's path ends in a solution.
//   lt = D beta, beta >= 0: D the k unit vectors d_j of friction, evenly round, e = (1, .., 1)
//   un    = Wnn ln + WnD beta + bn            >= 0  complementary to  ln >= 0
//   sigma e + D^T ut                          >= 0  ..                beta >= 0
//   mu ln - e^T beta                          >= 0  ..                sigma >= 0
// sigma is how fast a point slides. In the plane D = (1, -1), and that is Coulomb's law. In space
// it is not: a polygon of k corners within the disk, with cos(pi / k) of its friction at worst,
// 0.92 for k = 8, and friction up to pi / k off the direction of sliding. Where we differ:
// directions are turned by point, so that the first one is against b, which is exact for what
// slides straight on; and may be turned again, to where points do slide or what they stick by,
// until the true cone's law holds, or no better. No proof that this ends; the residual tells.
//
// Cost: 2 + k unknowns a point; see lemke.cpp.
#include "server/dynamics/contact/coulomb_lcp.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace cradle {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The first directions, unit vectors along t1 and t2, a column a point.
using Ways = Eigen::Matrix2Xd;

/// Of another basis: by what gives more, when rounding loses that one, too.
constexpr double kMoreGive = 10;

/// From one direction to the next, of 4, 8, 16, ..; by roots alone, for the same bits everywhere.
Eigen::Matrix2d turn_of(int directions) {
  double cosine = 0;
  for (int k = 4; k < directions; k *= 2) cosine = std::sqrt((1 + cosine) / 2);
  const double sine = std::sqrt(1 - cosine * cosine);
  return (Eigen::Matrix2d() << cosine, -sine, sine, cosine).finished();
}

/// D of all points: from beta to tangential impulses, by row of the problem; rows of n are 0.
MatrixXd friction_directions(const CoulombProblem& problem, int directions, const Ways& ways) {
  MatrixXd D = MatrixXd::Zero(problem.rows(), directions * problem.points());
  const Eigen::Matrix2d turn = turn_of(directions);
  for (Index i = 0; i < problem.points(); ++i) {
    Eigen::Vector2d way = ways.col(i);
    for (Index j = i * directions; j < (i + 1) * directions; ++j) {
      D.block(problem.row(i) + 1, j, problem.tangents, 1) = way.head(problem.tangents);
      way = problem.tangents > 1 ? Eigen::Vector2d(turn * way) : Eigen::Vector2d(-way);
    }
  }
  return D;
}

/// Unknowns: ln of all points, beta of all points, sigma of all points.
LcpSolution solve_polyhedral(const CoulombProblem& problem, const MatrixXd& D, double give,
                             VectorXd& impulses) {
  const Index points = problem.points(), k = D.cols(), n = 2 * points + k;
  MatrixXd N = MatrixXd::Zero(problem.rows(), points);
  for (Index i = 0; i < points; ++i) N(problem.row(i), i) = 1;
  MatrixXd G(problem.rows(), points + k);
  G << N, D;
  MatrixXd M = MatrixXd::Zero(n, n);
  VectorXd q = VectorXd::Zero(n);
  M.topLeftCorner(points + k, points + k) = G.transpose() * problem.W * G;
  q.head(points + k) = G.transpose() * problem.b;
  for (Index i = 0; i < points; ++i) {
    const double mu = problem.friction[i], unit = 1 / std::max(mu, 1.0);  // or mu would be a pivot
    const Index sigma = points + k + i, each = k / points, beta = points + i * each;
    M(sigma, i) = unit * mu;
    M.row(sigma).segment(beta, each).setConstant(-unit);
    M.col(sigma).segment(beta, each).setConstant(unit);
  }
  M.diagonal().head(points).array() += give;
  LcpSolution found = lemke(M, q);
  impulses = G * found.z.head(points + k);
  return found;
}

/// Where each point's friction is to act: against its sliding, or as it does where it sticks.
void turn_to(const CoulombProblem& problem, const VectorXd& impulses, Ways& ways) {
  constexpr double kStill =
      1e-9;  // of the scaled b: slower is rounding of what sticks ("agree in space")
  const VectorXd u = problem.velocities(impulses);
  for (Index i = 0; i < problem.points(); ++i) {
    const Index row = problem.row(i) + 1;
    const Eigen::Vector2d slide = -u.segment<2>(row), stick = impulses.segment<2>(row);
    const Eigen::Vector2d way = slide.norm() > kStill ? slide : stick;
    if (!way.isZero(0)) ways.col(i) = way.normalized();
  }
}

}  // namespace

CoulombLcpSolution solve_by_lcp(const CoulombProblem& problem, const CoulombLcpSettings& settings) {
  CoulombLcpSolution best;
  best.impulses = VectorXd::Zero(problem.rows());
  if (problem.points() == 0) return best;
  const ScaledCoulomb scaled(problem);
  const bool is_planar = problem.tangents == 1;
  assert(is_planar || settings.directions == 4 || settings.directions % 8 == 0);
  const double enough = settings.residual * problem.b.cwiseAbs().maxCoeff();
  Ways ways = Eigen::Vector2d::UnitX().replicate(1, problem.points());
  VectorXd impulses = VectorXd::Zero(problem.rows());
  if (!is_planar) turn_to(scaled.problem, impulses, ways);
  for (int turn = 0; turn <= (is_planar ? 0 : settings.turns_max); ++turn) {
    const int directions = is_planar ? 2 : settings.directions;
    const MatrixXd D = friction_directions(problem, directions, ways);
    LcpSolution found;
    for (const double give : {0.0, settings.give, kMoreGive * settings.give}) {
      found = solve_polyhedral(scaled.problem, D, give, impulses);
      best.pivots += found.pivots;
      if (found.status == LcpStatus::solved || settings.give == 0) break;
    }
    best.turns = turn;
    if (found.status != LcpStatus::solved) {
      if (turn == 0) best.status = found.status;
      break;
    }
    const VectorXd candidate = scaled.impulses(impulses);
    const ContactResidual residual = residual_of(problem, candidate);
    if (turn == 0 || residual.most.natural_mps < best.residual.most.natural_mps) {
      best.impulses = candidate;
      best.residual = residual;
    }
    if (best.residual.most.natural_mps <= enough) break;
    if (!is_planar) turn_to(scaled.problem, impulses, ways);
  }
  if (best.status != LcpStatus::solved) best.residual = residual_of(problem, best.impulses);
  return best;
}

}  // namespace cradle
