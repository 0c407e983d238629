// Convex shapes of the plane: separating edges, then the clipped edges or two corners.
//
// Method: s(n), how far the cores of A and B are apart along n, is largest at the normal of an edge
// of one of them if they overlap (then -s is the least overlap), and else between two normals that
// follow each other in the sum of the shapes. There s is the distance of two corners, and since s
// is concave where it is positive, these corners belong to the best edge: the end that the deepest
// corner lies beyond, and that corner. What meets along an edge is clipped as in Gottschalk's boxes
// or Box2D's polygons (Catto, "b2CollidePolygons").
// Symbols: n normal from the reference shape to the other, t along the reference edge
// counter-clockwise, u position along t, s height over the edge (negative: overlap); cores without
// their radii. All relative to the origin of A, so that no digits are lost far from W's.
// Where we differ: a point is named by the corner that makes it and the edge that it meets,
// whichever shape is the reference; so shapes that lie flush keep their names though the roles
// change at every tick. No lead is needed, and the normal is the best one exactly.
// Exact to rounding. Every edge is compared with every corner: cost O(corners of A times corners of
// B), at -O2 two discs 15 ns, disc and rectangle 45 ns, two rectangles 85 ns.
#include "server/collision/planar_pairs.h"

#include <algorithm>
#include <cmath>

#include "server/collision/pair_functions.h"
#include "server/collision/planar_shape.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

/// m. Two edges whose best separations differ by less are equally good, and A's is taken.
constexpr double kSameEdge = 1e-12;

enum class CornerMeeting : std::uint32_t { corner_of_A = 0, corner_of_B = 1, corners = 2 };

/// `a` and `b` are numbers of corners, or of the edges that these meet.
std::uint32_t name_of(CornerMeeting meeting, int a, int b) {
  return static_cast<std::uint32_t>(meeting) << 16 | static_cast<std::uint32_t>(a) << 8 |
         static_cast<std::uint32_t>(b);
}

double cross(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }
Vector lifted(const Point& p) { return {p.x(), p.y(), 0}; }

/// The edge of a shape that parts it best from another one, which has a corner nearest to it.
struct BestEdge {
  double s = -kInfinity;
  int edge = 0;
  int nearest = 0;
};

BestEdge best_edge(const PlanarShape& A, const PlanarShape& B) {
  BestEdge best;
  for (int k = 0; k < A.edges(); ++k) {
    const Point& n = A.normal(k);
    double lowest = kInfinity;
    int nearest = 0;
    for (int j = 0; j < B.count; ++j) {
      const double height = n.dot(B.corner(j));
      if (height < lowest) lowest = height, nearest = j;
    }
    const double s = lowest - n.dot(A.corner(k));
    if (s > best.s) best = {s, k, nearest};
  }
  return best;
}

/// Two shapes on their way to a manifold.
struct Meet {
  const PlanarShape &A, &B;
  const Vector& origin_W;
  double margin;
  Manifold manifold;

  bool has_disc() const { return A.count == 1 || B.count == 1; }  // one point, without a name

  void set_normal(const Point& n) { manifold.normal_W = lifted(n); }

  /// p and q on the cores of A and B, s from p to q along the normal.
  void add(const Point& p, const Point& q, double s, std::uint32_t name) {
    const double separation = s - A.radius - B.radius;
    if (!(separation <= margin)) return;
    const Vector middle = lifted(0.5 * (p + q)) + 0.5 * (A.radius - B.radius) * manifold.normal_W;
    manifold.points[static_cast<std::size_t>(manifold.count++)] = {origin_W + middle, separation,
                                                                   has_disc() ? 0 : name};
  }

  /// Corner i of A and corner j of B are nearest; `d` from one to the other is not zero.
  void add_corners(int i, int j, const Point& d) {
    const double distance = d.norm();
    set_normal(d / distance);
    add(A.corner(i), B.corner(j), distance, name_of(CornerMeeting::corners, i, j));
  }
};

/// Whether nothing of the core is farther along `d` than its corner k, which has an edge.
bool is_farthest(const PlanarShape& core, int k, const Point& d) {
  const Point& p = core.corner(k);
  return core.count == 1 || (d.dot(core.corner(core.after(k)) - p) <= 0 &&
                             d.dot(core.corner(core.before(k)) - p) <= 0);
}

/// The other shape's edge that faces the reference edge, between corners at `lower` and `upper`
/// along t.
struct FacingEdge {
  int edge, lower, upper;
};

FacingEdge facing_edge(const PlanarShape& other, int nearest, const Point& n) {
  const int before = other.before(nearest);
  const bool is_next = other.normal(nearest).dot(n) <= other.normal(before).dot(n);
  const int edge = is_next ? nearest : before;
  return {edge, other.after(edge), edge};
}

