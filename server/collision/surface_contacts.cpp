// A convex shape C on a triangle of a surface.
//
// Symbols: n normal of the triangle, p its corners, e its edges, r radius of C's core, s
// separation; m a direction from the surface to C. A direction can part C from the surface only if
// it is the normal of the surface somewhere: at a triangle n, at a ridge any between the normals of
// the two triangles beside it, at a vertex any that no edge there rises along; at flat edges and in
// valleys there are none but those of the triangles. So of each triangle:
// 1. if C's deepest point along n lies over it, farther inside its ridges and borders than below
//    it, n is the best of these directions (see best_face.cpp), and no search is needed;
// 2. if it has neither ridges nor borders, only n is left: what of C lies over it, touches it;
// 3. else the direction of least overlap of C and the triangle counts, if it is a normal of the
//    surface there; if not, as in 2.
// Points along n are C's corners over the triangle, where its edges leave the surface or pass a
// ridge, and vertices on ridges under C's face. So nothing of how a flat surface is cut into
// triangles is seen in points and their names.
//
// At last, a contact is taken out if C is parted sooner from all of its triangle by a plane that
// touches the surface elsewhere: a convex surface is left by the shortest way, as if it were a
// hull.
//
// Where we differ: Terdiman ("Generating contacts for meshes", 2015) and Jolt replace normals after
// collision; here those of edges that cannot be felt are not sought. What has its centre behind a
// triangle is not stopped by its face.
#include "server/collision/surface_contacts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/collision/convex_pair.h"
#include "server/collision/feature_overlap.h"

namespace cradle {
namespace {

constexpr std::size_t kFanMax = 1000;    // triangles around a vertex that are looked at
constexpr std::size_t kPlanesMax = 256;  // that are asked whether they part C from a triangle

std::size_t corner_before(std::size_t k) { return k == 0 ? 2 : k - 1; }
std::size_t corner_after(std::size_t k) { return k == 2 ? 0 : k + 1; }

std::uint32_t name_of_crossing(std::uint32_t edge, bool leaves) {
  return 3u << 30 | edge << 15 | static_cast<std::uint32_t>(leaves);
}
bool is_active(EdgeKind kind) { return kind != EdgeKind::inner; }

/// The box of C in its frame, grown.
Aabb box_with(const ConvexShape& C, double margin) {
  const Vector grow = Vector::Constant(margin);
  if (C.kind == ShapeKind::hull) return {C.hull->lower - grow, C.hull->upper + grow};
  const Vector& size = C.size;
  Vector half = size;  // box, ellipsoid
  if (C.kind == ShapeKind::sphere) half.setConstant(C.radius);
  if (C.kind == ShapeKind::capsule) half = {size.x(), size.x(), size.x() + size.y()};
  if (C.kind == ShapeKind::cylinder || C.kind == ShapeKind::cone) {
    half = {size.x(), size.x(), size.y()};
  }
  return {-half - grow, half + grow};
}

/// Goes round the vertex at corner k of t, from triangle to triangle. `visit(triangle, k)` is false
/// to stop, and then so is the result.
template <class F>
bool for_fan(const SurfaceView& surface, const SurfaceTriangle& t, std::size_t k, F&& visit) {
  const std::int32_t v = t.vertices[k];
  for (const bool is_forward : {false, true}) {
    SurfaceTriangle at = t;
    std::size_t corner = k;
    for (std::size_t step = 0; step < kFanMax; ++step) {
      if ((step > 0 || !is_forward) && !visit(at, corner)) return false;
      const std::int32_t next = surface.neighbour(at, is_forward ? corner : corner_before(corner));
      if (next < 0) break;
      if (next == t.number) return true;  // all round
      at = surface.triangle(next);
      corner = at.vertices[0] == v ? 0 : at.vertices[1] == v ? 1 : 2;
    }
  }
  return true;
}

}  // namespace

std::uint32_t name_of_corner(std::uint32_t name) { return 1u << 30 | name; }
std::uint32_t name_of_vertex(std::int32_t v) {
  return 2u << 30 | (static_cast<std::uint32_t>(v) & 0x3fffffff);
}

/// 15 bits, the same from both sides of an edge.
std::uint32_t name_of_edge(const SurfaceTriangle& t, std::size_t k) {
  const auto a = static_cast<std::uint32_t>(t.vertices[k]);
  const auto b = static_cast<std::uint32_t>(t.vertices[corner_after(k)]);
  return (std::min(a, b) * 31 + std::max(a, b)) & 0x7fff;
}

bool admits_edge(const SurfaceView& surface, const SurfaceTriangle& t, std::size_t k,
                 const Vector& m, double sine) {
  const EdgeKind kind = surface.edge_kind(t, k);
  if (!is_active(kind)) return false;
  const Vector e = t.edge(k);
  if (m.dot(t.normal.cross(e)) > sine) return false;
  if (kind == EdgeKind::border) return m.dot(t.normal) >= -sine;
  const Vector n_beyond = surface.triangle(surface.neighbour(t, k)).normal;
  return m.dot(e.cross(n_beyond)) <= sine;
}

bool admits_vertex(const SurfaceView& surface, const SurfaceTriangle& t, std::size_t k,
                   const Vector& m, double sine) {
  bool is_felt = false, is_in_front = false;
  const bool is_in_cone =
      for_fan(surface, t, k, [&](const SurfaceTriangle& at, std::size_t corner) {
        is_felt = is_felt || is_active(surface.edge_kind(at, corner)) ||
                  is_active(surface.edge_kind(at, corner_before(corner)));
        is_in_front = is_in_front || m.dot(at.normal) >= -sine;
        return m.dot(at.edge(corner)) <= sine && m.dot(at.edge(corner_before(corner))) >= -sine;
      });
  return is_in_cone && is_felt && is_in_front;
}

/// A triangle's sides as seen along n.
struct SurfaceContactFinder::Over {
  const SurfaceTriangle& t;
  std::array<Vector, 3> inward;  ///< unit
  std::array<bool, 3> is_active_edge;

