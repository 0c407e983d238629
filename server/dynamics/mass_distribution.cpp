#include "server/dynamics/mass_distribution.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "server/dynamics/rotation.h"

namespace cradle {

Matrix point_inertia(const Vector& r) {
  return r.squaredNorm() * Matrix::Identity() - r * r.transpose();
}

MassDistribution posed(const MassDistribution& in_P, const Vector& p_BoPo, const Rotation& q_BP) {
  const Matrix R = normalised(q_BP).toRotationMatrix();
  return {in_P.mass_kg, p_BoPo + R * in_P.p_BoBcm, R * in_P.G * R.transpose()};
}

MassDistribution sum(std::span<const MassDistribution> parts) {
  MassDistribution whole;
  for (const MassDistribution& part : parts) whole.mass_kg += part.mass_kg;
  if (!(whole.mass_kg > 0)) return {};
  for (const MassDistribution& part : parts) {
    whole.p_BoBcm += part.mass_kg / whole.mass_kg * part.p_BoBcm;
  }
  for (const MassDistribution& part : parts) {
    const Matrix away = point_inertia(part.p_BoBcm - whole.p_BoBcm);
    whole.G += part.mass_kg / whole.mass_kg * (part.G + away);
  }
  return whole;
}

namespace {

// Relative to the largest element. Products of inertia below the first are rounding: the axes of B
// are principal. Moments closer than the second are equal, and then any axis between them is as
// principal; both cost no more than that in the tensor.
constexpr double kRoundingOfProducts = 1e-13;
constexpr double kEqualMoments = 1e-13;

/// The rotation that turns the unit vector `from` the shortest way to `to`.
Matrix shortest_turn(const Vector& from, const Vector& to) {
  const Vector axis = from.cross(to);
  const Matrix K =
      (Matrix() << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0)
          .finished();
  return Matrix::Identity() + K + K * K / (1 + from.dot(to));
}

/// Columns in the order and with the signs that bring them next to the axes of B, right-handed.
Matrix nearest_to_axes(const Matrix& V, std::array<int, 3>& order) {
  std::array<int, 3> candidate{0, 1, 2};
  double best = -1;
  do {
    const double trace =
        std::abs(V(0, candidate[0])) + std::abs(V(1, candidate[1])) + std::abs(V(2, candidate[2]));
    if (trace > best) {
      best = trace;
      order = candidate;
    }
  } while (std::next_permutation(candidate.begin(), candidate.end()));
  Matrix R;
  for (int k = 0; k < 3; ++k) R.col(k) = V.col(order[static_cast<std::size_t>(k)]);
  for (int k = 0; k < 3; ++k) {
    if (R(k, k) < 0) R.col(k) = -R.col(k);
  }
  if (R.determinant() < 0) {
    int least = 0;
    R.diagonal().minCoeff(&least);
    R.col(least) = -R.col(least);
  }
  return R;
}

/// If two moments are equal, the axis of the third decides alone: the shortest turn to it from its
/// axis of B. The two others are then those of B, turned along.
void settle_symmetry(const Vector& moments, Matrix& R) {
  const double tolerance = kEqualMoments * moments.cwiseAbs().maxCoeff();
  for (int k = 0; k < 3; ++k) {
    if (std::abs(moments((k + 1) % 3) - moments((k + 2) % 3)) > tolerance) continue;
    const Vector axis = R.col(k);
    R = shortest_turn(Vector::Unit(k), axis);
    return;
  }
}

}  // namespace

PrincipalAxes principal_axes(const Matrix& J_B) {
  PrincipalAxes axes;
  axes.moments = J_B.diagonal();
  const double products = std::max({std::abs(J_B(0, 1)), std::abs(J_B(0, 2)), std::abs(J_B(1, 2))});
  if (!(products > kRoundingOfProducts * J_B.cwiseAbs().maxCoeff())) return axes;

  const Eigen::SelfAdjointEigenSolver<Matrix> solver(J_B);
  std::array<int, 3> order{};
  Matrix R = nearest_to_axes(solver.eigenvectors(), order);
  for (int k = 0; k < 3; ++k) {
    axes.moments(k) = solver.eigenvalues()(order[static_cast<std::size_t>(k)]);
  }
  settle_symmetry(axes.moments, R);
  axes.q_BP = normalised(Rotation(R));
  axes.are_of_B = false;
  return axes;
}

}  // namespace cradle
