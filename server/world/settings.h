/// What a world is told once, at its making.
#pragma once

#include <cradle/limits.h>
#include <cradle/types.h>

#include <string>

namespace cradle {

struct WorldSettings {
  double rate_hz = 60;  ///< ticks a second; dt = 1 / rate
  /// m, what a contact may sink in under a load that lasts, or in a tick in which the bodies of its
  /// island move farther: each island of touching bodies takes as many sub-steps as that asks for.
  double contact_tolerance_m = 0.0005;
  int sub_steps =
      0;  ///< of a tick, for all bodies in contact, if not 0; up to limits::kSubStepsMax
  /// While contacts close fast, look for them twice in a tick, half way, too: see tick_parts.h.
  bool collides_twice = false;
  Vec3 gravity_W{0, 0, -9.81};  ///< m/s^2; without z in a planar world
  bool is_planar = false;       ///< bodies stay in z = 0 and turn about z: see plane.h
  bool is_sleeping = true;      ///< islands at rest fall asleep: see sleeping.h
  /// Ticks from one balance of energy and momentum to the next (StepBalance), 0: never.
  int balance_every = 8;
  bool balance_flight = false;  ///< bodies that only fly are part of it, too
  int lanes = 0;  ///< bodies that fly side by side: one of machine_lanes(), 0: the most
  std::string solver = "hybrid";  ///< a name of solver_names()
  std::string scheme = "exact";   ///< of bodies in free flight: a name of scheme_names()
  /// The full model: each free body goes through every term of its equations, at four times the
  /// rate that the fastest of them needs. To compare with; `cradled explain` bounds the difference.
  bool is_full = false;
  /// A name of broad_phase_names(). All find the same pairs: it is no part of the hash.
  std::string broad_phase = "kept";
  std::int64_t bodies_max = limits::kBodies;
  std::int64_t wrenches_max = limits::kWrenches;
};

}  // namespace cradle
