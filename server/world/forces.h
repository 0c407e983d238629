/// Forces that belong to a body or to a pair of bodies, not to a command: drag and springs.
#pragma once

#include <cradle/types.h>

#include "server/dynamics/loads.h"

namespace cradle {

/// A spring with damping between a point of body `a` and one of body `b`, or of the world.
struct Spring {
  BodyId a;
  BodyId b;                ///< none: `point_b` is a point of the world
  Vec3 point_a, point_b;   ///< m, from Bo in the body's frame; of the world: in W
  double stiffness = 0;    ///< N/m
  double damping = 0;      ///< N s/m, along the spring
  double rest_length = 0;  ///< m; 0: it damps in every direction
  friend bool operator==(const Spring&, const Spring&) = default;
};

}  // namespace cradle
