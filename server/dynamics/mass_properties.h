/// Mass and inertia of a body, from the density integral over its shape and what overrides it.
#pragma once

#include <cradle/result.h>

#include "server/dynamics/mass_distribution.h"

namespace cradle {

/// About the centre of mass Bcm, along principal axes P. Zero inverses: infinite.
struct MassProperties {
  double mass_kg = 0;
  double inverse_mass = 0;               ///< 1/kg
  Vector inertia_kgm2 = Vector::Zero();  ///< principal moments J of a body that can turn
  Vector inverse_inertia = Vector::Zero();
  Vector p_BoBcm = Vector::Zero();       ///< m, in B
  Rotation q_BP = Rotation::Identity();  ///< turns vectors of P into B
  bool is_offset = false;                ///< the frames differ: Bcm is not Bo, or P is not B
};

/// For static and kinematic bodies all is infinite, and Bcm is Bo. A given mass overrides the
/// density, given moments override the shape's, a given centre of mass moves the mass without
/// changing the moments about it. A dynamic body without shape and moments is a point: it does not
/// turn. `stored` is what the body's stored geometry has at density 1, null for other shapes.
/// Refuses with bad_mass, bad_shape or out_of_range what no rigid body has.
Result mass_properties(const BodySpec& spec, const MassDistribution* stored,
                       MassProperties& properties);

}  // namespace cradle
