/// Mass and inertia of a body from the density integral over its shape.
#pragma once

#include <cradle/result.h>

#include "server/collision/geometry.h"

namespace cradle {

/// About the centre of mass, along the axes of B, which are principal. Zero inverses: infinite.
struct MassProperties {
  double mass_kg = 0;
  double inverse_mass = 0;               ///< 1/kg
  Vector inertia_kgm2 = Vector::Zero();  ///< principal moments J of a body that can turn
  Vector inverse_inertia = Vector::Zero();
};

/// For static and kinematic bodies all is infinite. A given mass overrides the density, given
/// moments override the shape's. A dynamic body without shape and moments is a point: it does not
/// turn. Refuses with bad_mass or out_of_range what no rigid body has.
Result mass_properties(const BodySpec& spec, MassProperties& properties);

}  // namespace cradle
