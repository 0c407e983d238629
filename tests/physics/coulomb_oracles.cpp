// A thousand random small contact problems, by methods that have nothing in common: Lemke's pivots,
// the enumeration of modes, and Gauss-Seidel sweeps of this file.
//
// When velocities are unique: without friction always (W is positive semidefinite: Cottle, Pang and
// Stone, section 3.1, though impulses may not be). In the plane, where the enumeration of all 4^m
// modes passed over none and found one. In space where mu^2 times the condition of W is below 1:
// the convex problem with slides s = mu |ut| given (Acary, Cadoux, Lemarechal and Malick, 2011) has
//   |u(s) - u(s')|_W^-1 <= |s - s'| / sqrt(least eigenvalue),  |s - s'| <= mu sqrt(largest) |u -
//   u'|
// so that the way from s to its slides is a contraction, with one fixed point. Elsewhere the
// enumeration may miss a solution: one that it found alone is taken for the only one, which is no
// proof, and counted apart, as are problems with several solutions or none, and what other methods
// did not solve: sweeps need not converge, directions of pivots need not settle.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <sstream>

#include "server/dynamics/contact/coulomb_lcp.h"
#include "server/dynamics/contact/coulomb_modes.h"
#include "tests/unit/trials.h"

namespace cradle {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
constexpr double kAgree = 1e-8;  // m/s

/// Points of random bodies against each other, or the ground, in random places, along random
/// normals; masses up to a hundred to one.
CoulombProblem random_problem(std::mt19937_64& random, int points, int tangents, double mu_max,
                              bool is_redundant = false) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  const int freedoms = tangents == 1 ? 3 : 6, rows = 1 + tangents;
  const int enough = (points * rows + freedoms - 1) / freedoms;  // bodies: W may be regular
  const int bodies = is_redundant ? 1 : enough + static_cast<int>(random() % 3);
  CoulombProblem problem;
  problem.tangents = tangents;
  MatrixXd J = MatrixXd::Zero(rows * points, freedoms * bodies);
  VectorXd inverse_mass(freedoms * bodies);
  for (int body = 0; body < bodies; ++body) {
    const double mass = std::pow(100, uniform(random));
    inverse_mass.segment(freedoms * body, tangents + 1).setConstant(1 / mass);
    for (int k = tangents + 1; k < freedoms; ++k) {
      inverse_mass[freedoms * body + k] = 1 / (mass * (0.1 + 0.2 * uniform(random)));
    }
  }
  const auto random_vector = [&] { return Vector(normal(random), normal(random), normal(random)); };
  const auto enter = [&](int point, int body, double sign, const Matrix& frame) {
    const Vector arm = 0.5 * random_vector();
    for (int k = 0; k < rows; ++k) {
      const Vector e = frame.col(k), turn = arm.cross(e);
      auto part = J.row(rows * point + k).segment(freedoms * body, freedoms);
      if (tangents == 1) {
        part << sign * e.x(), sign * e.y(), sign * turn.z();
      } else {
        part << sign * e.transpose(), sign * turn.transpose();
      }
    }
  };
  problem.friction.resize(points);
  for (int i = 0; i < points; ++i) {
    problem.friction[i] = mu_max * uniform(random);
    Vector n = random_vector();
    if (tangents == 1) n.z() = 0;
    n.normalize();
    Matrix frame;
    Vector t1 = tangents == 1 ? Vector(-n.y(), n.x(), 0) : n.unitOrthogonal();
    frame << n, t1, n.cross(t1);
    const int a = i % bodies, b = static_cast<int>(random() % static_cast<unsigned>(bodies));
    enter(i, a, 1, frame);
    if (b != a) enter(i, b, -1, frame);
  }
  VectorXd v = VectorXd::NullaryExpr(J.cols(), [&] { return normal(random); });
  problem.W = J * inverse_mass.asDiagonal() * J.transpose();
  problem.b = J * v;
  return problem;
}

