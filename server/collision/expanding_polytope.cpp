// The polytope of van den Bergen, "Proximity Queries and Penetration Depth Computation on 3D Game
// Objects" (GDC 2001): its nearest face bounds the overlap from below, the support along that
// face's normal from above.
//
// Where we differ: a face counts by the distance of its plane, with sign, so the origin may be
// outside at first; and the caller decides which bound is good enough.
//
// Cost: 50 .. 80 ns for a corner.
#include "server/collision/expanding_polytope.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "server/collision/lanes.h"

namespace cradle {
namespace {

/// A sine: what is flatter has no normal to speak of.
constexpr double kFlat = 1e-10;
constexpr double kLevel = 1e-14;  // of the coordinates

/// A face whose normal and distance differ by less from those of a face of M is a part of it.
constexpr double kOnePlane = 1e-5, kOnePlane_m = 1e-10;

constexpr std::uint64_t kNumber = 0xff;
double key_of(double distance, std::size_t face) {
  return std::bit_cast<double>((std::bit_cast<std::uint64_t>(distance) & ~kNumber) | face);
}

using Two = double __attribute__((vector_size(16)));

std::uint8_t next_of(std::uint8_t side) {
  return side == 2 ? 0 : static_cast<std::uint8_t>(side + 1);
}

}  // namespace

std::size_t ExpandingPolytope::add_face(std::uint8_t a, std::uint8_t b, std::uint8_t c) {
  const std::size_t f = face_count_++;
  faces_[f].corners = {a, b, c};
  is_removed_[f] = false;
  return f;
}

bool ExpandingPolytope::set_planes(std::size_t first) {
  bool has_flat = false;
  for (std::size_t f = first; f < face_count_; f += 2) {  // two at a time
    const std::size_t g = std::min(f + 1, face_count_ - 1);
    const auto corner = [&](std::size_t k) -> Triple<Two> {
      const Vector &p = corners_[faces_[f].corners[k]].w, &q = corners_[faces_[g].corners[k]].w;
      return {Two{p.x(), q.x()}, Two{p.y(), q.y()}, Two{p.z(), q.z()}};
    };
    const Triple<Two> p = corner(0), ab = corner(1) - p, ac = corner(2) - p;
    const Triple<Two> normal = cross(ab, ac);
    const Two area2 = dot(normal, normal), length2 = dot(ab, ab) * dot(ac, ac);
    const auto is_wide = area2 > kFlat * kFlat * length2;
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
  if (!(volume * volume > kFlat * kFlat * across.squaredNorm() * up.squaredNorm())) return false;
  if (volume > 0) std::swap(corners_[1], corners_[2]);
  corner_count_ = 4;
  face_count_ = 0;
  // Corner 3 is now below the first face, as seen from outside.
  add_face(0, 1, 2);
  add_face(0, 3, 1);
  add_face(1, 3, 2);  // kWithoutFirst
  add_face(2, 3, 0);
  for (std::uint8_t f = 1; f < 4; ++f) {
    join({0, static_cast<std::uint8_t>(f - 1)}, {f, 2});
    join({f, 1}, {f < 3 ? static_cast<std::uint8_t>(f + 1) : std::uint8_t{1}, 0});
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
  return key < bound ? static_cast<int>(std::bit_cast<std::uint64_t>(key) & kNumber) : -1;
}

bool ExpandingPolytope::expand(int f, const Difference& corner) {
  if (corner_count_ == kCornersMax) return false;
  const auto top = static_cast<std::uint8_t>(corner_count_++);
  // By component: to read them at once would mean to wait until they have been written.
  corners_[top].w = Vector(corner.w.x(), corner.w.y(), corner.w.z());
  corners_[top].a = corner.a;
  // Faces that the corner is level with go too, else a flat one may take their place.
  const double level = kLevel * corner.w.cwiseAbs().maxCoeff();
  const auto from = static_cast<std::uint8_t>(f);
  Rim rim;
  remove(from);
  for (const Edge& beyond : faces_[from].across) remove_seeing(corner.w, level, beyond, rim);
  return fill_hole(rim, top);
}

void ExpandingPolytope::remove_seeing(const Vector& w, double level, const Edge& edge, Rim& rim) {
  if (is_removed_[edge.face]) return;
  const Face& face = faces_[edge.face];
  if (!(face.n.dot(w) > face.distance - level)) {
    rim.add(edge);
    return;
  }
  remove(edge.face);
  const std::uint8_t left = next_of(edge.side), right = next_of(left);
  remove_seeing(w, level, face.across[left], rim);
  remove_seeing(w, level, face.across[right], rim);
}

bool ExpandingPolytope::fill_hole(const Rim& rim, std::uint8_t top) {
  if (rim.is_broken || rim.count < 3 || face_count_ + rim.count > kFacesMax) return false;
  const std::size_t first = face_count_, last = first + rim.count - 1;
  const std::uint8_t begin = end_of(rim.edges[0]);
  std::uint8_t end = begin;
  for (std::size_t k = 0; k < rim.count; ++k) {
    const std::uint8_t start = start_of(rim.edges[k]);
    const std::uint8_t next_end = k + 1 < rim.count ? end_of(rim.edges[k + 1]) : begin;
    if (start != next_end) return false;  // not one ring: rounding has cut it
    const std::size_t f = add_face(end, start, top);
    const auto left = static_cast<std::uint8_t>(f < last ? f + 1 : first);
    const auto right = static_cast<std::uint8_t>(f > first ? f - 1 : last);
    faces_[f].across = {rim.edges[k], Edge{left, 2}, Edge{right, 1}};
    across(rim.edges[k]) = {static_cast<std::uint8_t>(f), 0};
    end = next_end;
  }
  return set_planes(first);
}

std::array<double, 3> ExpandingPolytope::weights_at_foot(const Face& face) const {
  const Vector &a = corners_[face.corners[0]].w, &b = corners_[face.corners[1]].w,
               &c = corners_[face.corners[2]].w;
  const double w_a = face.n.dot(b.cross(c)), w_b = face.n.dot(c.cross(a)),
               w_c = face.n.dot(a.cross(b));
  const double sum = w_a + w_b + w_c;  // twice the area
  return {w_a / sum, w_b / sum, w_c / sum};
}

bool ExpandingPolytope::has_foot(const Face& face) const {
  return std::ranges::min(weights_at_foot(face)) >= 0;
}

int ExpandingPolytope::face_at_foot(const Vector& n, double distance) const {
  // Removed faces count, too: their corners are in M, and that is all that is asked of them.
  int best = -1;
  double inside = -std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f < face_count_ && inside < 0; ++f) {
    if (std::abs(faces_[f].distance - distance) > kOnePlane_m) continue;
    if ((faces_[f].n - n).squaredNorm() > kOnePlane * kOnePlane) continue;
    const double inside_here = std::ranges::min(weights_at_foot(faces_[f]));
    if (inside_here > inside) best = static_cast<int>(f), inside = inside_here;
  }
  return best;
}

Vector ExpandingPolytope::foot_on_A(const Face& face) const {
  const std::array<double, 3> weights = weights_at_foot(face);
  double sum = 0;
  Vector foot = Vector::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    const double w = std::max(0.0, weights[k]);
    sum += w;
    foot += w * corners_[face.corners[k]].a;
  }
  return foot / sum;
}

}  // namespace cradle
