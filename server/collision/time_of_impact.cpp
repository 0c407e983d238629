#include "server/collision/time_of_impact.h"

#include "server/collision/convex_impact.h"
#include "server/collision/extents.h"
#include "server/collision/surface_impact.h"
#include "server/collision/turn.h"

namespace cradle {

Pose moved(const Path& path, const Pose& X_WP, double time) {
  const double t = std::min(time, path.until);
  Pose X = X_WP;
  if (!path.turn.isZero(0)) {
    const Matrix R = rotation_exp(t * path.turn).toRotationMatrix();
    X.R = R * X_WP.R;
    X.x = path.x + R * (X_WP.x - path.x);
  }
  if (path.spin != 0) X.R = X.R * Eigen::AngleAxisd(t * path.spin, Vector::UnitZ());
  X.x += t * path.travel;
  return X;
}

namespace {

/// The earliest of all parts of A. They are as many as a compound has, few.
template <class F>
TimeOfImpact earliest(const Compound& compound, const MovingPart& whole, F&& of_part) {
  TimeOfImpact first;
  for (const CompoundPart& part : compound.parts) {
    const Pose& X = whole.start.X_WB;
    const Pose X_WP{X.x + X.R * part.p_BoPo, X.R * part.q_BP.toRotationMatrix()};
    const Collider collider{part.shape, X_WP, part.geometry.get()};
    keep_first(first, of_part(MovingPart{collider, whole.path}));
  }
  return first;
}

}  // namespace

TimeOfImpact time_of_impact(const MovingPart& A, const MovingPart& B, ImpactGoal kind,
                            bool is_planar) {
  if (const Compound* compound = compound_of(A.start)) {
    return earliest(*compound, A, [&](const MovingPart& part) {
      return time_of_impact(part, B, kind, is_planar);
    });
  }
  if (const Compound* compound = compound_of(B.start)) {
    return earliest(*compound, B, [&](const MovingPart& part) {
      return time_of_impact(A, part, kind, is_planar);
    });
  }
  if (has_surface(A.start)) return surface_impact(A, B, kind);
  if (has_surface(B.start)) {
    TimeOfImpact impact = surface_impact(B, A, kind);
    impact.normal_W = -impact.normal_W;
    return impact;
  }
  const ImpactLengths lengths =
      impact_lengths(thickness(A.start, is_planar), thickness(B.start, is_planar));
  return convex_impact(A, B, kind, lengths, is_planar);
}

}  // namespace cradle
