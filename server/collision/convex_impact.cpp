// Conservative advancement (Mirtich 1996, "Impulse-based Dynamic Simulation", 2.3; for convex
// shapes in rotation Tang, Kim and Manocha 2009, "C2A", section 4), with the idea of Box2D's time
// of impact: look along one direction from both ends of an interval.
//
// Symbols, time 0 to 1: n unit vector from A to B; s(t) the separation along the fixed n, from the
// support functions h of both shapes at their poses at t,
//   s(t) = -h_B(-n) - h_A(n),
// which no pose makes larger than the distance; c the way of B's centre less that of A's, w the
// rotation vector of a body, a the arm from its centre to the part's origin (across w), r the
// radius of the part's core about its origin.
// Bounds. A point of a body moves along n by w x p . n <= |n x w| |p|, so s falls no faster than
//   L = -min(0, c . n) + sum over A and B of |n x w| |a| + min(|n x w|, |w_o|) r,
// and s'' of every point is at least -M,
//   M = sum over A and B of |w| |n x w| (|a| + r).
// Of shapes that are round about z only w_o, the part of w across z, moves the surface. From n and
// s at the distance's own direction the time may be advanced safely
//   by (s - goal) / L, and
//   by tau, the least root of s(t) + (s(t + D) - s(t)) tau / D - M tau (D - tau) / 2 = goal:
// over D no function of s'' >= -M is less than the chord less this parabola, and the largest of
// such functions is not either, hence nor -s. D is what makes the parabola at most s - goal deep.
// Where we differ: the second bound. Without it a rod that just misses a wall takes a step of its
// gap's length after the other, hundreds of them (pi sqrt(2 r / gap)); with it about ten, and
// motion without rotation against a face one.
//
// Guarantees: before the time told, the parts are nowhere nearer than the gap, up to rounding; a
// pair that begins nearer than that is nowhere deeper than `deeper` below where it began. The
// search ends after kAdvancesMax at a time that is safe as well: conservative, and told.
// Overlap at the start is measured by least_overlap: its faults (see there) can make an early hit,
// never a late one.
// Cost: an iteration is a search for closest points and two support points: 0.2 .. 1.5 us.
#include "server/collision/convex_impact.h"

#include <cmath>

#include "server/collision/convex_pair.h"
#include "server/collision/extents.h"
#include "server/collision/planar_pairs.h"
#include "server/collision/planar_shape.h"

namespace cradle {
namespace {

constexpr int kAdvancesMax = 200;  // a rod that grazes at 60 rad/s took more than 100

/// Of the thickness of the thinner part. Test: "a bullet stops before the wall".
constexpr double kGapShare = 0.02;
constexpr double kGapMax_m = 5e-4;  // well within the margin of contacts
constexpr double kTouchShare = 0.02;
constexpr double kToleranceShare = 0.5;  // of the gap; less makes more iterations
constexpr double kDeeperShare = 0.25;  // so that two ticks of it are far from the middle of a wall
/// So that all ticks of it are: a needle whose ends strike in turn gains on its contacts. Test: "a
/// needle that rattles on a surface stays in front of it".
constexpr double kDeepestShare = 0.5;
/// What gets deeper still, by a gap in each tick, is put out by this many gaps: else what spins in
/// a groove goes through in the end. Test: "what spins in a groove does not get deeper".
constexpr double kOutOfGap = 2;

bool is_half_space(const MovingPart& part) {
  return part.start.shape.kind == ShapeKind::half_space;
}

bool is_round(ShapeKind kind) {
  return kind == ShapeKind::capsule || kind == ShapeKind::cylinder || kind == ShapeKind::cone;
}

/// A shape of the plane, where it is.
PlanarShape in_plane(const Collider& collider, const Pose& X) {
  return {{collider.shape, X, collider.geometry}, Vector::Zero()};
}

/// What bounds the motion of a part's surface.
struct Rates {
  const Path& path;
  double w = 0;    // |w|, 0 for half-spaces
  double w_o = 0;  // of it what moves the surface
  double arm = 0, radius = 0;

