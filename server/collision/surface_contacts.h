/// Where a convex shape touches single triangles of a surface. Private to this folder.
///
/// Everything in the frame S of the surface, m. C is the convex shape.
#pragma once

#include <vector>

#include "server/collision/support_feature.h"
#include "server/collision/surface.h"

namespace cradle {

/// One point, with the normal of its own.
struct SurfaceContact {
  Vector normal;      ///< unit, out of the surface
  Vector p;           ///< midway between the two surfaces along the normal
  double separation;  ///< along the normal
  std::uint32_t name;
  std::int32_t triangle = -1;
  std::uint64_t edge = 0;  ///< of a contact with an edge: which; else 0
  double least = 0;        ///< of such a contact: separation by the direction that was found
};

/// A plane that touches the surface: C, moved out by its separation, is in front.
struct PartingPlane {
  Vector normal;      ///< unit, one of the surface
  double offset;      ///< m; the plane is normal . p = offset
  double separation;  ///< of C, along the normal
  std::size_t found;  ///< before others
};

/// What was found, in room that is used again.
struct SurfaceFindings {
  std::vector<SurfaceContact> contacts;
  std::vector<PartingPlane> planes;
  std::vector<bool> wrong;  ///< of contacts

  void clear() { contacts.clear(), planes.clear(), wrong.clear(); }
};

/// C over one triangle after the other.
class SurfaceContactFinder {
 public:
  /// `X_SC` is the convex collider's pose in S. `findings` is empty.
  SurfaceContactFinder(const SurfaceView& surface, const Collider& convex, const Pose& X_SC,
                       double margin, SurfaceFindings& findings);

  void add(const SurfaceTriangle& triangle);

  /// Whether C reached through a triangle from behind, and was not stopped for that.
  bool came_from_behind() const { return came_from_behind_; }

  /// C against all of the half-space behind the triangle's plane.
  void add_plane(const SurfaceTriangle& triangle) {
    add_plane(triangle.number, triangle.normal, triangle.normal.dot(triangle.corners[0]),
              -std::numeric_limits<double>::infinity());
  }
  /// Likewise by the plane that parts C soonest from the triangle that it passes through most, no
  /// deeper than it does that. To be called where nothing else touches: no way out was found.
  void add_way_out();

  /// C's middle.
  const Vector& centre() const { return centre_; }
  double thickness() const { return shape_.thickness; }

  /// To be called after the last triangle: takes out what other triangles tell better.
  void settle();

  /// Contacts nearer to each other than this are one, m.
  double same_place() const { return scale_ * kTolerances.clip_slack_m; }

 private:
  struct Over;
  /// What of a triangle is nearest to C, along a normal of the surface; none: along no such.
  enum class Nearest { beyond, face, edge, none };

  std::array<Vector, 3> seen_from_C(const SurfaceTriangle& t) const {
    const Matrix T = X_SC_.R.transpose();
    const auto seen = [&](std::size_t k) { return Vector(T * (t.corners[k] - X_SC_.x)); };
    return {seen(0), seen(1), seen(2)};
  }
  bool is_beyond_box(const std::array<Vector, 3>& seen) const;
  SupportFeature part_towards(const Vector& n) const;
  void add_sphere(const SurfaceTriangle& t);
  void add_face_points(const SurfaceTriangle& t, const Over& over, bool corners_only, double least);
  void add_vertices(const SurfaceTriangle& t, const Over& over, const SupportFeature& face);
  struct Touch;
  void add_face_of_least(const SurfaceTriangle& t, const Over& over, const Touch& touch);
  bool is_below_valley(const SurfaceTriangle& t, const Over& over, const Vector& p) const;
  bool is_at_top(const SurfaceTriangle& t, const Touch& touch) const;
  bool add_edge_or_vertex(const SurfaceTriangle& t, Touch& touch);
  Nearest add_nearest(const SurfaceTriangle& t, const std::array<Vector, 3>& seen, const Over& over,
                      double& least);
  void add_point(const SurfaceTriangle& t, const Vector& normal, const Vector& p, double separation,
                 std::uint32_t name) {
    if (separation <= margin_) contacts_.push_back({normal, p, separation, name, t.number});
  }
  void add_parting(const Vector& normal, const Vector& p, double separation) {
    planes_.push_back({normal, normal.dot(p), separation, planes_.size()});
  }
  void add_plane(std::int32_t triangle, const Vector& normal, double offset, double least);
  const PartingPlane* parting_plane(std::int32_t triangle, double from) const;
  void mark_parted();

  const SurfaceView& surface_;
  const ConvexShape shape_;
  const Pose X_SC_;
  const Vector centre_;
  const double margin_;
  const Aabb reach_;    ///< C with the margin, in the frame of C
  const double seam_;   ///< m
  const double scale_;  ///< of tolerances that shrink with thin shapes
  std::vector<SurfaceContact>& contacts_;
  std::vector<PartingPlane>& planes_;
  std::vector<bool>& wrong_;
  bool came_from_behind_ = false;
  std::int32_t passed_ = -1;      ///< the triangle that C passes through most without a contact,
  double passed_separation_ = 0;  ///< and how deep
};

std::uint32_t name_of_corner(std::uint32_t name);                     ///< of C
std::uint32_t name_of_vertex(std::int32_t v);                         ///< of the surface
std::uint32_t name_of_edge(const SurfaceTriangle& t, std::size_t k);  ///< 15 bits

/// Of the triangle, to any point.
Vector nearest_point(const SurfaceTriangle& t, const Vector& p);

/// Whether a body at the direction `m`, unit, from the triangle's edge k feels that edge: it is no
/// inner one, and none of the triangles beside it is nearer.
bool admits_edge(const SurfaceView& surface, const SurfaceTriangle& t, std::size_t k,
                 const Vector& m, double sine);
/// Likewise the vertex at corner k.
bool admits_vertex(const SurfaceView& surface, const SurfaceTriangle& t, std::size_t k,
                   const Vector& m, double sine);

}  // namespace cradle
