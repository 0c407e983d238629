#include "server/collision/planar_shape.h"

#include <cradle/limits.h>

#include <cmath>

#include "server/collision/bounds.h"
#include "server/collision/planar_pairs.h"

namespace cradle {

static_assert(PlanarShape::kCornersMax >= limits::kCorners);

namespace {

/// The axes of a shape's frame in the plane, and where its origin is.
struct Frame {
  Point o, ex, ey;

  Point turned(double x, double y) const { return x * ex + y * ey; }
};

void set(PlanarShape& shape, std::size_t k, const Point& p, const Point& n) {
  shape.corners[k] = p;
  shape.normals[k] = n;
}

void place_box(PlanarShape& placed, const Shape& shape, const Frame& F) {
  const Point hx = shape.parameters[0] * F.ex, hy = shape.parameters[1] * F.ey;
  const Point left = F.o - hx, right = F.o + hx;
  set(placed, 0, left - hy, -F.ey);
  set(placed, 1, right - hy, F.ex);
  set(placed, 2, right + hy, F.ey);
  set(placed, 3, left + hy, -F.ex);
  placed.count = 4;
}

void place_polygon(PlanarShape& placed, const Shape& shape, const Frame& F) {
  placed.count = static_cast<int>(shape.corner_count());
  for (int k = 0; k < placed.count; ++k) {
    const Vec2 a = shape.corner_m(static_cast<std::size_t>(k));
    const Vec2 b = shape.corner_m(static_cast<std::size_t>(placed.after(k)));
    const double x = b.y - a.y, y = a.x - b.x, length = std::sqrt(x * x + y * y);
    set(placed, static_cast<std::size_t>(k), F.o + a.x * F.ex + a.y * F.ey,
        F.turned(x, y) / length);
  }
}

void place_polygon(PlanarShape& placed, const ConvexPolygon& polygon, const Frame& F) {
  for (const Vector2& p : polygon.corners) {
    const auto k = static_cast<std::size_t>(placed.count++);
    const Vector2& n = polygon.normals[k];
    set(placed, k, F.o + p.x() * F.ex + p.y() * F.ey, F.turned(n.x(), n.y()));
  }
}

}  // namespace

void PlanarShape::place(const Collider& collider, const Point& o) {
  const Matrix& R = collider.X_WB.R;
  const Frame F{o, {R(0, 0), R(1, 0)}, {R(0, 1), R(1, 1)}};
  const Shape& shape = collider.shape;
  switch (shape.kind) {
    case ShapeKind::sphere:
      radius = shape.radius_m();
      corners[0] = o;
      count = 1;
      return;
    case ShapeKind::capsule: {
      radius = shape.radius_m();
      const Point half = shape.half_length_m() * F.ex;
      set(*this, 0, o - half, -F.ey);
      set(*this, 1, o + half, F.ey);
      count = 2;
      return;
    }
    case ShapeKind::box:
      return place_box(*this, shape, F);
    case ShapeKind::polygon:
      return place_polygon(*this, shape, F);
    default:
      break;
  }
  if (collider.geometry == nullptr) return;
  const auto* polygon = std::get_if<ConvexPolygon>(&collider.geometry->value);
  if (polygon != nullptr) place_polygon(*this, *polygon, F);
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
