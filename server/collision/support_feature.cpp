// Which part of a shape looks along a direction d.
//
// A disc (the caps of cylinders, the base of cones) stands as an octagon whose first corner is the
// rim's farthest point along d: so the deepest point is exact, and all move smoothly as the shape
// rocks or rolls. Where the disc is level to rounding they may jump around the rim; but then all
// carry alike. (With corners fixed in the body, and the farthest point among them, a stack of
// cylinders never came to rest.) The sides of cylinders, cones and capsules stand as the one line
// of them that lies farthest along d.
//
// Names: corners of a box as in box_faces.h; of a disc 0 .. 7 from the farthest point on, 8 more at
// the upper cap; of lines 0 the lower and 1 the upper end; of hulls the number of the vertex.
// Edges: of boxes by what their corners have in common, of hulls their numbers. (Beyond 2^15 the
// numbers of hulls begin again: names of one face hardly ever clash.)
#include "server/collision/support_feature.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/collision/box_faces.h"
#include "server/collision/index.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

/// Beyond this cosine between d and an axis, the cap of a cylinder looks along d more than its side
/// does; of a capsule, only the end does.
constexpr double kLying = 0.7;
/// An edge that rises so much along d (the sine of its slope) counts as its farther end alone, and
/// so does a face as its edge.
constexpr double kSteep = 0.95;
/// Sine of an edge's slope that is rounding: both ends are farthest, and which is found is chance.
constexpr double kLevelFeature = 1e-9;
/// m. A rim whose farthest point leads by less is level, and its octagon begins at x.
constexpr double kLead_m = 1e-10;

constexpr double kDiagonal = std::numbers::sqrt2 / 2;
constexpr std::array<double, 8> kOctagonX = {1,  kDiagonal,  0, -kDiagonal,
                                             -1, -kDiagonal, 0, kDiagonal};
constexpr std::array<double, 8> kOctagonY = {0, kDiagonal,  1,  kDiagonal,
                                             0, -kDiagonal, -1, -kDiagonal};

/// A disc at height z about the axis of z; `side` is 1 if it looks along z, -1 if against it.
SupportFeature disc(double r, double z, double side, const Vector& d) {
  SupportFeature face;
  face.normal = {0, 0, side};
  face.is_round = true;
  const double across = std::sqrt(d.x() * d.x() + d.y() * d.y());
  const bool is_tilted = r * across > kLead_m;
  face.is_level = !is_tilted;
  const double ex = is_tilted ? d.x() / across : 1, ey = is_tilted ? d.y() / across : 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const double c = kOctagonX[i], s = side * kOctagonY[i];
    const auto name = static_cast<std::uint32_t>(i) + (side > 0 ? 8 : 0);
    face.add({r * (c * ex - s * ey), r * (c * ey + s * ex), z}, name, name);
  }
  return face;
}

SupportFeature point(const Vector& p, std::uint32_t name) {
  SupportFeature feature;
  feature.add(p, name, 0);
  return feature;
}

/// The line between two points; only its farther end if it is steep.
SupportFeature line(const Vector& lower, const Vector& upper,
                    const std::array<double, 2>& roundness, const Vector& d) {
  const Vector along = upper - lower;
  const double rise = along.dot(d);
  if (std::abs(rise) > kSteep * along.norm()) {
    return rise > 0 ? point(upper, 1) : point(lower, 0);
  }
  SupportFeature feature;
  feature.add(lower, 0, 0);
  feature.add(upper, 1, 0);
  feature.roundness = roundness;
  return feature;
}

/// The side line of a body of revolution, toward d.
SupportFeature side(double r_lower, double r_upper, double half_length, const Vector& d) {
  const double across = std::sqrt(d.x() * d.x() + d.y() * d.y());
  const double ex = across > 0 ? d.x() / across : 1, ey = across > 0 ? d.y() / across : 0;
  return line({r_lower * ex, r_lower * ey, -half_length}, {r_upper * ex, r_upper * ey, half_length},
              {r_lower, r_upper}, d);
}

SupportFeature box_face(const Vector& h, const Vector& d) {
  const Vector size = d.cwiseAbs();
  // Which axis and side it is is chance: no branches.
  int axis = size.y() > size.x() ? 1 : 0;
  axis = size.z() > size[axis] ? 2 : axis;
  const bool upper = d[axis] >= 0;
  const double ends[3][2] = {{-h.x(), h.x()}, {-h.y(), h.y()}, {-h.z(), h.z()}};
  // Counter-clockwise as seen from outside.
  constexpr int kNext[] = {1, 2, 0, 1, 2};
  const int x = kNext[axis + (upper ? 0 : 1)], y = kNext[axis + (upper ? 1 : 0)];
  SupportFeature face;
  face.normal[axis] = upper ? 1 : -1;
  std::array<std::uint32_t, 4> bits;
  constexpr std::array<bool, 4> kRight = {true, false, false, true};
  constexpr std::array<bool, 4> kUp = {true, true, false, false};
  for (std::size_t k = 0; k < 4; ++k) {
    bits[k] = static_cast<std::uint32_t>(upper) << axis |
              static_cast<std::uint32_t>(kRight[k]) << x | static_cast<std::uint32_t>(kUp[k]) << y;
  }
  for (std::size_t k = 0; k < 4; ++k) {
    const std::uint32_t next = bits[(k + 1) % 4];
    face.add({ends[0][bits[k] & 1], ends[1][bits[k] >> 1 & 1], ends[2][bits[k] >> 2]}, bits[k],
             name_of(bits[k] & next, bits[k] | next));
  }
  return face;
}

