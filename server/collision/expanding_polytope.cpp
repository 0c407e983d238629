// The polytope of van den Bergen, "Proximity Queries and Penetration Depth Computation on 3D Game
// Objects" (GDC 2001): its nearest face bounds the overlap from below, the support along that
// face's normal from above.
//
// Where we differ: a face counts by the distance of its plane, with sign, so the origin may be
// outside at first; and the caller decides which bound is good enough.
//
// Cost: 60 .. 100 ns for a corner.
#include "server/collision/expanding_polytope.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cradle {
namespace {

/// A sine: what is flatter has no normal to speak of.
constexpr double kFlat = 1e-10;
constexpr double kLevel = 1e-14;  // of the coordinates

/// A face whose normal and distance differ by less from those of a face of M is a part of it.
constexpr double kOnePlane = 1e-5, kOnePlane_m = 1e-10;

}  // namespace

bool ExpandingPolytope::make_face(std::uint8_t a, std::uint8_t b, std::uint8_t c) {
  const Vector &p = corners_[a].w, ab = corners_[b].w - p, ac = corners_[c].w - p;
  const Vector normal = ab.cross(ac);
  const double area2 = normal.squaredNorm();
  if (!(area2 > kFlat * kFlat * ab.squaredNorm() * ac.squaredNorm())) return false;
  Face& face = faces_[face_count_];
  face.n = normal * (1 / std::sqrt(area2));
  face.distance = face.n.dot(p);
  face.corners = {a, b, c};
  open_[face_count_++] = face.distance;
  return true;
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
  if (!(make_face(0, 1, 2) && make_face(0, 3, 1) && make_face(1, 3, 2) && make_face(2, 3, 0))) {
    return false;
  }
  for (std::uint8_t f = 1; f < 4; ++f) {
    join(0, static_cast<std::uint8_t>(f - 1), f, 2);
    join(f, 1, f < 3 ? static_cast<std::uint8_t>(f + 1) : 1, 0);
  }
  return true;
}

int ExpandingPolytope::nearest(double bound) const {
  int best = -1;
  for (std::size_t f = 0; f < face_count_; ++f) {
    if (open_[f] < bound) bound = open_[f], best = static_cast<int>(f);
  }
  return best;
}

bool ExpandingPolytope::expand(int from, const Difference& corner) {
  if (corner_count_ == kCornersMax) return false;
  const auto added = static_cast<std::uint8_t>(corner_count_++);
  corners_[added] = corner;

  // Faces that the corner is level with go too, else a flat one may take their place.
  const double level = kLevel * corner.w.cwiseAbs().maxCoeff();

  // The faces that see the corner go; the edges around them, in order, are those of the hole.
  std::array<bool, kFacesMax> is_gone;
  std::fill_n(is_gone.begin(), face_count_, false);
  std::array<Edge, kCornersMax> rim;
  std::size_t rim_count = 0;
  std::array<Edge, 2 * kCornersMax> stack;  // how we came to a face, and where to go on
  std::size_t depth = 0;
  const auto enter = [&](std::uint8_t f, std::uint8_t first_side) {
    is_gone[f] = true;
    open_[f] = kClosed;
    stack[depth++] = {f, first_side};
  };
  std::array<std::uint8_t, 2 * kCornersMax> sides_left;
  enter(static_cast<std::uint8_t>(from), 0);
  sides_left[0] = 3;
  while (depth > 0) {
    Edge& at = stack[depth - 1];
    if (sides_left[depth - 1]-- == 0) {
      --depth;
      continue;
    }
    const std::uint8_t f = at.face, side = at.side;
    at.side = static_cast<std::uint8_t>(side == 2 ? 0 : side + 1);
    const std::uint8_t g = faces_[f].across[side];
    if (is_gone[g]) continue;
    const Face& next = faces_[g];
    const std::uint8_t back = next.across[0] == f && next.corners[1] == faces_[f].corners[side] ? 0
                              : next.across[1] == f && next.corners[2] == faces_[f].corners[side]
                                  ? 1
                                  : 2;
    if (next.n.dot(corner.w) > next.distance - level) {
      if (depth == stack.size()) return false;
      sides_left[depth] = 2;
      enter(g, static_cast<std::uint8_t>(back == 2 ? 0 : back + 1));
    } else {
      if (rim_count == rim.size()) return false;
      rim[rim_count++] = {g, back};
    }
  }
  if (rim_count < 3 || face_count_ + rim_count > kFacesMax) return false;
  const auto first = static_cast<std::uint8_t>(face_count_);
  for (std::size_t k = 0; k < rim_count; ++k) {
    const auto [g, side] = rim[k];
    const std::uint8_t a = faces_[g].corners[side];
    const std::uint8_t b = faces_[g].corners[side == 2 ? 0 : side + 1];
    if (!make_face(b, a, added)) return false;
    join(static_cast<std::uint8_t>(first + k), 0, g, side);
  }
  for (std::size_t k = 0; k < rim_count; ++k) {
    const std::size_t next = k + 1 < rim_count ? k + 1 : 0;
    // The rim is one ring, else rounding has cut it.
    if (faces_[first + k].corners[1] != faces_[first + next].corners[0]) return false;
    join(static_cast<std::uint8_t>(first + k), 1, static_cast<std::uint8_t>(first + next), 2);
  }
  return true;
}

std::array<double, 3> ExpandingPolytope::weights_at_foot(const Face& face) const {
  const Vector &a = corners_[face.corners[0]].w, &b = corners_[face.corners[1]].w,
               &c = corners_[face.corners[2]].w;
  const double w_a = face.n.dot(b.cross(c)), w_b = face.n.dot(c.cross(a)),
               w_c = face.n.dot(a.cross(b));
  const double sum = w_a + w_b + w_c;  // twice the area
  return {w_a / sum, w_b / sum, w_c / sum};
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
