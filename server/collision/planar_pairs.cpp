// The one place where contacts in space become contacts in the plane.
//
// Boxes are taken as bars along z, as deep as they are wide together: then they part sooner in the
// plane than along z, and meet along z by whole lengths. So each corner of the cut through z = 0 is
// met twice, at both ends of the bars, which differ in the last part of their features alone; the
// two are put together at z = 0 under the lower feature.
#include "server/collision/planar_pairs.h"

#include <algorithm>
#include <span>

#include "server/collision/narrow_phase.h"

namespace cradle {
namespace {

/// m: points nearer than this are the two ends of one edge along z, apart by rounding.
constexpr double kSameEdge = 1e-9;

double width(const Shape& shape) {
  if (shape.kind != ShapeKind::box) return 0;
  const Vec3 h = shape.half_extents_m();
  return h.x + h.y;
}

Shape bar(const Shape& shape, double half_length_m) {
  if (shape.kind != ShapeKind::box) return shape;
  const Vec3 h = shape.half_extents_m();
  return Shape::box({h.x, h.y, half_length_m});
}

void add(Manifold& flat, ContactPoint point) {
  point.p_W.z() = 0;
  for (ContactPoint& other : std::span(flat.points).first(static_cast<std::size_t>(flat.count))) {
    const double apart = (other.p_W - point.p_W).norm();
    if (apart > kSameEdge * (1 + point.p_W.norm())) continue;
    other.feature = std::min(other.feature, point.feature);
    return;
  }
  if (flat.count < 2) flat.points[static_cast<std::size_t>(flat.count++)] = point;
}

}  // namespace

bool can_collide_in_plane(ShapeKind kind) {
  return kind == ShapeKind::none || kind == ShapeKind::sphere || kind == ShapeKind::box ||
         kind == ShapeKind::half_space;
}

Manifold collide_in_plane(const Shape& shape_A, const Pose& X_WA, const Shape& shape_B,
                          const Pose& X_WB, double margin) {
  const double half_length_m = 2 * (width(shape_A) + width(shape_B));
  const Manifold solid =
      collide(bar(shape_A, half_length_m), X_WA, bar(shape_B, half_length_m), X_WB, margin);
  Manifold flat;
  if (solid.count == 0) return flat;
  const Vector n(solid.normal_W.x(), solid.normal_W.y(), 0);
  flat.normal_W = n.norm() > 0.5 ? Vector(n.normalized()) : Vector(Vector::UnitY());  // coincident
  for (int k = 0; k < solid.count; ++k) add(flat, solid.points[static_cast<std::size_t>(k)]);
  return flat;
}

}  // namespace cradle
