/// Whose loads have just changed, so that its contacts will not carry what they did.
#pragma once

#include <cstdint>
#include <vector>

#include "server/world/world.h"

namespace cradle {

/// Of a body that wrenches act on.
struct BodyLoad {
  std::int64_t id = 0;
  Vector acceleration = Vector::Zero();  ///< m/s^2, in W, beyond gravity's
  Vector torque = Vector::Zero();        ///< N m, in W
};

/// What loads were in the tick before.
struct PastLoads {
  Vector gravity_W = Vector::Zero();
  std::vector<BodyLoad> pushed;  ///< ascending ids
};

/// Lists the slots of bodies whose loads are not those of the tick before (stirred), and by more
/// than a twentieth (shaken), and keeps this tick's. After Steps::list_contacts.
void find_shaken(World::State& s);

}  // namespace cradle
