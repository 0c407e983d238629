/// When two convex shapes, or one and a half-space, meet on their ways through a tick: by
/// conservative advancement in translation and rotation.
///
/// The unit is a convex part against a convex part. Of compounds each part is asked for alone, with
/// the motion of its body, and the earliest time counts.
#pragma once

#include "server/collision/collider.h"

namespace cradle {

/// Of a body through an interval, whose times are 0 to 1: its centre in a straight line, and a
/// rotation of constant velocity about it, of any number of turns.
struct Path {
  Vector x = Vector::Zero();       ///< the centre at time 0, m, in W
  Vector travel = Vector::Zero();  ///< of the centre until time 1, m, in W
  Vector turn = Vector::Zero();    ///< likewise: rotation vector, rad, in W
  /// rad, before that, about z of its own frame: of a shape that is round about z, where it moves
  /// nothing. Such a body's axis goes round its angular momentum, not round its angular velocity.
  double spin = 0;
  double until = 1;  ///< from then on it rests
};

/// Where what begins at X_WP is at `time`.
Pose moved(const Path& path, const Pose& X_WP, double time);

/// A convex shape, a half-space or a compound of them, where it begins, and the motion of the body
/// that has it. A half-space goes along, but its normal stays: it does not turn. Refers to what it
/// is made of.
struct MovingPart {
  const Collider& start;
  const Path& path;
};

/// How near is a hit, in m, for parts that are `thickness` (half the least width) thin.
struct ImpactLengths {
  double gap = 0;        ///< a hit is where no more than this is left between the parts
  double tolerance = 0;  ///< by how much more may be left
  double deeper = 0;     ///< of parts that touch already, a hit is this much deeper,
  double deepest = 0;    ///< or this deep; or by `gap` deeper if they begin deeper
};

/// Of the thinner of two parts. What has no thickness (a half-space, a triangle) leaves it to the
/// other.
ImpactLengths impact_lengths(double thickness_A, double thickness_B);
struct TimeOfImpact {
  enum class Kind {
    none,   ///< they come no nearer than the gap
    hit,    ///< the gap is reached at `time`
    capped  ///< the search ended at `time`, before which there is no hit; it may have been a miss
  } kind = Kind::none;
  double time = 1;
  Vector normal_W = Vector::UnitZ();  ///< unit, from A to B, at `time`; if hit
  double separation = 0;              ///< m, at `time`; if hit
  double out = 0;  ///< m: parts that are deeper than the deepest at `time` are to part by this
  bool began_touching = false;  ///< nearer than the gap at time 0
  int iterations = 0;
};

/// What counts as a hit.
enum class ImpactGoal {
  touch,   ///< as `gap`, but as near as 2 to 3 % of that: for the normal and arms of the contact
  gap,     ///< the gap, or `deeper` than at the start if they begin nearer than the gap
  contact  ///< `deeper` than touching, or than at the start: for parts that contacts keep apart
};

/// Two half-spaces never meet, nor do two surfaces. A surface and a half-space count as touching
/// from the start: nothing gets past a half-space. Of a surface those triangles count that the
/// other begins in front of, from the front (surface_impact.cpp). In planar worlds shapes are those
/// of planar_pairs.h.
TimeOfImpact time_of_impact(const MovingPart& A, const MovingPart& B,
                            ImpactGoal goal = ImpactGoal::gap, bool is_planar = false);

}  // namespace cradle
