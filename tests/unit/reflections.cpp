// Simultaneous impacts at the level of velocities: energy, momentum, symmetry, for the sets that a
// tick may meet. References: conservation laws; the outcomes of Smith et al. (2012), section 3.
#include "server/dynamics/impact/reflections.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "tests/unit/trials.h"

namespace cradle {
namespace {

using Eigen::Index;

/// J M^-1 J^T of a chain of bodies on a line, the first contact with a wall if `has_wall`.
ImpactMatrix chain(const std::vector<double>& masses, bool has_wall) {
  const auto n = static_cast<Index>(masses.size()) - (has_wall ? 0 : 1);
  ImpactMatrix A = ImpactMatrix::Zero(n, n);
  const auto inverse = [&](Index body) {
    return body < 0 ? 0 : 1 / masses[static_cast<std::size_t>(body)];
  };
  for (Index k = 0; k < n; ++k) {
    const Index right = has_wall ? k : k + 1;
    A(k, k) = inverse(right - 1) + inverse(right);
    if (k > 0) A(k, k - 1) = A(k - 1, k) = -inverse(right - 1);
  }
  return A;
}

/// What the impulses do to the kinetic energy, J.
double energy_change(const ImpactMatrix& A, const ImpactVector& b, const ImpactVector& l) {
  return l.dot(b) + 0.5 * l.dot(A * l);
}

/// The sizes of what is summed there, J: rounding is a small part of it.
double energy_scale(const ImpactMatrix& A, const ImpactVector& b, const ImpactVector& l) {
  return l.dot(b.cwiseAbs()) + l.dot(A.cwiseAbs() * l);
}

}  // namespace

TEST_CASE("a cradle of five passes on what comes in") {
  const ImpactMatrix A = chain({1, 1, 1, 1, 1}, false);
  ImpactVector b(4), after(4);
  b << -1, 0, 0, 0;
  after << 0, 0, 0, 1;  // 1 0 0 0 0 becomes 0 0 0 0 1
  CHECK((reflect(A, b, ImpactVector::Ones(4)).velocities - after).norm() < 1e-12);
  b << 0, -1, 0, 0;
  after << 0, 0, 1, 0;  // 1 1 0 0 0 becomes 0 0 0 1 1
  CHECK((reflect(A, b, ImpactVector::Ones(4)).velocities - after).norm() < 1e-12);
}

TEST_CASE("a ball that strikes two at once leaves both alike") {
  // Closed form for three equal balls in a triangle, the cue along its axis: the cue keeps -1/5,
  // each other gets 2 sqrt(3) / 5 along its normal.
  ImpactMatrix A(2, 2);
  A << 2, 0.5, 0.5, 2;
  const double vn = -std::sqrt(3) / 2;
  ImpactVector b(2);
  b << vn, vn;
  const Reflection r = reflect(A, b, ImpactVector::Ones(2));
  CHECK(std::abs(r.impulses[0] - 2 * std::sqrt(3) / 5) < 1e-13);
  CHECK(std::abs(r.impulses[0] - r.impulses[1]) < 1e-15);
}

TEST_CASE("equal restitution 1 keeps the energy of any chain") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(-1.5, 1.5), speed(-1, 1);
  for (int trial = 0; trial < trials(5000); ++trial) {
    std::vector<double> masses(2 + static_cast<std::size_t>(trial) % 12);
    for (double& m : masses) m = std::pow(10, exponent(random));
    const ImpactMatrix A = chain(masses, trial % 2 == 0);
    ImpactVector b(A.rows());
    for (double& v : b) v = speed(random);
    const Reflection r = reflect(A, b, ImpactVector::Ones(b.size()));
    INFO("trial " << trial << ", " << r.rounds << " rounds");
    REQUIRE(r.impulses.minCoeff() >= 0);
    REQUIRE(r.velocities.minCoeff() >= -1e-9);
    if (r.is_elastic) {
      REQUIRE(std::abs(energy_change(A, b, r.impulses)) <= 1e-12 * energy_scale(A, b, r.impulses));
    }
  }
}

TEST_CASE("pressed chains of mixed restitution never gain energy") {
  // Without the scale of energy_scale() half of them do, up to a thousand times what they had.
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> exponent(-1.5, 1.5), speed(-1, 0.2);
  const double all_e[] = {0, 0.5, 1};
  for (int trial = 0; trial < trials(30000); ++trial) {
    std::vector<double> masses(2 + static_cast<std::size_t>(trial) % 3);
    for (double& m : masses) m = std::pow(10, exponent(random));
    const ImpactMatrix A = chain(masses, true);
    ImpactVector b(A.rows()), e(A.rows());
    for (double& v : b) v = speed(random);
    for (double& one : e) one = all_e[random() % 3];
    const Reflection r = reflect(A, b, e);
    INFO("trial " << trial);
    REQUIRE(energy_change(A, b, r.impulses) <= 1e-12 * energy_scale(A, b, r.impulses));
    REQUIRE(r.impulses.minCoeff() >= 0);
    REQUIRE(r.velocities.minCoeff() >= -1e-9);
  }
}

TEST_CASE("sets with more contacts than they have freedom come to an end") {
  // Normals in a space of six dimensions: up to 32 contacts on one or two rigid bodies.
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < trials(2000); ++trial) {
    const Index n = 2 + trial % (kReflectedTogether - 1);
    Eigen::MatrixXd J(n, 6);
    for (double& x : J.reshaped()) x = normal(random);
    J.col(0) = J.col(0).cwiseAbs();  // a motion exists that opens all of them
    const ImpactMatrix A = J * J.transpose();
    Eigen::VectorXd v(6);
    for (double& x : v) x = normal(random);
    v[0] = -std::abs(v[0]);
    const ImpactVector b = J * v;
    const double e = trial % 3 / 2.0;
    const Reflection r = reflect(A, b, ImpactVector::Constant(n, e));
    INFO("trial " << trial << ", " << n << " contacts, " << r.rounds << " rounds");
    REQUIRE(r.impulses.minCoeff() >= 0);
    REQUIRE(r.velocities.minCoeff() >= -1e-6 * b.norm());
    REQUIRE(energy_change(A, b, r.impulses) < 1e-9 * v.squaredNorm());
  }
}

}  // namespace cradle
