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
// Cost at -O3: 50 ns, and as much again where five points or more are reduced to four.
#include "server/collision/box_faces.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

#include "server/collision/four_points.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// m / m: a face so level raises no point by more than it may be off, however far that slides.
constexpr double kLevel = 5e-5;
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
  double inside = -kInfinity;  // how far the one farthest inside is from leaving, m

  void add(const Vector& p, std::uint32_t feature, double here) {
    items[count++] = {p, feature};
    inside = std::max(inside, here);
  }

  bool any_within(double distance, double x, double y) const {
    return std::ranges::any_of(std::span(items).first(count), [&](const Candidate& c) {
      return std::abs(c.p.x() - x) <= distance && std::abs(c.p.y() - y) <= distance;
    });
  }
};

struct ReferenceFace {
  double half_x, half_y;
  int x, y, z;                                 // axes of the box that are those of F
  double turn;                                 // of z: -1 on the lower side
  std::array<std::uint32_t, kSides> side_bit;  // of the sides x+, x-, y+, y-

  double inside(const Vector& p) const {
    return std::min(half_x - std::abs(p.x()), half_y - std::abs(p.y()));
  }
};

struct IncidentFace {
  Vector middle, half_x, half_y;  // in F
  double length_x, length_y;      // of the halves
  double slope2;                  // of its plane, m / m, squared
  std::array<Vector, kSides> corners;
  std::array<std::uint32_t, kSides> corner_bits;
  // How far a corner is outside each side of the reference face, and outside which it is: a bit a
  // side.
  std::array<std::array<double, kSides>, kSides> outside;
  std::array<std::uint32_t, kSides> sides_beyond;
};

ReferenceFace make_reference(const FacingBoxes& boxes, int axis) {
  ReferenceFace face;
  face.x = axis < 2 ? axis + 1 : 0;
  face.y = axis > 0 ? axis - 1 : 2;
  face.z = axis;
  face.turn = boxes.t[axis] >= 0 ? 1 : -1;
  face.half_x = boxes.h_reference[face.x];
  face.half_y = boxes.h_reference[face.y];
  face.side_bit = {2u << 2 * face.x, 1u << 2 * face.x, 2u << 2 * face.y, 1u << 2 * face.y};
  return face;
}

/// The face of the incident box that looks most against the normal.
void make_incident(const FacingBoxes& boxes, const ReferenceFace& reference, double slack,
                   IncidentFace& face) {
  const Matrix& C = boxes.C;
  const Vector& h = boxes.h_incident;
  const auto in_F = [&](const auto& v) {
    return Vector(v[reference.x], v[reference.y], reference.turn * v[reference.z]);
  };
  const double up_x = std::abs(C(reference.z, 0)), up_y = std::abs(C(reference.z, 1)),
               up_z = std::abs(C(reference.z, 2));
  const int axis = up_x >= up_y ? (up_x >= up_z ? 0 : 2) : (up_y >= up_z ? 1 : 2);
  const int x = axis < 2 ? axis + 1 : 0, y = axis > 0 ? axis - 1 : 2;
  const bool upper = reference.turn * C(reference.z, axis) < 0;
  face.middle = in_F(boxes.t) + in_F(C.col(axis)) * (upper ? h[axis] : -h[axis]);
  face.middle.z() -= boxes.h_reference[reference.z];
  face.half_x = in_F(C.col(x)) * h[x];
  face.half_y = in_F(C.col(y)) * h[y];
  face.length_x = h[x];
  face.length_y = h[y];
  const double up = C(reference.z, axis);
  face.slope2 = 1 / (up * up) - 1;
  for (std::size_t k = 0; k < kSides; ++k) {
    Vector& p = face.corners[k];
    p = face.middle + face.half_x * kSignX[k] + face.half_y * kSignY[k];
    face.corner_bits[k] = static_cast<std::uint32_t>(upper) << axis |
                          static_cast<std::uint32_t>(kSignX[k] > 0) << x |
                          static_cast<std::uint32_t>(kSignY[k] > 0) << y;
    auto& outside = face.outside[k];
    outside = {p.x() - reference.half_x, -p.x() - reference.half_x, p.y() - reference.half_y,
               -p.y() - reference.half_y};
    face.sides_beyond[k] = static_cast<std::uint32_t>(outside[0] > slack) |
                           static_cast<std::uint32_t>(outside[1] > slack) << 1 |
                           static_cast<std::uint32_t>(outside[2] > slack) << 2 |
                           static_cast<std::uint32_t>(outside[3] > slack) << 3;
  }
}