  Over(const SurfaceTriangle& triangle, const std::array<bool, 3>& is_active)
      : t(triangle), is_active_edge(is_active) {
    for (std::size_t k = 0; k < 3; ++k) inward[k] = t.normal.cross(t.edge(k));
  }
  double height(const Vector& p) const { return t.normal.dot(p - t.corners[0]); }
  double inside(std::size_t k, const Vector& p) const { return inward[k].dot(p - t.corners[k]); }
  double inside(const Vector& p) const {
    return std::min({inside(0, p), inside(1, p), inside(2, p)});
  }
  bool has_active_edges() const {
    return is_active_edge[0] || is_active_edge[1] || is_active_edge[2];
  }
  /// From the nearest ridge or border.
  double inside_active(const Vector& p) const {
    double least = kInfinity;
    for (std::size_t k = 0; k < 3; ++k) {
      if (is_active_edge[k]) least = std::min(least, inside(k, p));
    }
    return least;
  }
};

SurfaceContactFinder::SurfaceContactFinder(const SurfaceView& surface, const Collider& convex,
                                           const Pose& X_SC, double margin,
                                           SurfaceFindings& findings)
    : surface_(surface),
      shape_(convex),
      X_SC_(X_SC),
      centre_(X_SC.x + X_SC.R * shape_.centre),
      margin_(margin),
      reach_(box_with(shape_, margin)),
      seam_(kTolerances.seam * (1 + X_SC.x.cwiseAbs().maxCoeff())),
      scale_(std::min(1.0, shape_.thickness / kTolerances.nominal_half_extent_m)),
      contacts_(findings.contacts),
      planes_(findings.planes),
      wrong_(findings.wrong) {}

/// Farther than the margin, for a face of C's box parts it from C: most that a search would look
/// at.
bool SurfaceContactFinder::is_beyond_box(const std::array<Vector, 3>& seen) const {
  const auto& [a, b, c] = seen;
  return (a.cwiseMin(b).cwiseMin(c).array() > reach_.upper.array()).any() ||
         (a.cwiseMax(b).cwiseMax(c).array() < reach_.lower.array()).any();
}

void SurfaceContactFinder::add(const SurfaceTriangle& t) {
  if (t.normal.isZero(0)) return;
  if (shape_.kind == ShapeKind::sphere) return add_sphere(t);
  std::int32_t hint = 0;
  const Vector a = X_SC_.x + X_SC_.R * shape_.support(-(X_SC_.R.transpose() * t.normal), hint);
  const double s_core = t.normal.dot(a - t.corners[0]);
  add_parting(t.normal, t.corners[0], s_core - shape_.radius);
  if (!(s_core - shape_.radius <= margin_)) return;

  const auto is_felt = [&](std::size_t k) { return is_active(surface_.edge_kind(t, k)); };
  const std::array<bool, 3> active = {is_felt(0), is_felt(1), is_felt(2)};
  const bool has_active = active[0] || active[1] || active[2];
  std::array<Vector, 3> seen;
  if (has_active) {
    seen = seen_from_C(t);
    if (is_beyond_box(seen)) return;
  }
  const Over over(t, active);
  const bool is_over = over.inside(a) >= -seam_;
  const bool is_front = over.height(centre_) > 0;
  if (!has_active || (is_over && over.inside_active(a) >= std::max(0.0, -s_core))) {
    if (is_front) return add_face_points(t, over, false, -kInfinity);
    came_from_behind_ = came_from_behind_ || is_over || over.inside(centre_) >= 0;
    return;
  }
  double least = -kInfinity;
  switch (add_nearest(t, seen, over, least)) {
    case Nearest::beyond:
    case Nearest::face:
      return;
    case Nearest::edge:
      if (is_front) add_face_points(t, over, true, std::min(least, 0.0));
      return;
    case Nearest::none:
      if (least < passed_separation_) passed_ = t.number, passed_separation_ = least;
      if (is_front) return add_face_points(t, over, true, -kInfinity);
      came_from_behind_ = came_from_behind_ || is_over || over.inside(centre_) >= 0;
  }
}

SupportFeature SurfaceContactFinder::part_towards(const Vector& n) const {
  std::int32_t hint = 0;
  SupportFeature part = support_feature(shape_, -(X_SC_.R.transpose() * n), hint);
  for (std::size_t i = 0; i < static_cast<std::size_t>(part.count); ++i) {
    part.corners[i] = X_SC_.x + X_SC_.R * part.corners[i];
  }
  part.normal = X_SC_.R * part.normal;
  return part;
}

/// What is behind two triangles at a valley may be over neither: it is below the one on whose side
/// of the plane between them it is.
bool SurfaceContactFinder::is_below_valley(const SurfaceTriangle& t, const Over& over,
                                           const Vector& p) const {
  if (over.height(p) >= 0) return false;
  for (std::size_t k = 0; k < 3; ++k) {
    if (over.inside(k, p) >= -seam_) continue;
    const std::int32_t beyond = surface_.neighbour(t, k);
    if (over.is_active_edge[k] || beyond < 0) return false;
    const Vector between = t.normal + surface_.triangle(beyond).normal;
    if (between.cross(t.edge(k)).dot(p - t.corners[k]) < -seam_) return false;
  }
  return true;
}

/// Contacts along n; none deeper than `least`.
void SurfaceContactFinder::add_face_points(const SurfaceTriangle& t, const Over& over,
                                           bool corners_only, double least) {
  const SupportFeature part = part_towards(t.normal);
  const auto add_at = [&](const Vector& core, std::uint32_t name) {
    const double s = over.height(core) - shape_.radius;
    if (s < least) return;
    add_point(t, t.normal, core - t.normal * (shape_.radius + 0.5 * s), s, name);
  };
  const auto count = static_cast<std::size_t>(part.count);
  for (std::size_t i = 0; i < count; ++i) {
    if (over.inside(part.corners[i]) >= -seam_ || is_below_valley(t, over, part.corners[i])) {
      add_at(part.corners[i], name_of_corner(part.corner_names[i]));
    }
  }
  if (corners_only || !over.has_active_edges() || count < 2) return;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!over.is_active_edge[k]) continue;
    const Vector edge = t.corners[corner_after(k)] - t.corners[k];
    const double length = edge.norm();
    for (std::size_t i = 0; i < (count == 2 ? 1 : count); ++i) {
      const Vector& from = part.corners[i];
      const Vector& to = part.corners[i + 1 < count ? i + 1 : 0];
      const double d0 = over.inside(k, from), d1 = over.inside(k, to);
      if ((d0 < 0) == (d1 < 0)) continue;
      const Vector at = from + (to - from) * (d0 / (d0 - d1));
      const double along = edge.dot(at - t.corners[k]) / length;
      if (along < -seam_ || along > length + seam_) continue;
      add_at(at, name_of_crossing(part.edge_names[i], d1 < 0));
    }
  }
  if (count > 2) add_vertices(t, over, part);
}

