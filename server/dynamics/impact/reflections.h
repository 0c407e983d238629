/// Contacts that are struck at once: generalised reflections. The method is described in
/// reflections.cpp.
#pragma once

#include <Eigen/Core>

namespace cradle {

/// More contacts at once are not solved together: their matrices cost n^3.
inline constexpr int kReflectedTogether = 32;

using ImpactMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                   kReflectedTogether, kReflectedTogether>;
using ImpactVector =
    Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kReflectedTogether, 1>;

struct Reflection {
  ImpactVector impulses;    ///< N s, along the normals; none is negative
  ImpactVector velocities;  ///< m/s, along the normals, afterwards; none approaches
  int rounds = 0;
  /// False if rounds ran out, as when many bodies come to rest on each other: the last one was
  /// without restitution then.
  bool is_elastic = true;
};

/// `A` = J M^-1 J^T (1/kg), symmetric, semidefinite; `b` the normal velocities before (m/s,
/// negative: approaching); `e` the restitution of each contact, 0 to 1. At most kReflectedTogether
/// contacts. Kinetic energy never rises.
Reflection reflect(const ImpactMatrix& A, const ImpactVector& b, const ImpactVector& e);

}  // namespace cradle
