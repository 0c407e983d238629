#include "server/collision/planar_shape.h"

#include <cradle/limits.h>

#include <cmath>

#include "server/collision/bounds.h"
#include "server/collision/planar_pairs.h"

namespace cradle {

static_assert(PlanarShape::kCornersMax >= limits::kCorners);

void PlanarShape::place(const Collider& collider, const Point& o) {
  const Matrix& R = collider.X_WB.R;
  const Point ex(R(0, 0), R(1, 0)), ey(R(0, 1), R(1, 1));
  const Shape& shape = collider.shape;
  const auto set = [this](std::size_t k, const Point& p, const Point& n) {
    corners[k] = p;
    normals[k] = n;
  };
  switch (shape.kind) {
    case ShapeKind::sphere:
      radius = shape.radius_m();
      corners[0] = o;
      count = 1;
      return;
    case ShapeKind::capsule: {
      radius = shape.radius_m();
      const Point half = shape.half_length_m() * ex;
      set(0, o - half, -ey);
      set(1, o + half, ey);
      count = 2;
      return;
    }
    case ShapeKind::box: {
      const Point hx = shape.parameters[0] * ex, hy = shape.parameters[1] * ey;
      const Point left = o - hx, right = o + hx;
      set(0, left - hy, -ey);
      set(1, right - hy, ex);
      set(2, right + hy, ey);
      set(3, left + hy, -ex);
      count = 4;
      return;
    }
    case ShapeKind::polygon: {
      count = static_cast<int>(shape.corner_count());
      for (int k = 0; k < count; ++k) {
        const Vec2 a = shape.corner_m(static_cast<std::size_t>(k));
        const Vec2 b = shape.corner_m(static_cast<std::size_t>(after(k)));
        const double x = b.y - a.y, y = a.x - b.x, length = std::sqrt(x * x + y * y);
        set(static_cast<std::size_t>(k), o + a.x * ex + a.y * ey, (x * ex + y * ey) / length);
      }
      return;
    }
    default:
      break;
  }
  if (collider.geometry == nullptr) return;
  if (const auto* polygon = std::get_if<ConvexPolygon>(&collider.geometry->value)) {
    for (const Vector2& p : polygon->corners) {
      const Vector2& n = polygon->normals[static_cast<std::size_t>(count)];
      set(static_cast<std::size_t>(count++), o + p.x() * ex + p.y() * ey, n.x() * ex + n.y() * ey);
    }
  }
}

int PlanarShape::farthest(const Point& d) const {
  int best = 0;
  double reach = d.dot(corners[0]);
  for (int k = 1; k < count; ++k) {
    const double own = d.dot(corner(k));
    if (own > reach) reach = own, best = k;
  }
  return best;
}

Aabb bounds_in_plane(const Collider& collider) {
  if (collider.shape.kind == ShapeKind::half_space) return {};
  Aabb box;
  const auto* compound =
      collider.geometry ? std::get_if<Compound>(&collider.geometry->value) : nullptr;
  if (compound != nullptr) {
    box = bounds_of_parts(*compound, collider.X_WB, bounds_in_plane);
    if (!box.is_empty()) box.lower.z() = box.upper.z() = 0;
    return box;
  }
  const PlanarShape shape(collider, Vector::Zero());
  for (int k = 0; k < shape.count; ++k) {
    const Vector p(shape.corner(k).x(), shape.corner(k).y(), 0);
    box.lower = box.lower.cwiseMin(p);
    box.upper = box.upper.cwiseMax(p);
  }
  const Vector round(shape.radius, shape.radius, 0);
  return {box.lower - round, box.upper + round};
}

}  // namespace cradle
