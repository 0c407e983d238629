/// Bodies that move so far in a tick that they could pass through others: further than half the
/// least width of their shape, in translation or rotation.
///
/// Three places of a step know them. The broad phase gets boxes that hold them on their way, in
/// rotation, too. Before contacts are prepared, each pair with a fast body that does not touch yet
/// is looked at along the way that both will go (time_of_impact.h): what misses has no contact,
/// however near it comes; what hits has the contact of the poses where it hits, so that the contact
/// acts in the same tick, with the normal and the arms that it will have. And when all have moved,
/// the ways they went are looked at again: a fast body that would be inside another, or beyond it,
/// stops on its own side, keeps its velocity, and loses the rest of the tick. So it is with what
/// could not be foreseen: a second hit in one tick, a body struck by a fast one. A body stops for
/// one that touches it already only if it would be much deeper in it than before.
///
/// That last look is in impact_stops.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/collision/broad_phase.h"
#include "server/collision/time_of_impact.h"
#include "server/dynamics/contact/contact_constraint.h"
#include "server/world/world.h"

namespace cradle {

/// Of a collider: what makes its body fast.
struct FastLimits {
  double thickness = 0;    ///< m, half the least width
  double reach = 0;        ///< m, from Bcm to the farthest point
  double turn_radius = 0;  ///< m, of what rotation about Bo moves; 0: nothing
  double unevenness = 0;   ///< m: reach R about Bo less thickness r, what a turn may bring nearer
  double turn_lever = 0;   ///< m: what touches is r or more from Bo along the normal, and so comes
                           ///< no faster than by |w| sqrt(R^2 - r^2)
  bool is_round = false;   ///< about z: spin about it moves nothing
};

/// Where two bodies will touch, if their manifold is not that of the tick's start.
struct Meeting {
  std::size_t pair = 0;  ///< index of pair and manifold
  double time = 0;       ///< of the tick
  Path A, B;
  /// 1/(kg m^2), in W, at the attitudes that they will have: turn_inertia
  Matrix inverse_inertia_A = Matrix::Zero(), inverse_inertia_B = Matrix::Zero();
};

/// What a tick knows of fast bodies; made anew in each.
struct FastBodies {
  std::vector<FastLimits> limits;        ///< by slot, of colliders
  std::vector<std::uint8_t> is_fast;     ///< by slot, of colliders
  std::vector<std::int32_t> slots;       ///< of fast dynamic bodies, ascending
  std::vector<Vector> v_start, w_start;  ///< of them: before they moved
  bool any = false;                      ///< kinematic bodies included
  std::vector<Meeting> meetings;         ///< ascending
  std::vector<TimeOfImpact> found;       ///< of the pairs with fast bodies; memory that is kept
  std::int64_t searches = 0;             ///< for a time of impact, of this tick
  int stopped = 0;                       ///< bodies at their time of impact
  int unresolved = 0;                    ///< searches that ended early, and bodies that stayed
};

/// The colliders are others now.
void measure_fast_limits(World::State& s);
void begin_fast_bodies(World::State& s);
/// m: how much nearer to others its spin may bring the body's surface in this tick.
double nearer_by_turning(const World::State& s, std::size_t i);
/// Takes note if a body is fast; of that body alone, so that many may be looked at side by side.
void note_if_fast(World::State& s, std::size_t slot);
/// Likewise; and the box of a collider over the tick.
Aabb box_over_tick(World::State& s, std::size_t slot);
/// Then, of those that are, one after the other, ascending.
void list_fast(World::State& s, std::size_t slot);
/// Whether two bodies, fast ones among them, touch or will on the ways that they are expected to
/// go.
bool is_hit_expected(const World::State& s, const BodyPair& pair);
/// Replaces the manifolds of pairs with fast bodies that do not touch yet.
void foresee_impacts(World::State& s, Executor& executor);
/// Of the bodies that meet, once theirs is known in W.
void turn_inertia(World::State& s);
/// Overwrites `c` with the constraint of a manifold of a meeting, after that.
void set_constraint(ContactConstraint& c, const Meeting& meeting, const Manifold& manifold,
                    World::State& s);

// For impact_stops.cpp, when all have moved: s.poses still has where they began.

/// The way that a body went. `w_start` tells, with the velocity it has now, how many turns it made.
Path travelled(const World::State& s, std::size_t slot, const Vector& w_start);
bool is_far(const World::State& s, std::size_t slot, const Path& path);
/// Holds a collider on its whole way. In rotation the boxes of its ends may not hold what is
/// between, but that is at most |turn|^2 reach / 8 beyond both, and never beyond the reach.
Aabb box_of_path(const World::State& s, std::size_t slot, const Path& path);
/// Of bodies of several parts, the earliest time of any two.
TimeOfImpact meet(const World::State& s, std::size_t a, const Path& A, std::size_t b, const Path& B,
                  ImpactGoal goal);
void count(FastBodies& fast, const TimeOfImpact& found);

}  // namespace cradle
