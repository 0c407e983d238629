// Face contact of two boxes: the part of one face that lies over the other, as at most four points.
//
// Method: the incident face, the one that looks most against the normal, is clipped against the
// sides of the reference face. Both are convex quadrilaterals in the plane, so the corners of their
// intersection are of three kinds: corners of the incident face, its edges cut by a side (both by
// Liang and Barsky, "A new concept and method for line clipping", 1984, on each edge by itself),
// and corners of the reference face inside the incident one (by a 2x2 solve).
//
// Everything is in the frame F of the reference face: origin in its middle, z along the normal n
// toward the incident box. So z of a point is its separation, and x, y its place in the face.
//
// Feature: where an incident corner, edge or face meets no, one or two sides of the reference face:
//   bits 12.. role and number of the reference face, 6..11 incident corner, edge or face,
//   0..5 set of the reference box's sides. Distinct within a manifold by construction, and the
//   same when another incident face that shares the corner or edge takes over.
//
// Where we differ from Sutherland and Hodgman (1974): no polygon is carried from side to side, so
// each point's name comes from what it is and not from how it was made; and a corner up to `slack`
// outside counts as inside, so that flush stacks keep their points and names.
// Cost at -O2: 0.1 us, and as much again where five points or more are reduced to four.
#include "server/collision/box_faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "server/collision/four_points.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

constexpr std::size_t kSides = 4;
// Of a quadrilateral's corners, in order. (No C arrays: g++ 12 with -fsanitize=bounds misreads an
// index inside a shift.)
constexpr std::array<double, kSides> kSignX = {1, -1, -1, 1};
constexpr std::array<double, kSides> kSignY = {1, 1, -1, -1};

/// A point of the manifold before reduction, in F.
struct Candidate {
  Vector p;  // z is the separation
  std::uint32_t feature;
};

/// At most two points for each incident edge, and the four reference corners.
struct Candidates {
  std::array<Candidate, 2 * kSides + kSides> items;
  std::size_t count = 0;

  void add(const Vector& p, std::uint32_t feature) { items[count++] = {p, feature}; }

  bool any_within(double distance, double x, double y) const {
    return std::ranges::any_of(std::span(items).first(count), [&](const Candidate& c) {
      return std::abs(c.p.x() - x) <= distance && std::abs(c.p.y() - y) <= distance;
    });
  }
};

struct ReferenceFace {
  Vector origin_W;
  Matrix axes_W;  // columns: x and y along the face, z out of it
  double half_x = 0, half_y = 0;
  std::uint32_t number = 0;                      // 0 .. 5: twice the axis, plus 1 on its upper side
  std::array<std::uint32_t, kSides> side_bit{};  // of the sides x+, x-, y+, y-
};

struct IncidentFace {
  Vector middle, half_x, half_y;  // in F
  std::array<Vector, kSides> corners;
  std::array<std::uint32_t, kSides> corner_bits{};
};

ReferenceFace make_reference(const PosedBox& box, int axis, const Vector& toward_W) {
  const Matrix& R = box.X_WB.R;
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  const bool upper = R.col(axis).dot(toward_W) >= 0;
  ReferenceFace face;
  face.axes_W.col(0) = R.col(x);
  face.axes_W.col(1) = R.col(y);
  face.axes_W.col(2) = upper ? Vector(R.col(axis)) : Vector(-R.col(axis));
  face.origin_W = box.X_WB.x + face.axes_W.col(2) * box.half_extents[axis];
  face.half_x = box.half_extents[x];
  face.half_y = box.half_extents[y];
  face.number = static_cast<std::uint32_t>(2 * axis + upper);
  face.side_bit = {2u << 2 * x, 1u << 2 * x, 2u << 2 * y, 1u << 2 * y};
  return face;
}

/// The face of `box` that looks most against the normal of `reference`.
IncidentFace make_incident(const PosedBox& box, const ReferenceFace& reference) {
  const Vector& h = box.half_extents;
  const Matrix axes = reference.axes_W.transpose() * box.X_WB.R;
  int axis = 0;
  axes.row(2).cwiseAbs().maxCoeff(&axis);
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  const bool upper = axes(2, axis) < 0;
  IncidentFace face;
  face.middle = reference.axes_W.transpose() * (box.X_WB.x - reference.origin_W) +
                axes.col(axis) * (upper ? h[axis] : -h[axis]);
  face.half_x = axes.col(x) * h[x];
  face.half_y = axes.col(y) * h[y];
  for (std::size_t k = 0; k < kSides; ++k) {
    face.corners[k] = face.middle + face.half_x * kSignX[k] + face.half_y * kSignY[k];
    face.corner_bits[k] = static_cast<std::uint32_t>(upper) << axis |
                          static_cast<std::uint32_t>(kSignX[k] > 0) << x |
                          static_cast<std::uint32_t>(kSignY[k] > 0) << y;
  }
  return face;
}

