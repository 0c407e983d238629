/// How mass is spread over a body: what its motion needs of it, and what adds up over parts.
#pragma once

#include <span>

#include "server/collision/stored_geometry.h"

namespace cradle {

/// Mass, first and second moments. B is the frame of the body, Bo its origin.
struct MassDistribution {
  double mass_kg = 0;
  Vector p_BoBcm = Vector::Zero();  ///< centre of mass, m, in B
  Matrix G = Matrix::Zero();        ///< inertia of a kilogram about Bcm along the axes of B, m^2

  Matrix inertia_kgm2() const { return mass_kg * G; }
};

/// The inertia about a point at `r` from a kilogram that is all in one place: |r|^2 1 - r r^T. The
/// parallel axis theorem adds it to the inertia about the centre of mass.
Matrix point_inertia(const Vector& r);

/// The same distribution in a frame P of another body B, as B sees it.
MassDistribution posed(const MassDistribution& in_P, const Vector& p_BoPo, const Rotation& q_BP);

/// All of them together. None: zero.
MassDistribution sum(std::span<const MassDistribution> parts);

/// Of constant density, above 0: by closed forms. No mass for shapes that are no solid, and for
/// stored ones.
MassDistribution mass_distribution(const Shape& shape, double density_kgpm3);

/// Of a hull or a closed mesh of constant density, by the exact integrals of polyhedra; of a
/// compound, whose parts have densities of their own, times `density_kgpm3` all the same. An open
/// mesh has no mass.
MassDistribution mass_distribution(const StoredGeometry& geometry, double density_kgpm3);

/// The directions in which a tensor is diagonal, as a frame P.
struct PrincipalAxes {
  Rotation q_BP = Rotation::Identity();  ///< right-handed
  Vector moments = Vector::Zero();       ///< along the axes of P
  bool are_of_B = true;                  ///< q_BP is the identity
};

/// Principal axes of a symmetric tensor in B: of all choices the one next to the axes of B, so that
/// a body that is symmetric along them keeps them, and the same bits for the same tensor.
PrincipalAxes principal_axes(const Matrix& J_B);

}  // namespace cradle