/// The corners of a hull's face, or of the panel that it is part of. Of more than fit, some are
/// left out, but not `farthest`.
SupportFeature face_of_hull(const ConvexHull& hull, std::size_t f, std::int32_t farthest) {
  SupportFeature face;
  face.normal = hull.normals[f];
  const std::int32_t panel = hull.panel_of[f];
  const auto& first = panel < 0 ? hull.first : hull.panel_first;
  const auto begin = index(first[panel < 0 ? f : index(panel)]);
  const auto count = index(first[(panel < 0 ? f : index(panel)) + 1]) - begin;
  const auto place = [&](std::size_t k) {
    return panel < 0 ? begin + k : index(hull.panel_places[begin + k]);
  };
  constexpr auto kMost = static_cast<std::size_t>(SupportFeature::kCornersMax);
  const std::size_t step = (count + kMost - 1) / kMost;
  std::size_t start = 0;
  while (step > 1 && start < count && hull.loops[place(start)] != farthest) ++start;
  for (std::size_t i = 0; i < count; i += step) {
    const std::size_t k = place((start + i) % count);
    face.add(hull.vertices[index(hull.loops[k])], static_cast<std::uint32_t>(hull.loops[k]),
             static_cast<std::uint32_t>(hull.edge_at[k]));
  }
  return face;
}

/// The place in `loops` where the edge that begins at place `k` begins on its other side.
std::size_t twin(const ConvexHull& hull, std::size_t k, std::int32_t from, std::int32_t to) {
  const auto begin = index(hull.around_first[index(to)]);
  const auto end = index(hull.around_first[index(to) + 1]);
  for (std::size_t i = begin; i < end; ++i) {
    if (hull.neighbours[i] == from) return index(hull.around[i]);
  }
  return k;
}

/// Of the faces around the farthest vertex, the one that looks most along d. If an edge there lies
/// across d, it is a face with that edge; but a flush one is only left for an edge that is level.
SupportFeature hull_feature(const ConvexHull& hull, const Vector& d, std::int32_t v) {
  const auto begin = index(hull.around_first[index(v)]);
  const auto end = index(hull.around_first[index(v) + 1]);
  const auto face_at = [&](std::size_t place) { return index(hull.face_at[place]); };
  const auto along = [&](std::size_t place) { return hull.normals[face_at(place)].dot(d); };
  const Vector& p = hull.vertices[index(v)];
  std::size_t most = begin, flattest = begin;
  double best_along = -2, least_drop = -2;
  for (std::size_t k = begin; k < end; ++k) {  // which it will be is chance: no branches
    const double by_face = along(index(hull.around[k])), slope = hull.edges_along[k].dot(d);
    most = by_face > best_along ? k : most;
    best_along = std::max(best_along, by_face);
    flattest = slope > least_drop ? k : flattest;
    least_drop = std::max(least_drop, slope);
  }
  std::size_t best = index(hull.around[most]);
  const std::int32_t u = hull.neighbours[flattest];
  const std::size_t edge_place = index(hull.around[flattest]);
  constexpr double kFlush = kTolerances.flush_cosine;
  const bool is_flush = best_along >= kFlush, is_level = least_drop > -kLevelFeature;
  if ((is_level || !is_flush) && least_drop * least_drop < 1 - kFlush * kFlush) {
    const std::size_t other = twin(hull, edge_place, v, u);
    best = along(other) > along(edge_place) ? other : edge_place;
  }
  if (along(best) > 0 && along(best) * along(best) > 1 - kSteep * kSteep) {
    return face_of_hull(hull, face_at(best), v);
  }
  if (least_drop < -kSteep) return point(p, static_cast<std::uint32_t>(v));
  SupportFeature edge;
  const auto name = static_cast<std::uint32_t>(hull.edge_at[edge_place]);
  edge.add(p, static_cast<std::uint32_t>(v), name);
  edge.add(hull.vertices[index(u)], static_cast<std::uint32_t>(u), name);
  return edge;
}

SupportFeature cone_feature(double r, double h, const Vector& d) {
  const double across = std::sqrt(d.x() * d.x() + d.y() * d.y());
  // The outward normal of the side, toward d, is (2 h, r) in (across, z), but for its length.
  const double along_side = (2 * h * across + r * d.z()) / std::sqrt(4 * h * h + r * r);
  if (-d.z() > along_side) return disc(r, -h, -1, d);
  return side(r, 0, h, d);
}

}  // namespace

SupportFeature support_feature(const ConvexShape& shape, const Vector& d, std::int32_t& hint,
                               std::int32_t farthest) {
  const double r = shape.size.x(), h = shape.size.y();
  switch (shape.kind) {
    case ShapeKind::box:
      return box_face(shape.size, d);
    case ShapeKind::capsule:
      if (std::abs(d.z()) > kLying) return point({0, 0, d.z() > 0 ? h : -h}, d.z() > 0);
      return line({0, 0, -h}, {0, 0, h}, {r, r}, d);
    case ShapeKind::cylinder:
      if (std::abs(d.z()) > kLying) return disc(r, d.z() > 0 ? h : -h, d.z() > 0 ? 1 : -1, d);
      return side(r, r, h, d);
    case ShapeKind::cone:
      return cone_feature(r, h, d);
    case ShapeKind::hull:
      if (farthest < 0) shape.support(d, farthest = hint);
      return hull_feature(*shape.hull, d, hint = farthest);
    default:
      return point(shape.support(d, hint), 0);
  }
}

}  // namespace cradle
