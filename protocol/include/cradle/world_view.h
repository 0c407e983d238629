/// What a world tells about itself: its status and its events.
#pragma once

#include <cradle/result.h>
#include <cradle/types.h>

#include <cstdint>
#include <string>

namespace cradle {

/// Heartbeat of a world, twice a second.
struct WorldStatus {
  std::int32_t protocol_version = 0;
  bool paused = false;
  bool lockstep = false;          ///< steps only on a step command
  bool overloaded = false;        ///< ticks take longer than they should: time runs slow
  bool controllable = false;      ///< clients may pause, resume and step
  bool contested = false;         ///< the server has heard another one of the same world
  std::int64_t epoch = 0;         ///< random number of this run of the server
  Tick tick = 0;                  ///< steps done since its start
  std::int64_t tick_time_us = 0;  ///< simulated time, us
  double rate_hz = 0;
  double real_time_factor = 0;  ///< simulated over wall time, over the last second
  std::int64_t bodies = 0;
  std::int64_t contacts = 0;
  std::int64_t clients = 0;
  std::int64_t wrenches = 0;
  double apply_us = 0;  ///< mean wall time a tick, by phase, over the last period
  double collide_us = 0;
  double solve_us = 0;
  double publish_us = 0;
  double penetration_max_m = 0;
  double penetration_mean_m = 0;
  std::int64_t islands = 0;  ///< groups of bodies in contact with each other, in the last tick
  std::int32_t sub_steps_max = 0;  ///< of an island, in it
  double sag_expected_m = 0;       ///< of the most loaded contact, by the loads that last
  /// How far contact impulses were from the laws of contact at its end, each of the worst point.
  double residual_mps = 0;       ///< natural map
  double residual_relative = 0;  ///< of all points, by their impulses and velocities
  double residual_signorini_mps = 0;
  double residual_cone_mps = 0;
  double residual_complementarity_J = 0;
  Tick balance_tick = 0;  ///< the tick of what follows: every so many have a balance; 0: none yet
  double kinetic_change_J = 0;  ///< of bodies in contact: the sum of the next six
  double work_gravity_J = 0;    ///< done on the bodies: below 0 where it is taken
  double work_wrenches_J = 0;
  double work_friction_J = 0;
  double work_impacts_J = 0;  ///< by normal impulses
  double work_driven_J = 0;   ///< by kinematic bodies
  double energy_unaccounted_J = 0;
  double momentum_unaccounted_Ns = 0;
  std::int32_t impacts = 0;  ///< of flying balls, in the last tick
  std::int64_t overruns = 0;
  std::int64_t commands_applied = 0;
  std::int64_t commands_refused = 0;
  std::int64_t datagrams_rejected = 0;
  std::int64_t datagrams_dropped = 0;
  std::int64_t chunks_dropped = 0;
  std::int64_t quarantined = 0;
  std::int32_t state_port = 0;
  std::int32_t datagram_bytes = 0;
  std::int32_t receive_buffer_bytes = 0;
  std::string name;
  friend bool operator==(const WorldStatus&, const WorldStatus&) = default;
};

enum class EventKind : std::int32_t {
  spawned = 0,
  removed = 1,
  quarantined = 2,
  described = 3,  ///< not news: told again for a client that came later
  slept = 4,      ///< at rest: neither moves nor costs anything until it wakes
  woke = 5,
};

/// Something that happened to a body.
struct Event {
  EventKind kind = EventKind::spawned;
  BodyId body;
  std::int64_t client = 0;     ///< who asked for it; 0: the scene, or the server itself
  Tick tick = 0;               ///< the first tick whose state shows it
  Result reason = Result::ok;  ///< quarantined: not_finite or out_of_range
  BodyKind body_kind = BodyKind::dynamic;
  Shape shape;
  double mass_kg = 0;  ///< 0: does not yield
  Vec3 p_BoBcm;        ///< m, in B: where v_WBcm is measured
  std::string name;
  friend bool operator==(const Event&, const Event&) = default;
};

}  // namespace cradle
