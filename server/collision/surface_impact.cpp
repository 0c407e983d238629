// A convex part meets a surface where it meets one of its triangles (convex_impact.h) from in
// front: what is behind a triangle is solid, and nothing comes out of it.
//
// What that alone lacks. A thin part whose tip is through the surface crosses one triangle, near an
// edge, and could leave it sideways over that edge: its overlap with each triangle is small however
// deep its tip is; and the triangle behind which the tip is would hold it. Hence a triangle stops
//   what meets it from the front; once contacts keep both apart, where the part gets too deep in
//   it, or behind its plane from the time on at which they met;
//   what meets it from behind, only by that plane;
//   what met it from behind, or touches it from the start, also by a ball about the part's centre,
//   which never gets through;
//   from the front only, what comes round from behind its plane.
// A triangle that turns stops alike from both sides, without the last four.
// Cost: one search a triangle, up to four for what is in contact or met from behind.
#include "server/collision/surface_impact.h"

#include "server/collision/convex_impact.h"
#include "server/collision/convex_shape.h"
#include "server/collision/extents.h"
#include "server/collision/surface.h"

namespace cradle {
namespace {

/// Of the part's thickness; within what may not be deeper than that.
constexpr double kMiddleShare = 0.5;
/// Of how deep a part may get. What is farther behind a triangle's plane lies across a ridge.
constexpr double kFarBehindShare = 4;

/// A ball on a straight way, in the frame of the surface at its start, that holds the convex part
/// as the surface sees it go by.
struct BallBeside {
  Vector from, to;
  double radius;

  BallBeside(const MovingPart& surface, const MovingPart& convex) {
    const Pose &X_S = surface.start.X_WB, &X_C = convex.start.X_WB;
    const Path &path_S = surface.path, &path_C = convex.path;
    // About the part's centre, whose way is straight but for the turn of the surface.
    const Vector centre_C = X_C.R.transpose() * (path_C.x - X_C.x);
    const double away = (path_C.x - path_S.x).norm() + path_C.travel.norm() + path_S.travel.norm();
    const ImpactLengths lengths = impact_lengths(thickness(convex.start), kInfinity);
    radius = 1.001 * (reach(convex.start, centre_C) + path_S.turn.norm() * away + lengths.gap +
                      lengths.tolerance);
    from = X_S.R.transpose() * (path_C.x - X_S.x);
    to = from + X_S.R.transpose() * (path_C.travel - path_S.travel);
  }

  Aabb box() const {
    const Vector around = Vector::Constant(radius);
    return {from.cwiseMin(to) - around, from.cwiseMax(to) + around};
  }
  /// Whether it may come near the plane of a triangle, within its edges.
  bool may_meet(const SurfaceTriangle& t) const {
    const double a = t.normal.dot(from - t.corners[0]), b = t.normal.dot(to - t.corners[0]);
    if (std::min(a, b) > radius || std::max(a, b) < -radius) return false;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector inward = t.normal.cross(t.edge(k));
      const Vector& p = t.corners[k];
      if (std::max(inward.dot(from - p), inward.dot(to - p)) < -radius) return false;
    }
    return true;
  }
};

/// A ball about the centre of a convex part.
struct Middle {
  Shape shape;
  Pose X_WM;
  Collider start;
  MovingPart part;

  explicit Middle(const MovingPart& convex)
      : shape(Shape::sphere(kMiddleShare * thickness(convex.start))),
        X_WM{convex.start.X_WB.x + convex.start.X_WB.R * ConvexShape(convex.start).centre,
             convex.start.X_WB.R},
        start{shape, X_WM},
        part{start, convex.path} {}
};

/// All that is behind the plane of a triangle.
struct Behind {
  Shape shape{ShapeKind::half_space, {}};
  Pose X_WH;
  Collider start;
  MovingPart part;

  Behind(const MovingPart& triangle, const SurfaceTriangle& t)
      : X_WH{triangle.start.X_WB.x + triangle.start.X_WB.R * t.corners[0],
             frame_along(triangle.start.X_WB.R * t.normal).transpose()},
        start{shape, X_WH},
        part{start, triangle.path} {}
};

/// A triangle and a part.
class TriangleImpact {
 public:
  TriangleImpact(const MovingPart& triangle, const SurfaceTriangle& t, const MovingPart& convex,
                 const Middle& middle, ImpactGoal goal)
      : triangle_(triangle),
        t_(t),
        convex_(convex),
        middle_(middle),
        goal_(goal),
        turns_(!triangle.path.turn.isZero(0)),
        lengths_(impact_lengths(thickness(triangle.start), thickness(convex.start))) {}

