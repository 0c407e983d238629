// A sphere on a triangle of a surface: the nearest point of the triangle to the centre.
//
// Symbols: c centre, r radius, q the nearest point, h height of c over the triangle's plane.
// If q lies on an edge or at a vertex, the contact counts only if none of the triangles beside it
// is nearer; at flat edges and in valleys one always is. (Voronoi regions, as in Ericson,
// "Real-Time Collision Detection" (2005), 5.1.5.)
#include "server/collision/surface_contacts.h"

namespace cradle {

Vector nearest_point(const SurfaceTriangle& t, const Vector& p) {
  double least = std::numeric_limits<double>::infinity();
  Vector nearest = p;
  bool is_over = true;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector edge = t.corners[(k + 1) % 3] - t.corners[k];
    const Vector from = p - t.corners[k];
    if (t.normal.cross(edge).dot(from) >= 0) continue;
    is_over = false;
    const Vector foot = t.corners[k] + within(0, edge.dot(from) / edge.squaredNorm(), 1) * edge;
    if ((p - foot).squaredNorm() < least) least = (p - foot).squaredNorm(), nearest = foot;
  }
  return is_over ? Vector(p - t.normal * t.normal.dot(p - t.corners[0])) : nearest;
}

void SurfaceContactFinder::add_sphere(const SurfaceTriangle& t) {
  const Vector& c = centre_;
  const double r = shape_.radius;
  const double h = t.normal.dot(c - t.corners[0]);
  if (!(h - r <= margin_ && h + r >= -margin_)) return;

  double nearest2 = std::numeric_limits<double>::infinity();
  std::size_t nearest = 0;
  double along = 0, length = 0;
  Vector q = Vector::Zero();
  bool is_over = true;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector& p = t.corners[k];
    const Vector edge = t.corners[(k + 1) % 3] - p;
    const double edge_length = edge.norm();
    const Vector e = edge / edge_length;
    if (t.normal.cross(e).dot(c - p) >= -seam_) continue;
    is_over = false;
    const double u = within(0, e.dot(c - p), edge_length);
    const Vector foot = p + u * e;
    const double distance2 = (c - foot).squaredNorm();
    if (distance2 < nearest2) {
      nearest2 = distance2, nearest = k, along = u, length = edge_length, q = foot;
    }
  }
  if (is_over) {
    if (h < 0) {
      came_from_behind_ = true;
      return;
    }
    return add_point(t, t.normal, c - t.normal * (0.5 * (h + r)), h - r, 0);
  }
  const double d = std::sqrt(nearest2);
  if (!(d - r <= margin_)) return;
  const Vector m = d > kTolerances.coincident_m ? Vector((c - q) / d) : t.normal;
  const double sine = seam_ / std::max(d, seam_);
  const bool is_admitted =
      along > 0 && along < length
          ? admits_edge(surface_, t, nearest, m, sine)
          : admits_vertex(surface_, t, along > 0 ? (nearest + 1) % 3 : nearest, m, sine);
  if (is_admitted) add_point(t, m, 0.5 * (q + c - r * m), d - r, 0);
}

}  // namespace cradle
