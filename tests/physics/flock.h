/// Bodies for the functions of free flight, without a world.
#pragma once

#include <cstring>
#include <random>
#include <vector>

#include "server/dynamics/free_flight.h"

namespace cradle {

struct Flock {
  std::vector<Course> course;
  std::vector<Vector> x, v, w, inertia, inverse_inertia, acceleration, torque_W, torque_P;
  std::vector<Rotation> q;
  std::vector<std::uint8_t> lost;

  /// At rest at the origin. Zero moments: a point.
  std::size_t add(Course how, const Vector& J) {
    course.push_back(how);
    for (auto* zero : {&x, &v, &w, &acceleration, &torque_W, &torque_P}) {
      zero->push_back(Vector::Zero());
    }
    inertia.push_back(J);
    inverse_inertia.push_back(J.isZero(0) ? Vector(Vector::Zero()) : Vector(J.cwiseInverse()));
    q.push_back(Rotation::Identity());
    lost.push_back(0);
    return size() - 1;
  }
  std::size_t size() const { return x.size(); }

  FlightArrays arrays() {
    return {course, x, q, v, w, inertia, inverse_inertia, acceleration, torque_W, torque_P, lost};
  }
  void fly(const FlightTick& tick, int ticks = 1) {
    for (int i = 0; i < ticks; ++i) fly_all(tick, arrays(), 0, static_cast<int>(size()));
  }

  Vector w_B(std::size_t i) const { return q[i].conjugate() * w[i]; }
  double energy(std::size_t i) const { return inertia[i].dot(w_B(i).cwiseAbs2()) / 2; }
  Vector angular_momentum(std::size_t i) const { return q[i] * inertia[i].cwiseProduct(w_B(i)); }
};

inline bool same_bits(const Flock& a, const Flock& b) {
  const auto same = [](const auto& one, const auto& other) {
    return one.size() == other.size() &&
           std::memcmp(one.data(), other.data(), one.size() * sizeof(one[0])) == 0;
  };
  return same(a.x, b.x) && same(a.q, b.q) && same(a.v, b.v) && same(a.w, b.w) &&
         same(a.lost, b.lost);
}

inline double uniform(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * std::ldexp(static_cast<double>(random() >> 11), -53);
}
inline Vector random_vector(std::mt19937_64& random, double size) {
  return {uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
}

/// Moments of a box with edges of 1 .. 12, log-uniform, or of a rod 1 : 1 : 14: ratios to 100 : 1.
/// One in six has two equal.
inline Vector random_inertia(std::mt19937_64& random) {
  Vector edges = random_vector(random, 0.5) + Vector::Constant(0.5);
  for (double& edge : edges) edge = std::pow(12, edge);
  const std::uint64_t kind = random() % 6;
  if (kind == 0) edges.y() = edges.x();
  if (kind == 1) edges = {1, 14, 1};
  const Vector squares = edges.cwiseAbs2();
  return (Vector::Constant(squares.sum()) - squares) / 12;
}

/// A direction; for one in four near an axis.
inline Vector random_axis(std::mt19937_64& random) {
  Vector axis;
  do axis = random_vector(random, 1);
  while (axis.norm() > 1 || axis.norm() < 0.1);
  if (random() % 4 == 0) {
    axis *= 1e-2;
    axis[static_cast<Eigen::Index>(random() % 3)] = 1;
  }
  return axis.normalized();
}

}  // namespace cradle