/// Plain projected Gauss-Seidel, each point's normal and then its friction; true if it converged.
bool sweep(const CoulombProblem& problem, VectorXd& impulses) {
  impulses = VectorXd::Zero(problem.rows());
  const Eigen::Index t = problem.tangents;
  for (int sweeps = 0; sweeps < 200000; ++sweeps) {
    double change = 0;
    for (Eigen::Index i = 0; i < problem.points(); ++i) {
      const Eigen::Index row = problem.row(i);
      const double un = problem.W.row(row).dot(impulses) + problem.b[row];
      const double ln = std::max(0.0, impulses[row] - un / problem.K(i));
      change = std::max(change, std::abs(ln - impulses[row]) * problem.K(i));
      impulses[row] = ln;
      const MatrixXd own = problem.W.block(row + 1, row + 1, t, t);
      const VectorXd ut =
          problem.W.middleRows(row + 1, t) * impulses + problem.b.segment(row + 1, t);
      VectorXd lt = impulses.segment(row + 1, t) - ut / own.trace();
      const double most = problem.friction[i] * ln;
      if (lt.norm() > most) lt *= most / lt.norm();
      change = std::max(change, (lt - impulses.segment(row + 1, t)).norm() * problem.K(i));
      impulses.segment(row + 1, t) = lt;
    }
    if (change < 1e-15) break;
  }
  return residual_of(problem, impulses).most.natural_mps < 1e-11;
}

double apart(const CoulombProblem& problem, const VectorXd& one, const VectorXd& other) {
  return (problem.W * (one - other)).cwiseAbs().maxCoeff();
}

bool is_unique(const CoulombProblem& problem, const CoulombModes& modes) {
  if (modes.is_complete || problem.friction.isZero(0)) return true;
  if (problem.tangents == 1) return false;
  const MatrixXd W = ScaledCoulomb(problem).problem.W;
  const VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<MatrixXd>(W).eigenvalues();
  const double mu = problem.friction.maxCoeff();
  return mu * mu * eigenvalues.maxCoeff() < eigenvalues.minCoeff();
}

struct Tally {
  int problems = 0, several = 0, none = 0;  // by modes
  int unique = 0, alone = 0;                // with and without proof
  int swept = 0, pivoted = 0;               // that other methods solved
  double sweeps_apart = 0, pivots_apart = 0;

  void take(const CoulombProblem& problem, const CoulombLcpSettings& settings) {
    ++problems;
    const CoulombModes modes = find_modes(problem);
    for (const VectorXd& impulses : modes.impulses) {
      CHECK(residual_of(problem, impulses).most.natural_mps < kAgree);
    }
    none += modes.impulses.empty() ? 1 : 0;
    several += modes.impulses.size() > 1 ? 1 : 0;
    if (modes.impulses.size() != 1) return;
    ++(is_unique(problem, modes) ? unique : alone);
    const VectorXd& expected = modes.impulses.front();
    const CoulombLcpSolution pivots = solve_by_lcp(problem, settings);
    if (pivots.status == LcpStatus::solved && pivots.residual.most.natural_mps < 1e-10) {
      ++pivoted;
      pivots_apart = std::max(pivots_apart, apart(problem, pivots.impulses, expected));
    }
    VectorXd impulses;
    if (!sweep(problem, impulses)) return;
    ++swept;
    sweeps_apart = std::max(sweeps_apart, apart(problem, impulses, expected));
  }

  std::string text() const {
    std::ostringstream out;
    out << problems << " problems: " << unique << " unique, " << alone << " with one found, "
        << several << " with several, " << none << " with none; solved by pivots " << pivoted
        << ", by sweeps " << swept << "; apart by " << pivots_apart << ", " << sweeps_apart;
    return out.str();
  }
};

}  // namespace

TEST_CASE("P33: pivots and modes solve one contact as its equations say") {
  // Drake's pgs_solver_test, see hard_cases_friction.cpp; here the normal comes first. To 1e-14.
  CoulombProblem problem;
  problem.W = Vector(3, 12, 4).asDiagonal();
  problem.b = Vector(-1, -1, -1);
  for (const double mu : {0.0, 1000.0}) {
    CAPTURE(mu);
    problem.friction = VectorXd::Constant(1, mu);
    const Vector expected = mu > 0 ? Vector(1.0 / 3, 1.0 / 12, 1.0 / 4) : Vector(1.0 / 3, 0, 0);
    const CoulombLcpSolution pivots = solve_by_lcp(problem);
    CHECK(pivots.status == LcpStatus::solved);
    CHECK((pivots.impulses - expected).norm() < 1e-14);
    const CoulombModes modes = find_modes(problem);
    REQUIRE(modes.impulses.size() == 1);
    CHECK((modes.impulses.front() - expected).norm() < 1e-14);
  }
}

