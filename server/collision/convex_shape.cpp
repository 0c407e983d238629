// Support points of the convex shapes in closed form; of hulls from few candidates, or by climbing
// from vertex to vertex.
#include "server/collision/convex_shape.h"

#include <algorithm>
#include <cmath>

#include "server/collision/index.h"
#include "server/collision/likely_vertices.h"
#include "server/collision/surface.h"

namespace cradle {
namespace {

const Vector& support_of_hull(const ConvexHull& hull, const Vector& d, std::int32_t& hint) {
  if (!hull.likely.empty()) {
    hint = farthest_likely(hull, d);
    return hull.vertices[index(hint)];
  }
  double best = d.dot(hull.vertices[index(hint)]);
  // Uphill from vertex to vertex: on a convex surface a summit is the highest point.
  for (std::int32_t from = -1; from != hint;) {
    from = hint;
    const auto begin = index(hull.around_first[index(from)]);
    const auto end = index(hull.around_first[index(from) + 1]);
    for (std::size_t k = begin; k < end; ++k) {
      const std::int32_t v = hull.neighbours[k];
      const double reach = d.dot(hull.vertices[index(v)]);
      if (reach > best) best = reach, hint = v;
    }
  }
  return hull.vertices[index(hint)];
}

/// How far d reaches beside z.
double across_z(const Vector& d) { return std::sqrt(d.x() * d.x() + d.y() * d.y()); }

/// Where a disc about z of radius r, at the height z, reaches farthest along d.
Vector on_rim(double r, double z, const Vector& d, double across) {
  const double scale = across > 0 ? r / across : 0;
  return {scale * d.x(), scale * d.y(), z};
}

}  // namespace

ConvexShape::ConvexShape(const Collider& collider) : kind(collider.shape.kind) {
  const Shape& shape = collider.shape;
  size = to_eigen(shape.half_extents_m());
  switch (kind) {
    case ShapeKind::sphere:
      radius = thickness = shape.radius_m();
      return;
    case ShapeKind::capsule:
      radius = thickness = shape.radius_m();
      return;
    case ShapeKind::cylinder:
      inner_radius = std::min(shape.radius_m(), shape.half_length_m());
      break;
    case ShapeKind::cone: {  // the inscribed ball
      const double r = shape.radius_m(), h = 2 * shape.half_length_m();
      inner_radius = r * h / (r + std::sqrt(r * r + h * h));
      centre.z() = inner_radius - shape.half_length_m();
      break;
    }
    case ShapeKind::hull:
      hull = collider.hull();
      inner_radius = hull->inner_radius;
      centre = hull->centre;
      break;
    case ShapeKind::mesh:
      *this = ConvexShape(*collider.triangle);
      return;
    case ShapeKind::ellipsoid:
      inner_radius = size.minCoeff();
      rolling_radius = inner_radius * inner_radius / size.maxCoeff();
      break;
    default:  // box
      inner_radius = size.minCoeff();
      break;
  }
  thickness = inner_radius;
}

ConvexShape::ConvexShape(const SurfaceTriangle& t) : kind(ShapeKind::mesh), triangle(&t) {
  centre = (t.corners[0] + t.corners[1] + t.corners[2]) / 3;
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    longest = std::max(longest, (t.corners[(k + 1) % 3] - t.corners[k]).norm());
  }
  thickness = 0.5 * longest;
}

Vector ConvexShape::support(const Vector& d, std::int32_t& hint) const {
  switch (kind) {
    case ShapeKind::box:
      return {toward(d.x(), size.x()), toward(d.y(), size.y()), toward(d.z(), size.z())};
    case ShapeKind::capsule:
      return {0, 0, toward(d.z(), size.y())};
    case ShapeKind::cylinder:
      return on_rim(size.x(), d.z() < 0 ? -size.y() : size.y(), d, across_z(d));
    case ShapeKind::cone: {
      const double across = across_z(d);
      if (2 * size.y() * d.z() > size.x() * across) return {0, 0, size.y()};
      return on_rim(size.x(), -size.y(), d, across);
    }
    case ShapeKind::ellipsoid: {
      const Vector stretched = size.cwiseProduct(d);
      const double length = stretched.norm();
      if (!(length > 0)) return {size.x(), 0, 0};
      return size.cwiseProduct(stretched) * (1 / length);
    }
    case ShapeKind::hull:
      return support_of_hull(*hull, d, hint);
    case ShapeKind::mesh: {
      const auto& p = triangle->corners;
      const double a = d.dot(p[0]), b = d.dot(p[1]), c = d.dot(p[2]);
      return a >= b ? (a >= c ? p[0] : p[2]) : (b >= c ? p[1] : p[2]);
    }
    default:
      return Vector::Zero();
  }
}

}  // namespace cradle
