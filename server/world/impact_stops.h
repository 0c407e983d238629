/// The last look at fast bodies (fast_bodies.h): no tick ends with one inside another, or beyond.
///
/// Bodies that stop change what others hit. So pairs are looked at anew until nothing changes, in
/// the order of slots; bodies whose pairs still change after kSweepsMax sweeps stay where the tick
/// began, and are counted. A stop only ever shortens a way, but for a push out of what it is in too
/// deep. Static, kinematic and slow bodies never
/// stop: a slow one cannot get past a fast one that has stopped. What a kinematic body hits goes
/// along with it from there, also where another has stopped it before: else that would pass over
/// it.
///
/// A body that flew has the velocity it had when it stopped; one in contact, which has had its
/// impulses, keeps the one it has. What loads have given it on the way that it did not go is taken
/// from that, their work or, if it is less, their impulse: so neither adds energy.
#pragma once

#include <cstdint>
#include <vector>

#include "server/collision/broad_phase.h"
#include "server/collision/executor.h"
#include "server/collision/time_of_impact.h"
#include "server/world/world.h"

namespace cradle {

/// What that look works with: made anew in each tick, in memory that is kept.
struct ImpactStops {
  /// A fast dynamic body, and the way it went.
  struct Mover {
    std::size_t slot;
    Path path;  // `until` is where it stops
    bool flew_fast;
    Vector v_start, w_start;      // if so: before it moved
    std::int32_t carrier = -1;    // slot of the kinematic body that it goes along with,
    double carried_from = 0;      // of the tick
    Vector out = Vector::Zero();  // m: away from what stops it
  };

  struct Candidate {
    BodyPair pair;
    ImpactGoal goal;
    Path A, B;
    bool is_open = true;  // to be looked at
    double time = 1;      // of the hit that was found
  };

  std::vector<std::uint8_t> went_far;  ///< of those in contact, in their order
  std::vector<Mover> movers;           ///< ascending
  std::vector<Candidate> candidates;
  std::vector<std::size_t> leavers;  ///< places among the colliders
  std::vector<BodyPair> pairs;       ///< of them
  std::vector<std::size_t> open;     ///< candidates
  std::vector<TimeOfImpact> found;   ///< of them
  std::vector<std::int32_t> stopped;
};

/// After all have moved.
void stop_at_impacts(World::State& s, Executor& executor);

}  // namespace cradle
