// The polytope of van den Bergen, "Proximity Queries and Penetration Depth Computation on 3D Game
// Objects" (GDC 2001): its nearest face bounds the overlap from below, the support along that
// face's normal from above.
//
// Where we differ: a face counts by the distance of its plane, with sign, so the origin may be
// outside at first; and the caller decides which bound is good enough.
//
// Cost: 40 .. 70 ns for a corner.
#include "server/collision/expanding_polytope.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "server/collision/lanes.h"

namespace cradle {
namespace {

/// A sine: what is flatter has no normal to speak of.
constexpr double kFlatFace = 1e-10;
constexpr double kLevel = 1e-14;  // of the coordinates

/// A face whose normal and distance differ by less from those of a face of M is a part of it.
constexpr double kOnePlane = 1e-5, kOnePlane_m = 1e-10;

constexpr std::uint64_t kFaceNumber = 0xff;
double key_of(double distance, std::size_t face) {
  return std::bit_cast<double>((std::bit_cast<std::uint64_t>(distance) & ~kFaceNumber) | face);
}

using Two = double __attribute__((vector_size(16)));

}  // namespace

ExpandingPolytope::Edge ExpandingPolytope::add_face(std::uint8_t a, std::uint8_t b,
                                                    std::uint8_t c) {
  const std::size_t f = face_count_++;
  const std::array<std::uint8_t, 4> corners = {a, b, c, a};
  std::memcpy(&start_[4 * f], corners.data(), corners.size());
  is_removed_[f] = false;
  return 4 * f;
}

bool ExpandingPolytope::set_planes(std::size_t first) {
  bool has_flat = false;
  for (std::size_t f = first; f < face_count_; f += 2) {  // two at a time
    const std::size_t g = std::min(f + 1, face_count_ - 1);
    const auto corners = [&](std::size_t k) -> Triple<Two> {
      const Vector &p = corner(4 * f + k).w, &q = corner(4 * g + k).w;
      return {Two{p.x(), q.x()}, Two{p.y(), q.y()}, Two{p.z(), q.z()}};
    };
    const Triple<Two> p = corners(0), ab = corners(1) - p, ac = corners(2) - p;
    const Triple<Two> normal = cross(ab, ac);
    const Two area2 = dot(normal, normal), length2 = dot(ab, ab) * dot(ac, ac);
    const auto is_wide = area2 > kFlatFace * kFlatFace * length2;
    has_flat |= (is_wide[0] & is_wide[1]) == 0;
    const Triple<Two> n = (1.0 / root(area2)) * normal;
    const Two distance = dot(n, p);
    set_plane(g, {n.x[1], n.y[1], n.z[1]}, distance[1]);
    set_plane(f, {n.x[0], n.y[0], n.z[0]}, distance[0]);
  }
  for (std::size_t f = face_count_; f % 4 != 0; ++f) keys_[f] = kClosed;
  return !has_flat;
}

void ExpandingPolytope::set_plane(std::size_t f, const Vector& n, double distance) {
  faces_[f].n = n;
  faces_[f].distance = distance;
  keys_[f] = key_of(distance, f);
}

bool ExpandingPolytope::begin(const std::array<Difference, 4>& corners) {
  std::copy(corners.begin(), corners.end(), corners_.begin());
  const Vector& o = corners[0].w;
  const Vector across = (corners[1].w - o).cross(corners[2].w - o);
  const Vector up = corners[3].w - o;
  const double volume = across.dot(up);
  if (!(volume * volume > kFlatFace * kFlatFace * across.squaredNorm() * up.squaredNorm()))
    return false;
  if (volume > 0) std::swap(corners_[1], corners_[2]);
  corner_count_ = 4;
  face_count_ = 0;
  // Corner 3 is now below the first face, as seen from outside.
  const Edge below = add_face(0, 1, 2);
  add_face(0, 3, 1);
  add_face(1, 3, 2);  // kWithoutFirst
  add_face(2, 3, 0);
  for (int f = 1; f < 4; ++f) {
    join(below + static_cast<Edge>(f - 1), edge_of(f) + 2);
    join(edge_of(f) + 1, edge_of(f < 3 ? f + 1 : 1));
  }
  return set_planes(0);
}

int ExpandingPolytope::nearest(double bound) const {
  Two even{kClosed, kClosed}, odd = even;
  const auto look_at_four = [&](std::size_t f) {
    even = smaller(even, Two{keys_[f], keys_[f + 1]});
    odd = smaller(odd, Two{keys_[f + 2], keys_[f + 3]});
  };
  for (std::size_t f = 0; f < face_count_; f += 4) look_at_four(f);
  const Two both = smaller(even, odd);
  const double key = std::min(both[0], both[1]);
  return key < bound ? static_cast<int>(std::bit_cast<std::uint64_t>(key) & kFaceNumber) : -1;
}

bool ExpandingPolytope::expand(int f, const Difference& corner) {
  if (corner_count_ == kCornersMax) return false;
  const auto top = static_cast<std::uint8_t>(corner_count_++);
  // By component: to read them at once would mean to wait until they have been written.
  corners_[top].w = Vector(corner.w.x(), corner.w.y(), corner.w.z());
  corners_[top].a = corner.a;
  corners_[top].name = corner.name;
  // Faces that the corner is level with go too, else a flat one may take their place.
  const double level = kLevel * corner.w.cwiseAbs().maxCoeff();
  const std::size_t first = face_count_;
  remove(static_cast<std::size_t>(f));
  for (Edge side = 0; side < 3; ++side) look_beyond(corner.w, level, edge_of(f) + side);
  return close_ring(first) && set_planes(first);
}

void ExpandingPolytope::look_beyond(const Vector& w, double level, Edge edge) {
  const Edge other = across_[edge];
  const std::size_t f = other / 4;
  if (is_removed_[f]) return;
  if (faces_[f].n.dot(w) > faces_[f].distance - level) {
    remove(f);
    const Edge left = next_of(other);
    look_beyond(w, level, left);
    look_beyond(w, level, next_of(left));
  } else if (face_count_ < kFacesMax) {
    const auto top = static_cast<std::uint8_t>(corner_count_ - 1);
    join(add_face(start_[edge], start_[edge + 1], top), other);
  }
}

bool ExpandingPolytope::close_ring(std::size_t first) {
  if (face_count_ - first < 3 || face_count_ == kFacesMax) return false;
  Edge before = 4 * (face_count_ - 1);
  for (Edge edge = 4 * first; edge < 4 * face_count_; edge += 4) {
    if (start_[before + 1] != start_[edge]) return false;  // cut by rounding
    join(before + 1, edge + 2);
    before = edge;
  }
  return true;
}

std::array<double, 3> ExpandingPolytope::weights_at_foot(int f) const {
  const Vector &a = corner(edge_of(f)).w, &b = corner(edge_of(f) + 1).w,
               &c = corner(edge_of(f) + 2).w;
  const Vector& n = face(f).n;
  const double w_a = n.dot(b.cross(c)), w_b = n.dot(c.cross(a)), w_c = n.dot(a.cross(b));
  const double sum = w_a + w_b + w_c;  // twice the area
  return {w_a / sum, w_b / sum, w_c / sum};
}

int ExpandingPolytope::face_at_foot(int f, const Vector& n, double distance) const {
  if (f >= 0 && has_foot(f)) return f;
  // Removed faces count, too: their corners are in M, and that is all that is asked of them.
  int best = -1;
  double inside = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < face_count_ && inside < 0; ++k) {
    if (std::abs(faces_[k].distance - distance) > kOnePlane_m) continue;
    if ((faces_[k].n - n).squaredNorm() > kOnePlane * kOnePlane) continue;
    const double inside_here = std::ranges::min(weights_at_foot(static_cast<int>(k)));
    if (inside_here > inside) best = static_cast<int>(k), inside = inside_here;
  }
  return best;
}

Vector ExpandingPolytope::foot_on_A(int f) const {
  const std::array<double, 3> weights = weights_at_foot(f);
  double sum = 0;
  Vector foot = Vector::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    const double w = std::max(0.0, weights[k]);
    sum += w;
    foot += w * corner(edge_of(f) + k).a;
  }
  return foot / sum;
}

}  // namespace cradle