/// Those on ridges and borders under a face of C.
void SurfaceContactFinder::add_vertices(const SurfaceTriangle& t, const Over& over,
                                        const SupportFeature& face) {
  constexpr double kDownward = -0.05;
  const double down = face.normal.dot(t.normal);
  if (down > kDownward) return;
  const auto count = static_cast<std::size_t>(face.count);
  for (std::size_t k = 0; k < 3; ++k) {
    if (!over.is_active_edge[k] && !over.is_active_edge[corner_before(k)]) continue;
    const Vector& v = t.corners[k];
    bool is_under = true;
    for (std::size_t i = 0; i < count && is_under; ++i) {
      const Vector& from = face.corners[i];
      const Vector& to = face.corners[i + 1 < count ? i + 1 : 0];
      is_under = t.normal.dot((to - from).cross(v - from)) < 0;
    }
    if (!is_under) continue;
    const double s = face.normal.dot(face.corners[0] - v) / down - shape_.radius;
    add_point(t, t.normal, v + t.normal * (0.5 * s), s, name_of_vertex(t.vertices[k]));
  }
}

void SurfaceContactFinder::add_plane(std::int32_t triangle, const Vector& normal, double offset,
                                     double least) {
  const SupportFeature part = part_towards(normal);
  for (std::size_t i = 0; i < static_cast<std::size_t>(part.count); ++i) {
    const double s = std::max(normal.dot(part.corners[i]) - offset - shape_.radius, least);
    if (!(s <= margin_)) continue;
    contacts_.push_back({normal, part.corners[i] - normal * (shape_.radius + 0.5 * s), s,
                         name_of_corner(part.corner_names[i]), triangle});
  }
}