TEST_CASE("modes find all solutions of a rod that jams") {
  // Painleve's rod, in one step: a point at the lower end of a rod that leans by 45 degrees against
  // its way, mu so large that what slides presses itself in: K(n, n - mu t) < 0. With un = 0.1 it
  // flies on, or jams, or slides backwards under an impulse: solutions by hand below.
  CoulombProblem problem;
  problem.tangents = 1;
  problem.W = (MatrixXd(2, 2) << 2.5, 1.5, 1.5, 2.5).finished();  // m = 1, J = 1/12, arm 1/2
  problem.b = Eigen::Vector2d(0.1, 1);
  problem.friction = VectorXd::Constant(1, 2);
  const CoulombModes modes = find_modes(problem);
  CHECK(modes.is_complete);
  // Slides: lt = -2 ln, un = 0.1 + (2.5 - 3) ln = 0 at ln = 0.2, ut = 1 + (1.5 - 5) 0.2 = 0.3 > 0.
  // Sticks: ln, lt = -W^-1 b = (1.25, -2.35) / 4: |lt| <= 2 ln.
  REQUIRE(modes.velocities.size() == 3);
  const VectorXd expected[] = {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.3125, -0.5875),
                               Eigen::Vector2d(0.2, -0.4)};
  for (const VectorXd& impulses : expected) {
    CHECK(std::any_of(modes.impulses.begin(), modes.impulses.end(),
                      [&](const VectorXd& found) { return (found - impulses).norm() < 1e-14; }));
    CHECK(residual_of(problem, impulses).most.natural_mps < 1e-14);
  }
  // Pivots find one of them.
  CHECK(solve_by_lcp(problem).residual.most.natural_mps < 1e-14);
  CHECK(find_modes(problem, true).velocities.size() == 1);
}

TEST_CASE("oracles of contact agree without friction") {
  std::mt19937_64 random(11);
  Tally tally;
  for (int k = 0; k < trials(400); ++k) {
    tally.take(random_problem(random, 1 + k % 8, 2, 0, k % 4 == 3), {});
  }
  INFO(tally.text());
  CHECK(tally.pivots_apart < kAgree);
  CHECK(tally.sweeps_apart < kAgree);
  CHECK(tally.unique == tally.problems);
  CHECK(tally.pivoted == tally.problems);
  CHECK(tally.swept == tally.problems);
}

TEST_CASE("oracles of contact agree in the plane") {
  std::mt19937_64 random(12);
  Tally tally;
  for (int k = 0; k < trials(300); ++k) tally.take(random_problem(random, 1 + k % 6, 1, 1), {});
  for (int k = 0; k < trials(20); ++k) tally.take(random_problem(random, 7 + k % 2, 1, 1), {});
  INFO(tally.text());
  CHECK(tally.pivots_apart < kAgree);
  CHECK(tally.sweeps_apart < kAgree);
  CHECK(tally.unique >= 0.85 * tally.problems);  // measured: 288 of 320, and 31 with one found
  CHECK(tally.none == 0);                        // there is a solution always: Stewart and Trinkle
  CHECK(tally.pivoted == tally.unique + tally.alone);
  CHECK(tally.swept >= 0.98 * tally.pivoted);
}

TEST_CASE("oracles of contact agree in space") {
  std::mt19937_64 random(13);
  Tally tally;
  const CoulombLcpSettings until_exact{8, 100, 1e-13};
  const auto take = [&](int points, double mu_max) {
    tally.take(random_problem(random, points, 2, mu_max), until_exact);
  };
  for (int k = 0; k < trials(270); ++k) take(1 + k % 5, k % 2 == 0 ? 0.1 : 1);
  for (int k = 0; k < trials(10); ++k) take(6 + k % 3, 1);
  INFO(tally.text());
  CHECK(tally.pivots_apart < kAgree);
  CHECK(tally.sweeps_apart < kAgree);
  // Measured: 92 of 280 unique by proof, 184 with one found; of these pivots solve 235, sweeps all.
  CHECK(tally.unique >= 0.3 * tally.problems);
  CHECK(tally.none <= 0.02 * tally.problems);
  CHECK(tally.pivoted >= 0.8 * tally.problems);
  CHECK(tally.swept == tally.unique + tally.alone);
}

}  // namespace cradle
