// Linear complementarity problems by Lemke's pivots, judged by what a solution is: z >= 0,
// w = M z + q >= 0, z . w = 0; published solutions where there are any.
#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <random>

#include "server/dynamics/lcp/lemke.h"

namespace cradle {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
constexpr double kLcpSolved = 1e-8;  // P35 asks for this

MatrixXd square(int n, std::initializer_list<double> rows) {
  MatrixXd M(n, n);
  int k = 0;
  for (const double value : rows) {
    M(k / n, k % n) = value;
    ++k;
  }
  return M;
}
VectorXd column(std::initializer_list<double> values) {
  return Eigen::Map<const VectorXd>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

MatrixXd random_matrix(std::mt19937_64& random, int rows, int columns) {
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

/// 1 on the diagonal, 2 below it.
MatrixXd murty(int n) {
  MatrixXd M = MatrixXd::Identity(n, n);
  M.triangularView<Eigen::StrictlyLower>().setConstant(2);
  return M;
}

void check_solved(const MatrixXd& M, const VectorXd& q, double most = kLcpSolved,
                  const LcpTolerances& tolerances = {}) {
  const LcpSolution found = lemke(M, q, tolerances);
  CAPTURE(M.rows(), found.pivots, found.residual);
  REQUIRE(found.status == LcpStatus::solved);
  const VectorXd w = M * found.z + q;  // and not by lcp_residual alone
  CHECK(found.z.minCoeff() >= 0);
  CHECK(w.minCoeff() > -most);
  CHECK(std::abs(found.z.dot(w)) < most * std::max(1.0, found.z.norm()));
}

}  // namespace

TEST_CASE("P35: Murty's example is solved, by as many pivots as it was made for") {
  // Murty (1978), "Computational complexity of complementary pivot methods": q = -1, z = e1 and
  // w = (0, 1, .., 1); the path goes through 2^n - 1 bases. Fathi's, M = L L^T, is positive
  // definite.
  LcpTolerances patient;
  patient.pivots_an_unknown = 1 << 12;
  for (const int n : {1, 2, 6, 12}) {
    CAPTURE(n);
    const MatrixXd M = murty(n);
    const VectorXd q = VectorXd::Constant(n, -1);
    const LcpSolution found = lemke(M, q, patient);
    REQUIRE(found.status == LcpStatus::solved);
    CHECK((found.z - VectorXd::Unit(n, 0)).norm() < 1e-14);
    CHECK((M * found.z + q - (VectorXd::Ones(n) - VectorXd::Unit(n, 0))).norm() < 1e-13);
    CHECK(found.pivots == 1 << n);  // z0 comes and goes, too
    if (n <= 6) check_solved(M * M.transpose(), q, kLcpSolved, patient);
  }
  // Without that patience it is told, and nothing is called a solution.
  const LcpSolution early = lemke(murty(12), VectorXd::Constant(12, -1));
  CHECK(early.status == LcpStatus::spent);
  CHECK(early.z.isZero(0));
  CHECK(early.residual == 1);
}

TEST_CASE("P35: problems of Cottle, Pang and Stone") {
  // As kept by Siconos, numerics/src/LCP/test/data: lcp_CPS_1 and lcp_CPS_4, and lcp_deudeu_block.
  // CPS_1: all z >= 0 with z1 + z2 = 1 solve it. deudeu: z = M^-1 (5, 6) = (4, 7) / 3.
  const MatrixXd ones = MatrixXd::Ones(2, 2);
  const LcpSolution first = lemke(ones, column({-1, -1}));
  REQUIRE(first.status == LcpStatus::solved);
  CHECK(std::abs(first.z.sum() - 1) < 1e-14);
  CHECK(first.z.minCoeff() >= 0);
  const LcpSolution second = lemke(square(2, {2, 1, 1, 2}), column({-5, -6}));
  REQUIRE(second.status == LcpStatus::solved);
  CHECK((second.z - column({4.0 / 3, 7.0 / 3})).norm() < 1e-14);
  // CPS_4 as it is kept has no solution: w4 = -z1 - z2 - z3 - 6. With the other sign of q it is a
  // quadratic program that has one.
  const MatrixXd M = square(4, {11, 0, 10, 1, 0, 11, 10, 1, 10, 10, 21, 1, -1, -1, -1, 0});
  CHECK(lemke(M, column({50, 50, 10, -6})).status == LcpStatus::ray);
  check_solved(M, column({-50, -50, -10, 6}));
}

TEST_CASE("lemke: degenerate problems do not cycle") {
  // Kostreva (1979), "Cycling in linear complementarity problems": z = (1, 1, 1) / 3, by symmetry.
  const LcpSolution found = lemke(square(3, {1, 2, 0, 0, 1, 2, 2, 0, 1}), column({-1, -1, -1}));
  REQUIRE(found.status == LcpStatus::solved);
  CHECK((found.z - VectorXd::Constant(3, 1.0 / 3)).norm() < 1e-14);

  std::mt19937_64 random(1);
  for (int trial = 0; trial < 300; ++trial) {
    // Few distinct numbers, ranks far below the number of unknowns, q in the range: ties
    // everywhere.
    const int n = 2 + trial % 30, rank = 1 + trial % 4;
    MatrixXd J(n, rank);
    VectorXd v(rank);
    for (double& entry : J.reshaped()) entry = static_cast<double>(random() % 3) - 1;
    for (double& entry : v) entry = static_cast<double>(random() % 3) - 1;
    CAPTURE(trial);
    check_solved(J * J.transpose(), J * v);
  }
}

TEST_CASE("lemke: positive definite, P and positive semidefinite problems") {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 600; ++trial) {
    const int n = 1 + trial % 40;
    CAPTURE(trial);
    const MatrixXd A = random_matrix(random, n, n);
    const VectorXd q = 10 * random_matrix(random, n, 1);
    MatrixXd skew = random_matrix(random, n, n);
    skew = (skew - skew.transpose()).eval();
    // No symmetry: positive definite, and a P-matrix that is not (Murty's with other numbers).
    check_solved(A * A.transpose() + 0.1 * MatrixXd::Identity(n, n) + skew, q);
    MatrixXd P = MatrixXd::Identity(n, n);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < i; ++j) P(i, j) = 2 * uniform(random);
    }
    check_solved(P, q, 1e-8 * std::max(1.0, P.norm() * q.norm()));
    // Semidefinite and feasible: w = M z + q with a z that is known.
    const MatrixXd J = random_matrix(random, n, 1 + n / 3);
    const VectorXd z = random_matrix(random, n, 1).cwiseMax(0);
    check_solved(J * J.transpose(),
                 random_matrix(random, n, 1).cwiseAbs() - J * (J.transpose() * z));
  }
}

