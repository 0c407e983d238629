/// Mass, centre of mass and inertia of a scene's bodies, by formulas of the benchmark's own.
#pragma once

#include "server/collision/geometry.h"
#include "server/scene.h"

namespace cradle::bench {

struct BodyMass {
  double mass_kg = 0;
  Vector p_BoBcm = Vector::Zero();  ///< m, in B
  Matrix J_kgm2 = Matrix::Zero();   ///< about Bcm along the axes of B
};

/// What the scene gives, and else what its shape has.
BodyMass mass_of(const Scene& scene, const BodySpec& body);

}  // namespace cradle::bench
