#include "server/collision/bounds.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "server/collision/convex_shape.h"
#include "server/collision/surface.h"

namespace cradle {
namespace {

/// How far a disc of radius 1 about z of B reaches along each axis of W.
Vector shadow_of_disc(const Matrix& R) { return R.leftCols<2>().rowwise().norm(); }

/// Of shapes that are alike on both sides of Bo: half the edges of the box in W, m.
Vector half_edges(const Shape& shape, const Matrix& R) {
  switch (shape.kind) {
    case ShapeKind::sphere:
      return Vector::Constant(shape.radius_m());
    case ShapeKind::box:
      return R.cwiseAbs() * to_eigen(shape.half_extents_m());
    case ShapeKind::capsule:
      return (R.col(2).cwiseAbs() * shape.half_length_m()).array() + shape.radius_m();
    case ShapeKind::ellipsoid:
      return (R * to_eigen(shape.half_extents_m()).asDiagonal()).rowwise().norm();
    default:  // cylinder
      return R.col(2).cwiseAbs() * shape.half_length_m() + shape.radius_m() * shadow_of_disc(R);
  }
}

Aabb bounds_of_cone(const Shape& cone, const Pose& X_WB) {
  const Vector tip = X_WB.x + X_WB.R.col(2) * cone.half_length_m();
  const Vector base = X_WB.x - X_WB.R.col(2) * cone.half_length_m();
  const Vector disc = cone.radius_m() * shadow_of_disc(X_WB.R);
  return {tip.cwiseMin(base - disc), tip.cwiseMax(base + disc)};
}

/// To look at each takes less time than six searches for the farthest.
constexpr std::size_t kFewVertices = 32;

Aabb bounds_of_few(std::span<const Vector> vertices_B, const Pose& X_WB) {
  Vector lowest = Vector::Constant(kInfinity), highest = -lowest;  // from Bo
  for (const Vector& p_B : vertices_B) {
    const Vector p = X_WB.R * p_B;
    lowest = lowest.cwiseMin(p);
    highest = highest.cwiseMax(p);
  }
  return {X_WB.x + lowest, X_WB.x + highest};
}

Aabb bounds_of_hull(const Collider& collider) {
  if (collider.hull() == nullptr) return {};
  const Pose& X = collider.X_WB;
  const std::span vertices = collider.hull()->vertices;
  if (vertices.size() <= kFewVertices) return bounds_of_few(vertices, X);
  const ConvexShape hull(collider);
  Aabb box;
  std::int32_t hint = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector along_B = X.R.row(axis).transpose();
    box.upper[axis] = X.x[axis] + along_B.dot(hull.support(along_B, hint));
    box.lower[axis] = X.x[axis] + along_B.dot(hull.support(-along_B, hint));
  }
  return box;
}

/// Not the tight one, but that of the box in B: it must not take the time of all vertices.
Aabb bounds_of_surface(const Collider& collider) {
  const SurfaceView surface(collider);
  if (!surface.is_there()) return {};
  const Pose& X = collider.X_WB;
  const Aabb box = surface.box();
  const Vector centre = X.x + X.R * (0.5 * (box.lower + box.upper));
  const Vector half = X.R.cwiseAbs() * (0.5 * (box.upper - box.lower));
  return {centre - half, centre + half};
}

Aabb bounds_of_compound(const Collider& collider) {
  const Compound* compound =
      collider.geometry ? std::get_if<Compound>(&collider.geometry->value) : nullptr;
  return compound ? bounds_of_parts(*compound, collider.X_WB, bounds) : Aabb{};
}

}  // namespace

Aabb posed(const Aabb& box, const Pose& X_WB) {
  if (box.is_empty()) return {};
  const Vector middle = X_WB.x + X_WB.R * (0.5 * (box.lower + box.upper));
  const Vector half = X_WB.R.cwiseAbs() * (0.5 * (box.upper - box.lower));
  return {middle - half, middle + half};
}

Aabb bounds_of_parts(const Compound& compound, const Pose& X_WB,
                     Aabb (*bounds_of_part)(const Collider&)) {
  if (compound.parts.size() > kPartsOfTightBox) return posed(compound.box, X_WB);
  Aabb box;
  for (std::size_t i = 0; i < compound.parts.size(); ++i) {
    const CompoundPart& part = compound.parts[i];
    const Pose X_WP{X_WB.x + X_WB.R * compound.X_BP[i].x, X_WB.R * compound.X_BP[i].R};
    const Aabb own = bounds_of_part({part.shape, X_WP, part.geometry.get()});
    box.lower = box.lower.cwiseMin(own.lower);
    box.upper = box.upper.cwiseMax(own.upper);
  }
  return box;
}

Aabb bounds(const Collider& collider) {
  const Pose& X_WB = collider.X_WB;
  switch (collider.shape.kind) {
    case ShapeKind::none:
    case ShapeKind::half_space:
    case ShapeKind::polygon:
      return {};
    case ShapeKind::mesh:
    case ShapeKind::height_field:
      return bounds_of_surface(collider);
    case ShapeKind::compound:
      return bounds_of_compound(collider);
    case ShapeKind::cone:
      return bounds_of_cone(collider.shape, X_WB);
    case ShapeKind::hull:
      return bounds_of_hull(collider);
    default:
      break;
  }
  const Vector half = half_edges(collider.shape, X_WB.R);
  return {X_WB.x - half, X_WB.x + half};
}

Aabb swept(const Aabb& box, const Vector& displacement, double margin) {
  if (box.is_empty()) return box;
  Aabb all;
  for (int k = 0; k < 3; ++k) {  // the constant first: see `within`, which Eigen's minimum is like
    all.lower[k] = box.lower[k] + std::min(0.0, displacement[k]) - margin;
    all.upper[k] = box.upper[k] + std::max(0.0, displacement[k]) + margin;
  }
  return all;
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
    case ShapeKind::polygon: {
      double radius = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        const Vec2 p = shape.corner_m(k);
        radius = std::fmax(radius, Vector2(p.x, p.y).norm());
      }
      return radius;
    }
    case ShapeKind::half_space:
    case ShapeKind::hull:
    case ShapeKind::mesh:
    case ShapeKind::compound:
    case ShapeKind::height_field:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

double bounding_radius(const StoredGeometry& geometry) {
  double radius = 0;
  const auto hold = [&radius](const auto& vertices) {
    for (const auto& vertex : vertices) radius = std::fmax(radius, vertex.norm());
  };
  if (const auto* hull = std::get_if<ConvexHull>(&geometry.value)) hold(hull->vertices);
  if (const auto* polygon = std::get_if<ConvexPolygon>(&geometry.value)) hold(polygon->corners);
  if (const auto* mesh = std::get_if<TriangleMesh>(&geometry.value)) radius = mesh->reach;
  if (const auto* field = std::get_if<HeightField>(&geometry.value)) {
    const double height = std::fmax(std::abs(field->lowest), std::abs(field->highest));
    radius = Vector(field->x(0), field->y(0), height).norm();
  }
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