  Rates(const MovingPart& part, bool is_planar) : path(part.path) {
    if (is_half_space(part)) return;
    const Pose& X = part.start.X_WB;
    w = path.turn.norm();
    w_o = is_round(part.start.shape.kind) && !is_planar ? path.turn.cross(X.R.col(2)).norm() : w;
    if (!(w > 0)) return;
    arm = (X.x - path.x).cross(path.turn).norm() / w;
    radius = reach(part.start, Vector::Zero());
    radius -= is_planar ? in_plane(part.start, X).radius : ConvexShape(part.start).radius;
  }

  bool rests(double time) const { return time >= path.until; }
  double across(const Vector& n) const { return n.cross(path.turn).norm(); }
  double first(const Vector& n) const {
    return across(n) * arm + std::min(across(n), w_o) * radius;
  }
  double second(const Vector& n) const { return w * across(n) * (arm + (w_o > 0 ? radius : 0.0)); }
};

struct Separation {
  Vector n_W;
  double s;
};

/// Both parts, at one time after the other.
class ConvexMeeting {
 public:
  ConvexMeeting(const MovingPart& A, const MovingPart& B, bool is_planar)
      : A_(A), B_(B), is_planar_(is_planar), rates_A_(A, is_planar), rates_B_(B, is_planar) {}

  /// The signed distance, and its direction. `near` is a direction not far from that.
  Separation distance(double time, const Vector& near) {
    const Pose X_WA = pose(A_, time), X_WB = pose(B_, time);
    if (is_half_space(A_)) return {X_WA.R.col(2), along(X_WA.R.col(2), X_WA, X_WB)};
    if (is_half_space(B_)) return {-X_WB.R.col(2), along(-X_WB.R.col(2), X_WA, X_WB)};
    const Collider a{A_.start.shape, X_WA, A_.start.geometry, A_.start.triangle};
    const Collider b{B_.start.shape, X_WB, B_.start.geometry, B_.start.triangle};
    if (is_planar_) return distance_in_plane(a, b);
    const ConvexPair pair(a, b);
    Simplex simplex;
    const Closest found =
        closest(pair, Vector::Zero(), X_WA.R.transpose() * near, kInfinity, simplex, hints_);
    if (found.kind == Closest::Kind::apart) {
      return {X_WA.R * found.n, -core_overlap(pair, found.n, hints_) - pair.radii()};
    }
    const LeastOverlap least = least_overlap(pair, kInfinity, hints_);
    return {X_WA.R * least.n, -least.overlap - pair.radii()};
  }

  /// A time after `time`, until which the separation stays above `goal`: at `time` it is `now`.
  double advance(double time, const Separation& now, double goal) {
    const bool A_rests = rates_A_.rests(time), B_rests = rates_B_.rests(time);
    const double end =
        std::min({1.0, A_rests ? 1.0 : rates_A_.path.until, B_rests ? 1.0 : rates_B_.path.until});
    const Vector& n = now.n_W;
    double first = 0, second = 0, closing = 0;
    if (!A_rests) {
      closing += n.dot(rates_A_.path.travel);
      first += rates_A_.first(n);
      second += rates_A_.second(n);
    }
    if (!B_rests) {
      closing -= n.dot(rates_B_.path.travel);
      first += rates_B_.first(n);
      second += rates_B_.second(n);
    }
    first += std::max(0.0, closing);
    const double left = now.s - goal;
    if (left >= first * (end - time)) return end;
    double step = left / first;
    double D = end - time;
    if (second * D * D > 8 * left) D = std::sqrt(8 * left / second);
    const double fall = now.s - along(n, pose(A_, time + D), pose(B_, time + D));
    // left - b tau + second tau^2 / 2 = 0
    const double b = fall / D + second * D / 2;
    const double root2 = b * b - 2 * second * left;
    const double tau = root2 < 0 || b <= 0 ? D : 2 * left / (b + std::sqrt(root2));
    step = std::max(step, std::min(tau, D));
    return std::min(end, time + step);
  }

 private:
  static Pose pose(const MovingPart& part, double time) {
    return moved(part.path, part.start.X_WB, time);
  }

  static Separation distance_in_plane(const Collider& a, const Collider& b) {
    const Manifold manifold = collide_in_plane(a, b, kInfinity);
    Separation found{manifold.normal_W, kInfinity};
    for (int k = 0; k < manifold.count; ++k) {
      found.s = std::min(found.s, manifold.points[static_cast<std::size_t>(k)].separation);
    }
    return found;
  }