/// Adds where the edge from corner `k` to the next enters the reference face, and where it leaves
/// it. Ends that are inside are added as corners: each by the edge that starts there.
void clip_edge(const IncidentFace& incident, std::size_t k, const ReferenceFace& face, double slack,
               Candidates& candidates) {
  const std::size_t next = (k + 1) % kSides;
  const Vector& p0 = incident.corners[k];
  const Vector& p1 = incident.corners[next];
  const double outside0[kSides] = {p0.x() - face.half_x, -p0.x() - face.half_x,
                                   p0.y() - face.half_y, -p0.y() - face.half_y};
  const double outside1[kSides] = {p1.x() - face.half_x, -p1.x() - face.half_x,
                                   p1.y() - face.half_y, -p1.y() - face.half_y};
  double enter = 0, leave = 1;  // fractions of the edge
  std::uint32_t enter_side = 0, leave_side = 0;
  for (std::size_t side = 0; side < kSides; ++side) {
    const double d0 = outside0[side], d1 = outside1[side];
    if (d0 > slack && d1 > slack) return;
    if (d0 > slack) {
      const double t = std::min(1.0, d0 / (d0 - d1));
      if (t > enter) enter = t, enter_side = face.side_bit[side];
    } else if (d1 > slack) {
      const double t = std::max(0.0, d0 / (d0 - d1));
      if (t < leave) leave = t, leave_side = face.side_bit[side];
    }
  }
  const std::uint32_t from = incident.corner_bits[k], to = incident.corner_bits[next];
  const std::uint32_t edge = name_of(from & to, from | to) << 6;
  if (enter <= leave && enter < 1) {
    const std::uint32_t corner = name_of(from, from) << 6;
    candidates.add(p0 + (p1 - p0) * enter, enter > 0 ? edge | enter_side : corner);
  }
  if (enter < leave && leave < 1) candidates.add(p0 + (p1 - p0) * leave, edge | leave_side);
}

/// Adds the corners of the reference face that are inside the incident face, but for those with a
/// candidate within `slack`: so a flush stack has four candidates, and need not be reduced.
void add_reference_corners(const IncidentFace& incident, const ReferenceFace& face, double slack,
                           Candidates& candidates) {
  const Vector &c = incident.middle, &e = incident.half_x, &f = incident.half_y;
  const double determinant = e.x() * f.y() - e.y() * f.x();
  const std::uint32_t common = incident.corner_bits[0] & incident.corner_bits[2];
  const std::uint32_t any = incident.corner_bits[0] | incident.corner_bits[2];
  for (std::size_t k = 0; k < kSides; ++k) {
    const double x = kSignX[k] * face.half_x, y = kSignY[k] * face.half_y;
    const double a = ((x - c.x()) * f.y() - (y - c.y()) * f.x()) / determinant;
    const double b = ((y - c.y()) * e.x() - (x - c.x()) * e.y()) / determinant;
    if (!(std::abs(a) < 1 && std::abs(b) < 1) || candidates.any_within(slack, x, y)) continue;
    const std::uint32_t sides =
        face.side_bit[kSignX[k] > 0 ? 0 : 1] | face.side_bit[kSignY[k] > 0 ? 2 : 3];
    candidates.add({x, y, c.z() + a * e.z() + b * f.z()}, name_of(common, any) << 6 | sides);
  }
}

}  // namespace

Manifold clip_faces(const PosedBox& reference, const PosedBox& incident, int axis,
                    std::uint32_t role, double margin, double slack) {
  const Vector between_W = incident.X_WB.x - reference.X_WB.x;
  const ReferenceFace face = make_reference(reference, axis, between_W);
  const IncidentFace other = make_incident(incident, face);

  Candidates candidates;
  for (std::size_t k = 0; k < kSides; ++k) clip_edge(other, k, face, slack, candidates);
  add_reference_corners(other, face, slack, candidates);

  const auto begin = candidates.items.begin();
  const auto near = std::remove_if(begin, begin + static_cast<std::ptrdiff_t>(candidates.count),
                                   [&](const Candidate& c) { return !(c.p.z() <= margin); });
  std::span<Candidate> points(begin, near);
  if (points.size() > kManifoldPoints) {
    bring_best_four(points);
    points = points.first(kManifoldPoints);
  }

  Manifold manifold;
  manifold.normal_W = role == 0 ? Vector(face.axes_W.col(2)) : Vector(-face.axes_W.col(2));
  manifold.count = static_cast<int>(points.size());
  const std::uint32_t face_name = (6 * role + face.number) << 12;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vector& p = points[k].p;
    const Vector midway(p.x(), p.y(), 0.5 * p.z());
    manifold.points[k] = {face.origin_W + face.axes_W * midway, p.z(),
                          face_name | points[k].feature};
  }
  return manifold;
}

}  // namespace cradle