void SurfaceContactFinder::add_way_out() {
  if (passed_ < 0) return;
  if (const PartingPlane* plane = parting_plane(passed_, -kInfinity)) {
    add_plane(passed_, plane->normal, plane->offset, passed_separation_);
  }
}

/// Of the planes that the whole triangle is behind, the one that parts C from it soonest, if its
/// separation is more than `from`: C need not move out by more.
const PartingPlane* SurfaceContactFinder::parting_plane(std::int32_t triangle, double from) const {
  const SurfaceTriangle t = surface_.triangle(triangle);
  const PartingPlane* best = nullptr;
  for (const PartingPlane& plane : planes_) {
    if (plane.separation > from && std::ranges::all_of(t.corners, [&](const Vector& corner) {
          return plane.normal.dot(corner) <= plane.offset + seam_;
        })) {
      best = &plane, from = plane.separation;
    }
  }
  return best;
}

/// Takes out contacts whose triangles another plane parts from C sooner, such as those with the far
/// sides of a thin wedge that C touches with its edge. Where no contact is left to hold C off, as
/// the direction of such a plane was not found by the search, the best stays.
void SurfaceContactFinder::mark_parted() {
  if (planes_.size() > kPlanesMax) {
    // Not std::stable_sort, which would ask for memory.
    std::ranges::sort(planes_, {}, [](const PartingPlane& plane) {
      return std::pair(-plane.separation, plane.found);
    });
    planes_.resize(kPlanesMax);
  }
  const double slack = scale_ * kTolerances.witness_m;
  bool is_held = false;
  std::size_t best = contacts_.size();
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const double s = contacts_[i].separation;
    if (!(s < 0) || wrong_[i]) continue;
    const PartingPlane* sooner = parting_plane(contacts_[i].triangle, s + slack);
    wrong_[i] = sooner != nullptr;
    is_held = is_held || !wrong_[i];
    if (wrong_[i] && sooner->separation < 0 &&
        (best == contacts_.size() || s > contacts_[best].separation)) {
      best = i;
    }
  }
  if (!is_held && best < contacts_.size()) wrong_[best] = false;
}

/// Both triangles at an edge may have touched it along directions of their own: the one that parts
/// C from the surface sooner is right.
void SurfaceContactFinder::settle() {
  constexpr double kSame_m = 1e-7;
  const auto is_wrong = [&](const SurfaceContact& c) {
    return c.edge != 0 && std::ranges::any_of(contacts_, [&](const SurfaceContact& other) {
             return other.edge == c.edge && other.least > c.least + kSame_m;
           });
  };
  // In steps: what is taken out still tells about others.
  wrong_.clear();
  for (const SurfaceContact& c : contacts_) wrong_.push_back(is_wrong(c));
  mark_parted();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    if (!wrong_[i]) contacts_[kept++] = contacts_[i];
  }
  contacts_.resize(kept);
}

}  // namespace cradle