TEST_CASE("lemke: what has no solution ends in a ray") {
  CHECK(lemke(MatrixXd::Zero(1, 1), column({-1})).status == LcpStatus::ray);
  // w1 + w2 = -2 for every z.
  CHECK(lemke(square(2, {1, -1, -1, 1}), column({-1, -1})).status == LcpStatus::ray);
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 300; ++trial) {
    // M v = 0 with v > 0, and v . q < 0: so v . w < 0 whatever z is.
    const int n = 2 + trial % 20;
    CAPTURE(trial);
    const VectorXd v = random_matrix(random, n, 1).cwiseAbs() + VectorXd::Constant(n, 0.1);
    MatrixXd J = random_matrix(random, n, std::max(1, n / 2));
    J -= v * (v.transpose() * J) / v.squaredNorm();
    VectorXd q = random_matrix(random, n, 1);
    q -= (v.dot(q) + 1) / v.squaredNorm() * v;
    const LcpSolution found = lemke(J * J.transpose(), q);
    CHECK(found.status != LcpStatus::solved);
    CHECK(found.z.isZero(0));
  }
}

TEST_CASE("lemke: the residual of a wrong answer is not small") {
  const MatrixXd M = murty(6);
  const VectorXd q = VectorXd::Constant(6, -1);
  VectorXd z = VectorXd::Unit(6, 0);
  CHECK(lcp_residual(M, q, z) == 0);
  z[3] = 0.5;  // presses where it opens
  CHECK(lcp_residual(M, q, z) == 0.5);
  CHECK(lcp_residual(M, q, VectorXd::Zero(6)) == 1);
  CHECK(lemke(M, VectorXd::Ones(6)).z.isZero(0));
  CHECK(lemke(MatrixXd(0, 0), VectorXd(0)).status == LcpStatus::solved);
}

}  // namespace cradle
