#include "server/collision/extents.h"

#include <cmath>

#include "server/collision/bounds.h"
#include "server/collision/convex_shape.h"
#include "server/collision/planar_shape.h"
#include "server/collision/surface.h"

namespace cradle {
namespace {

/// Of the radius of a surface without inside. What goes farther than this may pass small bodies.
constexpr double kOpenShare = 0.02;

/// Half the least width of a shape of the plane, which is across an edge.
double thickness_in_plane(const Collider& collider) {
  const PlanarShape shape({collider.shape, Pose(), collider.geometry}, Vector::Zero());
  if (shape.count == 0) return kInfinity;
  if (shape.count < 3) return shape.radius;
  double least = kInfinity;
  for (int k = 0; k < shape.count; ++k) {
    const Point& n = shape.normal(k);
    least = std::min(least, n.dot(shape.corner(k) - shape.corner(shape.farthest(-n))));
  }
  return 0.5 * least;
}

/// Of a whole mesh or height field, or of what is behind one triangle of it.
double thickness_of_surface(const Collider& collider) {
  if (collider.geometry == nullptr) return kInfinity;
  const auto* mesh = std::get_if<TriangleMesh>(&collider.geometry->value);
  if (mesh != nullptr && mesh->thickness > 0) return mesh->thickness;
  if (collider.triangle != nullptr) return kInfinity;
  return kOpenShare * bounding_radius(*collider.geometry);
}

double reach_of_surface(const StoredGeometry& geometry, const Vector& centre) {
  const auto* mesh = std::get_if<TriangleMesh>(&geometry.value);
  if (mesh == nullptr) return bounding_radius(geometry) + centre.norm();
  double radius2 = 0;
  for (const Vector& p : mesh->vertices) radius2 = std::max(radius2, (p - centre).squaredNorm());
  return std::sqrt(radius2);
}

}  // namespace

bool is_convex(const Collider& collider) {
  if (collider.triangle != nullptr) return true;
  const ShapeKind kind = collider.shape.kind;
  return has_inside(kind) && (kind != ShapeKind::hull || collider.hull() != nullptr);
}

bool has_surface(const Collider& collider) {
  return is_surface(collider.shape.kind) && collider.triangle == nullptr &&
         collider.geometry != nullptr;
}

double thickness(const Collider& collider, bool is_planar) {
  if (const Compound* compound = compound_of(collider)) {
    double least = kInfinity;
    for (const CompoundPart& part : compound->parts) {
      least =
          std::min(least, thickness({part.shape, collider.X_WB, part.geometry.get()}, is_planar));
    }
    return least;
  }
  if (is_planar) return thickness_in_plane(collider);
  if (is_surface(collider.shape.kind)) return thickness_of_surface(collider);
  if (!is_convex(collider)) return kInfinity;
  const double half = ConvexShape(collider).thickness;
  return half > 0 ? half : kInfinity;
}

double reach(const Collider& collider, const Vector& centre) {
  if (const Compound* compound = compound_of(collider)) {
    double radius = 0;
    for (const CompoundPart& part : compound->parts) {
      const Vector centre_P = part.q_BP.conjugate() * (centre - part.p_BoPo);
      radius = std::max(radius, reach({part.shape, collider.X_WB, part.geometry.get()}, centre_P));
    }
    return radius;
  }
  if (collider.triangle != nullptr) {
    const auto& p = collider.triangle->corners;
    return std::max({(p[0] - centre).norm(), (p[1] - centre).norm(), (p[2] - centre).norm()});
  }
  if (has_surface(collider)) return reach_of_surface(*collider.geometry, centre);
  const auto* polygon =
      collider.geometry ? std::get_if<ConvexPolygon>(&collider.geometry->value) : nullptr;
  if (polygon != nullptr) return bounding_radius(*collider.geometry) + centre.norm();
  if (collider.hull() == nullptr) return bounding_radius(collider.shape) + centre.norm();
  double radius2 = 0;
  for (const Vector& vertex : collider.hull()->vertices) {
    radius2 = std::max(radius2, (vertex - centre).squaredNorm());
  }
  return std::sqrt(radius2);
}

}  // namespace cradle