  double reach_along(const MovingPart& part, const Pose& X, const Vector& n, std::int32_t& hint) {
    if (is_half_space(part)) return n.dot(X.x);
    if (is_planar_) {
      const PlanarShape shape = in_plane(part.start, X);
      const Point d(n.x(), n.y());
      return d.dot(shape.corner(shape.farthest(d))) + shape.radius;
    }
    const ConvexShape shape(part.start);
    const Vector n_P = X.R.transpose() * n;
    return n.dot(X.x) + n_P.dot(shape.support(n_P, hint)) + shape.radius;
  }

  double along(const Vector& n, const Pose& X_WA, const Pose& X_WB) {
    return -reach_along(B_, X_WB, -n, hints_.B) - reach_along(A_, X_WA, n, hints_.A);
  }

  const MovingPart &A_, &B_;
  bool is_planar_;
  Rates rates_A_, rates_B_;
  SupportHints hints_;
};

/// The separation from which on parts that begin at s, touching, are stopped.
double goal_of_touching(double s, const ImpactLengths& lengths) {
  const double overlap = std::max(-s, 0.0);
  return -std::max(std::min(overlap + lengths.deeper, lengths.deepest), overlap + lengths.gap);
}

}  // namespace

ImpactLengths impact_lengths(double thickness_A, double thickness_B) {
  const double thinner = std::min(thickness_A, thickness_B);
  const double gap = std::min(kGapMax_m, kGapShare * thinner);
  return {gap, kToleranceShare * gap, kDeeperShare * thinner, kDeepestShare * thinner};
}

TimeOfImpact convex_impact(const MovingPart& A, const MovingPart& B, ImpactGoal kind,
                           const ImpactLengths& lengths, bool is_planar) {
  TimeOfImpact result;
  const auto has_inside = [is_planar](const Collider& collider) {
    return is_planar ? in_plane(collider, collider.X_WB).count > 0 : is_convex(collider);
  };
  const bool A_is_convex = has_inside(A.start), B_is_convex = has_inside(B.start);
  if (!(A_is_convex || is_half_space(A)) || !(B_is_convex || is_half_space(B))) return result;
  if (!A_is_convex && !B_is_convex) return result;

  const double share = kind == ImpactGoal::touch ? kTouchShare : 1.0;
  const double tolerance = share * lengths.tolerance;
  double goal = kind == ImpactGoal::contact ? -lengths.deeper : share * lengths.gap;
  ConvexMeeting meeting(A, B, is_planar);
  double time = 0;
  const Vector between = B.start.X_WB.x - A.start.X_WB.x;
  Vector n = between.squaredNorm() > 0 ? between.normalized() : Vector(Vector::UnitZ());
  while (result.iterations < kAdvancesMax) {
    const Separation now = meeting.distance(time, n);
    if (!std::isfinite(now.s)) return result;
    ++result.iterations;
    if (time == 0) {
      result.began_touching = now.s <= lengths.gap + lengths.tolerance;
      if (result.began_touching) goal = goal_of_touching(now.s, lengths);
    }
    if (now.s <= goal + tolerance) {
      result.kind = TimeOfImpact::Kind::hit;
      result.time = time;
      result.normal_W = now.n_W;
      result.separation = now.s;
      const double too_deep = -now.s - lengths.deepest;
      result.out = std::clamp(too_deep, 0.0, kOutOfGap * lengths.gap);
      return result;
    }
    time = meeting.advance(time, now, goal);
    if (time >= 1) return result;
    n = now.n_W;
  }
  result.kind = TimeOfImpact::Kind::capped;
  result.time = time;
  return result;
}

void keep_first(TimeOfImpact& first, TimeOfImpact found) {
  found.iterations += first.iterations;
  found.began_touching = found.began_touching || first.began_touching;
  const bool is_first = found.kind != TimeOfImpact::Kind::none &&
                        (first.kind == TimeOfImpact::Kind::none || found.time < first.time);
  if (is_first) {
    first = found;
  } else {
    first.iterations = found.iterations;
    first.began_touching = found.began_touching;
  }
}

}  // namespace cradle