/// Where the nearest corner of the other shape, which is apart, lies beyond an end of the reference
/// edge, that corner and that end are nearest to each other. The reference is A, or B if `on_B`.
bool meet_planar_corners(Meet& meet, bool on_B, const BestEdge& best) {
  const PlanarShape& reference = on_B ? meet.B : meet.A;
  const PlanarShape& other = on_B ? meet.A : meet.B;
  const Point& n = reference.normal(best.edge);
  const int last = reference.after(best.edge);
  const Point& q = other.corner(best.nearest);
  const bool is_before = cross(n, q - reference.corner(best.edge)) < 0;
  if (!is_before && !(cross(n, q - reference.corner(last)) > 0)) return false;
  const int end = is_before ? best.edge : last;
  const auto meet_corner = [&](int corner) {
    const int i = on_B ? corner : end, j = on_B ? end : corner;
    const Point d = meet.B.corner(j) - meet.A.corner(i);
    if (!(d.norm() > kTolerances.coincident_m)) return false;
    if (!is_farthest(meet.A, i, d) || !is_farthest(meet.B, j, -d)) return false;
    meet.add_corners(i, j, d);
    return true;
  };
  if (meet_corner(best.nearest)) return true;
  if (other.count == 1) return false;
  // Of an edge that is parallel to rounding the other corner may be the nearer; or it reaches over
  // the reference edge, and they meet along it.
  const FacingEdge facing = facing_edge(other, best.nearest, n);
  return meet_corner(is_before ? facing.upper : facing.lower);
}

/// The reference is A, or B if `on_B`.
void clip(Meet& meet, bool on_B, const BestEdge& best) {
  const PlanarShape& reference = on_B ? meet.B : meet.A;
  const PlanarShape& other = on_B ? meet.A : meet.B;
  const int first = best.edge, last = reference.after(best.edge);
  const Point n = reference.normal(best.edge), t(-n.y(), n.x());
  const Point& start = reference.corner(first);
  const double length = t.dot(reference.corner(last) - start);
  meet.set_normal(on_B ? Point(-n) : n);

  const auto add = [&](double u, double s, bool by_reference, int corner, int edge) {
    const Point p = start + u * t, q = p + s * n;
    const CornerMeeting meeting =
        by_reference == on_B ? CornerMeeting::corner_of_B : CornerMeeting::corner_of_A;
    const int own = by_reference ? corner : best.edge, others = by_reference ? edge : corner;
    const std::uint32_t name = on_B ? name_of(meeting, others, own) : name_of(meeting, own, others);
    on_B ? meet.add(q, p, s, name) : meet.add(p, q, s, name);
  };
  const auto place = [&](int corner) { return t.dot(other.corner(corner) - start); };
  const auto height = [&](int corner) { return n.dot(other.corner(corner) - start); };
  if (other.count == 1) return add(place(0), best.s, false, 0, 0);

  const FacingEdge facing = facing_edge(other, best.nearest, n);
  const double u_lower = place(facing.lower), u_upper = place(facing.upper);
  const double s_lower = height(facing.lower), s_upper = height(facing.upper);
  // What is outside by rounding is not cut: of a steep edge that would take away the deepest point.
  const double tie = kTolerances.tie_m * std::min(1.0, length);
  const double u_0 = u_lower < -tie ? 0 : u_lower, u_1 = u_upper > length + tie ? length : u_upper;
  if (!(u_1 - u_0 > tie)) {  // it stands on its corner
    return add(std::clamp(place(best.nearest), 0.0, length), best.s, false, best.nearest, 0);
  }
  const double slope = (s_upper - s_lower) / (u_upper - u_lower);
  const auto s_at = [&](double u) {
    return u == u_lower ? s_lower : u == u_upper ? s_upper : s_lower + slope * (u - u_lower);
  };
  // Where two corners lie over each other, A's gives the name, however they sway.
  const auto is_by_reference = [&](double ahead) {  // of the other's corner, by which it is inside
    return std::abs(ahead) <= kTolerances.clip_slack_m * std::min(1.0, length) ? !on_B : ahead < 0;
  };
  const auto add_lower = [&] {
    const bool own = is_by_reference(u_lower);
    add(u_0, s_at(u_0), own, own ? first : facing.lower, facing.edge);
  };
  const auto add_upper = [&] {
    const bool own = is_by_reference(length - u_upper);
    add(u_1, s_at(u_1), own, own ? last : facing.upper, facing.edge);
  };
  // In one order, whichever is the reference.
  on_B ? add_upper() : add_lower();
  on_B ? add_lower() : add_upper();
}

Manifold collide_convex(const Collider& collider_A, const Collider& collider_B, double margin) {
  const Vector& origin_W = collider_A.X_WB.x;
  const PlanarShape A(collider_A, origin_W), B(collider_B, origin_W);
  Meet meet{A, B, origin_W, margin, {}};
  if (A.count == 0 || B.count == 0) return meet.manifold;
  const double reach = A.radius + B.radius + margin;
  const BestEdge of_A = best_edge(A, B);
  if (of_A.s > reach) return meet.manifold;
  const BestEdge of_B = best_edge(B, A);
  const bool on_B = of_B.s > of_A.s + kSameEdge;
  const BestEdge& best = on_B ? of_B : of_A;
  if (!(best.s <= reach && best.s > -kInfinity)) return meet.manifold;

  // The core of a capsule is a line: what lies on it beyond its ends is at no height, and apart.
  if (best.s > -kTolerances.coincident_m && meet_planar_corners(meet, on_B, best))
    return meet.manifold;
  clip(meet, on_B, best);
  return meet.manifold;
}