  TimeOfImpact find() const {
    const bool begins_ahead = is_ahead(0);
    if (!begins_ahead && (turns_ || !is_ahead(1))) return {};
    const bool is_kept_apart = goal_ == ImpactGoal::contact;
    const TimeOfImpact met = search(convex_, is_kept_apart ? ImpactGoal::gap : goal_);
    if (met.began_touching) return begins_ahead ? stop_what_touches(met) : TimeOfImpact();
    if (met.kind != TimeOfImpact::Kind::hit) return met;
    if (is_from_behind(met)) return begins_ahead ? stop_from_behind(met) : TimeOfImpact();
    if (!is_kept_apart) return met;
    TimeOfImpact found = search(convex_, goal_);
    if (begins_ahead && !turns_) keep_first(found, stop_behind_plane(met));
    return found;
  }

 private:
  Pose pose(double time) const { return moved(triangle_.path, triangle_.start.X_WB, time); }

  /// Whether the part's centre is in front.
  bool is_ahead(double time) const {
    const Pose X_WS = pose(time);
    const Vector centre = moved(convex_.path, middle_.X_WM, time).x;
    return (X_WS.R * t_.normal).dot(centre - (X_WS.x + X_WS.R * t_.corners[0])) > 0;
  }
  /// Whether that is where the nearest points are. A triangle that turns stops from both sides,
  /// since others of its surface, which the part did not begin in front of, may be near.
  bool is_from_behind(const TimeOfImpact& met) const {
    return !turns_ && (pose(met.time).R * t_.normal).dot(met.normal_W) < 0;
  }
  /// How far the part begins behind the plane of the triangle, m.
  double depth_behind() const {
    const Pose &X_WS = triangle_.start.X_WB, &X_WC = convex_.start.X_WB;
    const ConvexShape shape(convex_.start);
    const Vector n_W = X_WS.R * t_.normal, n_C = X_WC.R.transpose() * n_W;
    std::int32_t hint = 0;
    const double lowest = n_W.dot(X_WC.x) + n_C.dot(shape.support(-n_C, hint)) - shape.radius;
    return n_W.dot(X_WS.x + X_WS.R * t_.corners[0]) - lowest;
  }

  TimeOfImpact search(const MovingPart& part, ImpactGoal goal) const {
    return convex_impact(triangle_, part, goal, lengths_);
  }
  TimeOfImpact stop_what_touches(TimeOfImpact found) const {
    keep_first(found, search(middle_.part, goal_));
    return found;
  }
  TimeOfImpact stop_from_behind(const TimeOfImpact& met) const {
    return stop_what_touches(stop_behind_plane(met));
  }
  /// From `met` on, unless it is too far behind already.
  TimeOfImpact stop_behind_plane(const TimeOfImpact& met) const {
    TimeOfImpact found;
    if (depth_behind() > kFarBehindShare * lengths_.deepest) return found;
    found = convex_impact(Behind(triangle_, t_).part, convex_, ImpactGoal::contact, lengths_);
    found.time = std::max(found.time, met.time);
    found.iterations += met.iterations;
    found.began_touching = false;
    return found;
  }

  const MovingPart& triangle_;
  const SurfaceTriangle& t_;
  const MovingPart& convex_;
  const Middle& middle_;
  ImpactGoal goal_;
  bool turns_;
  ImpactLengths lengths_;
};

}  // namespace

TimeOfImpact surface_impact(const MovingPart& whole, const MovingPart& convex, ImpactGoal goal) {
  TimeOfImpact first;
  const SurfaceView surface(whole.start);
  first.began_touching = convex.start.shape.kind == ShapeKind::half_space;
  if (!surface.is_there() || !is_convex(convex.start)) return first;
  const BallBeside ball(whole, convex);
  const Aabb box = ball.box();
  if (!box.lower.allFinite() || !box.upper.allFinite()) return first;
  const Middle middle(convex);
  static const Shape kTriangle{ShapeKind::mesh, {}};
  surface.for_each_in(box, [&](std::int32_t number) {
    const SurfaceTriangle t = surface.triangle(number);
    if (t.normal.isZero(0) || !ball.may_meet(t)) return;
    const Collider collider{kTriangle, whole.start.X_WB, whole.start.geometry, &t};
    keep_first(first, TriangleImpact({collider, whole.path}, t, convex, middle, goal).find());
  });
  return first;
}

}  // namespace cradle
