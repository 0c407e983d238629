/// Mass of flat bodies, which move in a plane and turn about its normal: one moment, no tensor.
///
/// Densities are of an area, kg/m^2. The plane is x, y of B.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "server/dynamics/mass_distribution.h"

namespace cradle {

using PlanarVector = Eigen::Vector2d;

struct PlanarMass {
  double mass_kg = 0;
  PlanarVector p_BoBcm = PlanarVector::Zero();  ///< m
  double inertia_kgm2 = 0;                      ///< J_zz about Bcm
};

PlanarMass planar_circle(double radius_m, double density_kgpm2);

/// All within the radius of the segment from -half_length_m to half_length_m on x_B.
PlanarMass planar_capsule(double radius_m, double half_length_m, double density_kgpm2);

/// A mass, or why there is none.
struct MadePlanarMass {
  PlanarMass mass;
  std::string fault;  ///< empty if there is one; goes on after "the polygon"
};

/// Of a simple polygon, convex or not, its corners counter-clockwise. Refuses fewer than three
/// corners, more than 4096, those that are not finite, no area, clockwise order and edges that
/// cross or touch.
MadePlanarMass planar_polygon(std::span<const PlanarVector> corners, double density_kgpm2);

/// The same body turned by `angle_rad` and shifted.
PlanarMass posed(const PlanarMass& part, const PlanarVector& shift, double angle_rad);

/// All of them together. None: zero.
PlanarMass sum(std::span<const PlanarMass> parts);

/// The mass of a shape of the plane, a disc, rectangle, capsule along x_B, polygon or compound of
/// them: 1 m deep, a box by its third half extent. `density_kgpm3` is that of a solid; the parts of
/// a compound have densities of their own, times it. Zero for other shapes.
PlanarMass planar_mass(const Shape& shape, const StoredGeometry* geometry, double density_kgpm3);

/// As of a solid that has this moment about every axis, which is what a planar world asks for.
MassDistribution as_solid(const PlanarMass& mass);

/// With another mass, spread alike: the moment scales with it.
PlanarMass with_mass(const PlanarMass& spread, double mass_kg);

}  // namespace cradle