/// That of balls, whose centres lie in the plane.
Manifold collide_discs(const Collider& A, const Collider& B, double margin) {
  Manifold manifold = sphere_sphere(A, B, margin);
  if (manifold.count > 0 && manifold.normal_W.z() != 0) {  // one centre
    manifold.normal_W = Vector::UnitY();
    manifold.points[0].p_W.z() = 0;
  }
  return manifold;
}

/// A: convex, B: half-space.
Manifold stand(const Collider& convex, const Collider& half_space, double margin) {
  const Vector& origin_W = convex.X_WB.x;
  const PlanarShape A(convex, origin_W);
  Manifold manifold;
  if (A.count == 0) return manifold;
  const Vector up_W = half_space.X_WB.R.col(2);
  const Point up(up_W.x(), up_W.y());
  const double height = up_W.dot(origin_W - half_space.X_WB.x);
  manifold.normal_W = -up_W;
  const auto add = [&](int k) {
    const double s = height + up.dot(A.corner(k)) - A.radius;
    if (!(s <= margin)) return;
    const Vector p_W = origin_W + lifted(A.corner(k));
    manifold.points[static_cast<std::size_t>(manifold.count++)] = {
        p_W - up_W * (A.radius + 0.5 * s), s, static_cast<std::uint32_t>(k)};
  };
  const int lowest = A.farthest(-up);
  if (A.count == 1) {
    add(0);
    return manifold;
  }
  // The edge that faces the ground, its corners in their order.
  const int before = A.before(lowest);
  const int edge = A.normal(lowest).dot(up) <= A.normal(before).dot(up) ? lowest : before;
  add(edge);
  add(A.after(edge));
  return manifold;
}

/// One sum: it is finite only if all that is used of the pose is.
bool is_finite(const Pose& X) {
  return std::isfinite(X.x.x() + X.x.y() + X.R(0, 0) + X.R(0, 1) + X.R(0, 2) + X.R(1, 0) +
                       X.R(1, 1) + X.R(1, 2));
}

bool is_of_plane(ShapeKind kind) {
  return kind == ShapeKind::sphere || kind == ShapeKind::box || kind == ShapeKind::capsule ||
         kind == ShapeKind::polygon;
}

bool is_polygon(const StoredGeometry* geometry) {
  return geometry != nullptr && std::holds_alternative<ConvexPolygon>(geometry->value);
}

}  // namespace

std::string_view shape_out_of_plane(const Shape& shape, const StoredGeometry* geometry) {
  const ShapeKind kind = shape.kind;
  if (is_of_plane(kind) || kind == ShapeKind::none || kind == ShapeKind::half_space) return "";
  if (is_polygon(geometry)) return "";
  const auto* compound = geometry ? std::get_if<Compound>(&geometry->value) : nullptr;
  if (compound == nullptr) {
    return "its shape is none of a planar world: sphere, box, capsule, polygon, half_space or "
           "compound";
  }
  for (const CompoundPart& part : compound->parts) {
    if (!is_of_plane(part.shape.kind) && !is_polygon(part.geometry.get())) {
      return "a part of it has a shape that is none of a planar world: sphere, box, capsule or "
             "polygon";
    }
    if (part.p_BoPo.z() != 0 || part.q_BP.x() != 0 || part.q_BP.y() != 0) {
      return "a part of it leaves the plane z = 0, or is turned about another axis than z";
    }
  }
  return "";
}

std::string_view shape_out_of_space(const Shape& shape, const StoredGeometry* geometry) {
  if (shape.kind == ShapeKind::polygon || is_polygon(geometry)) {
    return "a polygon is a shape of planar worlds alone";
  }
  const auto* compound = geometry ? std::get_if<Compound>(&geometry->value) : nullptr;
  if (compound == nullptr) return "";
  for (const CompoundPart& part : compound->parts) {
    if (!shape_out_of_space(part.shape, part.geometry.get()).empty()) {
      return "a part of it is a polygon, a shape of planar worlds alone";
    }
  }
  return "";
}

Manifold collide_in_plane(const Collider& A, const Collider& B, double margin) {
  const bool is_A_half_space = A.shape.kind == ShapeKind::half_space;
  const bool is_B_half_space = B.shape.kind == ShapeKind::half_space;
  if (!is_finite(A.X_WB) || !is_finite(B.X_WB)) return {};
  if (is_A_half_space && is_B_half_space) return {};
  if (is_B_half_space) return stand(A, B, margin);
  const bool are_discs = A.shape.kind == ShapeKind::sphere && B.shape.kind == ShapeKind::sphere;
  if (are_discs) return collide_discs(A, B, margin);
  if (!is_A_half_space) return collide_convex(A, B, margin);
  Manifold manifold = stand(B, A, margin);
  manifold.normal_W = -manifold.normal_W;
  return manifold;
}

}  // namespace cradle