/// Adds where the edge from corner `k` to the next enters the reference face, and where it leaves
/// it. Ends that are inside are added as corners: each by the edge that starts there.
void clip_edge(const IncidentFace& incident, std::size_t k, const ReferenceFace& face,
               Candidates& candidates) {
  const std::size_t next = (k + 1) % kSides;
  std::uint32_t enters = incident.sides_beyond[k], leaves = incident.sides_beyond[next];
  if ((enters & leaves) != 0) return;
  const Vector& p0 = incident.corners[k];
  const Vector& p1 = incident.corners[next];
  const auto at = [&](std::uint32_t side) {
    const double d0 = incident.outside[k][side], d1 = incident.outside[next][side];
    return d0 / (d0 - d1);
  };
  double enter = 0, leave = 1;  // fractions of the edge
  std::uint32_t enter_side = 0, leave_side = 0;
  for (; enters != 0; enters &= enters - 1) {
    const auto side = static_cast<std::uint32_t>(std::countr_zero(enters));
    const double t = std::min(1.0, at(side));
    if (t > enter) enter = t, enter_side = face.side_bit[side];
  }
  for (; leaves != 0; leaves &= leaves - 1) {
    const auto side = static_cast<std::uint32_t>(std::countr_zero(leaves));
    const double t = std::max(0.0, at(side));
    if (t < leave) leave = t, leave_side = face.side_bit[side];
  }
  const std::uint32_t from = incident.corner_bits[k], to = incident.corner_bits[next];
  const std::uint32_t edge = name_of(from & to, from | to) << 6;
  if (enter <= leave && enter < 1) {
    if (enter > 0) {
      candidates.add(p0 + (p1 - p0) * enter, edge | enter_side, 0);
    } else {
      candidates.add(p0, name_of(from, from) << 6, face.inside(p0));
    }
  }
  if (enter < leave && leave < 1) candidates.add(p0 + (p1 - p0) * leave, edge | leave_side, 0);
}

/// Adds the corners of the reference face that are inside the incident face, or up to `slack`
/// outside (else boxes whose corners only just reach over each other lose all points at once), but
/// for those with a candidate within `slack`: so a flush stack has four candidates, and need not be
/// reduced.
void add_reference_corners(const IncidentFace& incident, const ReferenceFace& face, double slack,
                           Candidates& candidates) {
  const Vector &c = incident.middle, &e = incident.half_x, &f = incident.half_y;
  const double inverse = 1 / (e.x() * f.y() - e.y() * f.x());
  for (std::size_t k = 0; k < kSides; ++k) {
    const double x = kSignX[k] * face.half_x, y = kSignY[k] * face.half_y;
    const double a = ((x - c.x()) * f.y() - (y - c.y()) * f.x()) * inverse;
    const double b = ((y - c.y()) * e.x() - (x - c.x()) * e.y()) * inverse;
    const double inside =
        std::min((1 - std::abs(a)) * incident.length_x, (1 - std::abs(b)) * incident.length_y);
    if (!(inside > -slack) || candidates.any_within(slack, x, y)) continue;
    const std::uint32_t common = incident.corner_bits[0] & incident.corner_bits[2];
    const std::uint32_t any = incident.corner_bits[0] | incident.corner_bits[2];
    const std::uint32_t sides =
        face.side_bit[kSignX[k] > 0 ? 0 : 1] | face.side_bit[kSignY[k] > 0 ? 2 : 3];
    candidates.add({x, y, c.z() + a * e.z() + b * f.z()}, name_of(common, any) << 6 | sides,
                   inside);
  }
}

/// What a separation changes by at most as features slide, m / m: corners of the reference face
/// over the incident plane, and its edges over the sides.
double steepness(const IncidentFace& incident, double slack) {
  double most2 = incident.slope2;
  if (most2 < kLevel * kLevel) return 0;
  for (std::size_t k = 0; k < kSides; ++k) {
    const std::size_t next = (k + 1) % kSides;
    const double rise = incident.corners[next].z() - incident.corners[k].z();
    for (std::size_t side = 0; side < kSides; ++side) {
      const double d0 = incident.outside[k][side], d1 = incident.outside[next][side];
      if ((d0 > slack) == (d1 > slack)) continue;
      most2 = std::max(most2, rise * rise / ((d1 - d0) * (d1 - d0)));
    }
  }
  return std::sqrt(most2);
}

}  // namespace

Manifold clip_faces(const FacingBoxes& boxes, int axis, std::uint32_t role, double margin,
                    double slack) {
  const ReferenceFace face = make_reference(boxes, axis);
  IncidentFace incident;
  make_incident(boxes, face, slack, incident);

  Candidates candidates;
  for (std::size_t k = 0; k < kSides; ++k) clip_edge(incident, k, face, candidates);
  add_reference_corners(incident, face, slack, candidates);

  const auto begin = candidates.items.begin();
  const auto near = std::remove_if(begin, begin + static_cast<std::ptrdiff_t>(candidates.count),
                                   [&](const Candidate& c) { return !(c.p.z() <= margin); });
  std::span<Candidate> points(begin, near);
  if (points.size() > kManifoldPoints) {
    bring_best_four(points);
    points = points.first(kManifoldPoints);
  }

  const Matrix& R = boxes.X_WR.R;
  const Vector x_W = R.col(face.x), y_W = R.col(face.y), z_W = face.turn * R.col(face.z);
  const Vector origin_W = boxes.X_WR.x + z_W * boxes.h_reference[axis];
  Manifold manifold;
  manifold.normal_W = role == 0 ? z_W : Vector(-z_W);
  manifold.count = static_cast<int>(points.size());
  const auto number = static_cast<std::uint32_t>(2 * axis + (face.turn > 0 ? 1 : 0));
  const std::uint32_t face_name = (6 * role + number) << 12;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vector& p = points[k].p;
    manifold.points[k] = {origin_W + x_W * p.x() + y_W * p.y() + z_W * (0.5 * p.z()), p.z(),
                          face_name | points[k].feature};
  }
  manifold.lead =
      std::min(candidates.inside + slack, kTolerances.kept_slide_m / steepness(incident, slack));
  return manifold;
}

}  // namespace cradle
