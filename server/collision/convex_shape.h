/// Every convex shape with an inside, as a core grown by a radius: what the generic pair function
/// asks of it. Private to this folder.
///
/// Lengths in m, in the frame B of the shape. The core of a sphere is a point, of a capsule a
/// segment, of the others they themselves, with radius 0.
#pragma once

#include "server/collision/collider.h"

namespace cradle {

struct SurfaceTriangle;

/// Kinds as bits: what is asked of every pair takes no branch by them.
constexpr std::uint64_t bit_of(ShapeKind kind) {
  return std::uint64_t{1} << (static_cast<std::uint64_t>(kind) % 64);
}

/// The kinds that a ConvexShape stands for; a hull has to come with its geometry. Not `mesh`,
/// though one triangle of it is convex.
inline constexpr std::uint64_t kKindsWithInside =
    bit_of(ShapeKind::sphere) | bit_of(ShapeKind::box) | bit_of(ShapeKind::capsule) |
    bit_of(ShapeKind::cylinder) | bit_of(ShapeKind::cone) | bit_of(ShapeKind::ellipsoid) |
    bit_of(ShapeKind::hull);
constexpr bool has_inside(ShapeKind kind) { return (bit_of(kind) & kKindsWithInside) != 0; }

struct ConvexShape {
  ShapeKind kind = ShapeKind::none;  ///< `mesh`: one triangle of a surface, in the surface's frame
  Vector size = Vector::Zero();      ///< half extents or semi-axes; or radius, half length
  const ConvexHull* hull = nullptr;
  const SurfaceTriangle* triangle = nullptr;
  double radius = 0;               ///< that the core is grown by
  Vector centre = Vector::Zero();  ///< well inside
  double inner_radius = 0;         ///< of a ball about `centre` that the core holds
  double rolling_radius = 0;       ///< of a ball that can roll everywhere inside the core
  double thickness = 0;  ///< m, what counts as small beside the shape: half its least width

  /// A hull must come with its geometry, a mesh with its triangle. Not for half-spaces and what has
  /// parts.
  explicit ConvexShape(const Collider& collider);
  /// Flat: inner_radius is 0.
  explicit ConvexShape(const SurfaceTriangle& triangle);

  /// Without an inside.
  bool is_flat() const { return inner_radius == 0 && radius == 0; }

  /// A hull that knows which vertices are likely to be farthest along a direction.
  bool is_quick_hull() const { return hull != nullptr && !hull->likely.empty(); }

  /// A point of the core that is farthest along `d`, which need not have unit length. `hint` is for
  /// hulls: where the search begins, and then the vertex found. It changes time, not the result's
  /// quality; it must be 0 at first.
  Vector support(const Vector& d, std::int32_t& hint) const;
};

}  // namespace cradle
