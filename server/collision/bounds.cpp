#include "server/collision/bounds.h"

#include <cmath>

namespace cradle {
namespace {

/// Half the edges of the box in W of a posed shape, m.
Vector half_edges(const Shape& shape, const Pose& X_WB) {
  if (shape.kind == ShapeKind::sphere) return Vector::Constant(shape.radius_m());
  return X_WB.R.cwiseAbs() * to_eigen(shape.half_extents_m());
}

}  // namespace

Aabb bounds(const Shape& shape, const Pose& X_WB) {
  if (shape.kind != ShapeKind::sphere && shape.kind != ShapeKind::box) return {};
  const Vector half = half_edges(shape, X_WB);
  return {X_WB.x - half, X_WB.x + half};
}

Aabb swept(const Aabb& box, const Vector& displacement, double margin) {
  if (box.is_empty()) return box;
  const Vector grow = Vector::Constant(margin);
  return {box.lower + displacement.cwiseMin(0.0) - grow,
          box.upper + displacement.cwiseMax(0.0) + grow};
}

double bounding_radius(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::none:
      return 0;
    case ShapeKind::sphere:
      return shape.radius_m();
    case ShapeKind::box:
      return to_eigen(shape.half_extents_m()).norm();
    case ShapeKind::capsule:
      return shape.radius_m() + shape.half_length_m();
    case ShapeKind::cylinder:
    case ShapeKind::cone:
      return std::hypot(shape.radius_m(), shape.half_length_m());
    case ShapeKind::ellipsoid:
      return to_eigen(shape.half_extents_m()).maxCoeff();
    case ShapeKind::half_space:
    case ShapeKind::hull:
    case ShapeKind::mesh:
    case ShapeKind::compound:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

double bounding_radius(const StoredGeometry& geometry) {
  double radius = 0;
  const auto hold = [&radius](const std::vector<Vector>& vertices) {
    for (const Vector& vertex : vertices) radius = std::fmax(radius, vertex.norm());
  };
  if (const auto* hull = std::get_if<ConvexHull>(&geometry.value)) hold(hull->vertices);
  if (const auto* mesh = std::get_if<TriangleMesh>(&geometry.value)) hold(mesh->vertices);
  if (const auto* compound = std::get_if<Compound>(&geometry.value)) {
    for (const CompoundPart& part : compound->parts) {
      const double own =
          part.geometry ? bounding_radius(*part.geometry) : bounding_radius(part.shape);
      radius = std::fmax(radius, part.p_BoPo.norm() + own);
    }
  }
  return radius;
}

}  // namespace cradle
