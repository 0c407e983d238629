// Cylinders and cones at boxes and hulls: every smooth part of M's surface that may be nearest.
//
// Symbols: P is the polytope, with its axes those of the frame; Q the cylinder or cone, b its axis,
// c the centre of a ball of radius R inside Q; n a unit vector from P to Q; M the set of all points
// of P less those of Q, h(n) the overlap. (closed_overlap.cpp has the same for a box or two
// cylinders.)
//
// A ball about the origin that touches M from inside touches a smooth part of its surface:
//   a face of P and what Q has deepest behind it: its normal;
//   a cap of Q and what P has farthest along it: its normal;
//   the side of Q and a vertex: from the vertex to the axis, leaning as the side does;
//   the side or a rim of Q and an edge: an arc of normals (edge_arc.h).
// The least h of all these is the least overlap, exactly. Where the two are apart, the same
// directions count, and that from a vertex or an edge to a rim: h is then least at the closest
// points, and nowhere else is a minimum.
//
// Few of them need be looked at. With D_i how far c is behind face i: along n = sum a_i n_i, of the
// normals n_i at one vertex, with all a_i >= 0,
//   h(n) >= R + sum a_i D_i,  1 <= sum a_i <= 1 / cos w,
// if all n_i are within w of some direction. So vertices of faces count whose D_i is below
// (d - R) cos w, or d - R if that is above 0, where d is the least overlap so far; and edges
// likewise, with the two normals there, which are closer to each other. The point of Q that is
// deepest behind one face of an edge bounds the overlap beside the other.
//
// Cost, of 12 900 instructions of a manifold: at 80 faces 9 400, of which 1 900 go over all faces;
// 11 count, with as many vertices and 30 edges, of which 2 or 3 have an arc to look at. Of a box
// 3 500. Tried: the point of Q deepest behind the nearest face in place of the ball, or beside it;
// as many faces count, and it costs another pass over all.
#include "server/collision/revolved_overlap.h"

#include <array>
#include <bit>
#include <cmath>

#include "server/collision/best_face.h"
#include "server/collision/edge_arc.h"
#include "server/collision/lanes.h"
#include "server/collision/lead.h"
#include "server/collision/polish.h"
#include "server/collision/polytope_faces.h"
#include "server/collision/polytope_search.h"
#include "server/collision/revolved_body.h"

namespace cradle {
namespace {

constexpr std::size_t kFacesLookedAt =
    128;  // of more, few count, and to look at all takes too long
constexpr std::size_t kVerticesMax = 128;
constexpr double kOnAxis_m = 1e-12;     // nearer, a vertex is on the axis
constexpr double kSupports_m = 1e-12;   // a vertex that no neighbour surpasses by more
constexpr std::int64_t kNumber = 0xff;  // a face, in the last bits of what it is chosen by
constexpr double kFlatEdge2 = 1e-20;    // a squared sine: faces beside each other are one

using Two = double __attribute__((vector_size(16)));
using Bits = std::int64_t __attribute__((vector_size(16)));

/// Of faces, or of vertices.
using Set = std::array<std::uint64_t, 2>;
static_assert(kFacesLookedAt <= 128 && kVerticesMax <= 128);

bool has(const Set& set, std::size_t k) { return (set[k / 64] >> k % 64 & 1) != 0; }

template <typename Act>
void for_each(const Set& set, const Act& act) {
  for (std::size_t k = 0; k < set.size(); ++k) {
    for (std::uint64_t left = set[k]; left != 0; left &= left - 1) {
      act(64 * k + static_cast<std::size_t>(std::countr_zero(left)));
    }
  }
}

class RevolvedSearch {
 public:
  RevolvedSearch(const ConvexPair& pair, double limit, double lead_wanted, SupportHints& hints)
      : pair_(pair),
        limit_(limit),
        lead_wanted_(lead_wanted),
        hints_(hints),
        is_swapped_(is_revolved(pair.A)),
        P_(is_swapped_ ? pair.B : pair.A),
        Q_(is_swapped_ ? pair.A : pair.B),
        faces_(P_),
        body_(Q_, is_swapped_ ? Vector(pair.R.row(2)) : Vector(pair.R.col(2)),
              is_swapped_ ? Vector(-(pair.R.transpose() * pair.t)) : pair.t),
        centre_(body_.middle + Q_.centre.z() * body_.axis) {}

  static bool is_revolved(const ConvexShape& shape) {
    return shape.kind == ShapeKind::cone || shape.kind == ShapeKind::cylinder;
  }
  static bool is_polytope(const ConvexShape& shape) {
    return shape.kind == ShapeKind::box ||
           (shape.kind == ShapeKind::hull && shape.hull->face_count() <= kFacesLookedAt &&
            shape.hull->vertices.size() <= kVerticesMax);
  }

  std::optional<LeastOverlap> find();

 private:
  enum class At { nothing, face, cap, vertex, edge };

  /// What the body has deepest behind a face.
  struct Behind {
    Vector deepest;
    double overlap;
  };

  const Behind& behind(std::size_t f);
  void try_face(std::size_t f);
  std::size_t look_at_faces();
  void try_cap(double side);
  void try_caps();
  void mark_faces();
  void try_vertices();
  void try_vertex(std::size_t v);
  Vector unit_across_axis(const Vector& d) const;
  bool supports(std::size_t v, const Vector& n) const;
  void try_edges();
  void try_edge(std::size_t f, std::size_t g, std::size_t k, double f_at_g);

  bool take(const Vector& n, double overlap, At where) {
    if (!(overlap < best_.overlap)) return false;
    best_.n = n;
    best_.overlap = overlap;
    where_ = where;
    return true;
  }
  bool is_beyond_limit() const { return -best_.overlap > limit_; }
  LeastOverlap as_A_sees(const Vector& p, double lead) const;
  LeastOverlap beyond() const;
  FaceDirection face_of_best() const;
  bool finish_on_P(Vector& p);
  bool move_over_face();
  bool finish_at_edge(Vector& p) const;
  std::optional<LeastOverlap> result();

  const ConvexPair& pair_;
  const double limit_, lead_wanted_;
  SupportHints& hints_;
  const bool is_swapped_;
  const ConvexShape &P_, &Q_;
  const PolytopeFaces faces_;
  const RevolvedBody body_;
  const Vector centre_;  ///< of a ball inside Q
  std::array<Behind, kFacesLookedAt> behind_;
  std::array<bool, kFacesLookedAt> is_known_{};
  std::array<double, kFacesLookedAt + 1>
      inside_;                     ///< m, of each face: how far the centre is behind it
  Set by_corners_{}, by_edges_{};  ///< faces at whose corners, or edges, there may be less overlap
  std::size_t nearest_ = 0;        ///< face to the centre
  Vector some_vertex_;             ///< of it
  Direction best_;                 ///< from P to Q
  At where_ = At::nothing;
  std::size_t which_ = 0, place_ = 0;  ///< the face, or vertex; of an edge its place in the face
  Vector deepest_;                     ///< point of Q, or of P at a cap
  Rim rim_ = Rim::lower;
  bool is_minimum_ = false;  ///< over the arc of its edge
};

const RevolvedSearch::Behind& RevolvedSearch::behind(std::size_t f) {
  Behind& found = behind_[f];
  if (is_known_[f]) return found;
  const Vector& n = faces_.normals[f];
  const double along = n.dot(body_.axis), across2 = std::max(0.0, 1 - along * along);
  found.deepest = body_.deepest(n, body_.is_upper(along, std::sqrt(across2)));
  found.overlap = faces_.offsets[f] - n.dot(found.deepest);
  is_known_[f] = true;
  return found;
}

void RevolvedSearch::try_face(std::size_t f) {
  const Behind& found = behind(f);
  if (!take(faces_.normals[f], found.overlap, At::face)) return;
  which_ = f;
  deepest_ = found.deepest;
}

/// How far the centre is behind all faces, two at a time. Gives the face that it is nearest to.
std::size_t RevolvedSearch::look_at_faces() {
  const std::size_t count = faces_.normals.size();
  const double *normals = faces_.normals.data()->data(), *offsets = faces_.offsets.data();
  const double x = centre_.x(), y = centre_.y(), z = centre_.z();
  Two least{kInfinity, kInfinity};
  Bits numbers{0, 1};
  std::size_t f = 0;
  for (; f + 1 < count; f += 2) {
    const double* n = normals + 3 * f;
    const Two inside = Two{offsets[f], offsets[f + 1]} -
                       (Two{n[0], n[3]} * x + Two{n[1], n[4]} * y + Two{n[2], n[5]} * z);
    inside_[f] = inside[0];
    inside_[f + 1] = inside[1];
    least = smaller(least, Two((Bits(inside) & ~kNumber) | numbers));
    numbers += 2;
  }
  std::size_t nearest = std::bit_cast<std::uint64_t>(std::min(least[0], least[1])) & kNumber;
  if (f < count) {
    inside_[f] = offsets[f] - faces_.normals[f].dot(centre_);
    if (inside_[f] < inside_[nearest]) nearest = f;
  }
  inside_[count] = kInfinity;
  return nearest;
}

/// `side`: of the cap, along the axis.
void RevolvedSearch::try_cap(double side) {
  const Vector n = -side * body_.axis;
  const Vector p = P_.support(n, is_swapped_ ? hints_.B : hints_.A);
  if (!take(n, n.dot(p - body_.middle) + body_.half_length, At::cap)) return;
  deepest_ = p;
}

void RevolvedSearch::try_caps() {
  const double up = body_.axis.dot(body_.middle - P_.centre);
  const auto try_it = [&](double side) {
    if (P_.inner_radius + side * up + body_.half_length < best_.overlap) try_cap(side);
  };
  try_it(-1);
  if (body_.upper > 0) try_it(1);
}

/// Where the overlap may be less: at a corner of the face, or at an edge.
void RevolvedSearch::mark_faces() {
  const double below = best_.overlap - Q_.inner_radius;
  const std::size_t count = faces_.normals.size();
  const auto bounds = [&](std::span<const double> cosines, std::size_t f) {
    return below < 0 ? below * Two{cosines[f], cosines[f + 1 < count ? f + 1 : f]}
                     : Two{below, below};
  };
  for (std::size_t f = 0; f < count; f += 2) {  // which they are is chance: no branches
    const Two inside{inside_[f], inside_[f + 1]};
    const std::uint64_t corners = bits_of(inside < bounds(faces_.corner_cosines, f));
    const std::uint64_t edges = bits_of(inside < bounds(faces_.edge_cosines, f));
    by_corners_[f / 64] |= corners << f % 64;
    by_edges_[f / 64] |= edges << f % 64;
  }
  for_each(by_edges_, [this](std::size_t f) { try_face(f); });
}

bool RevolvedSearch::supports(std::size_t v, const Vector& n) const {
  const double reach = n.dot(faces_.vertices[v]) + kSupports_m;
  if (n.dot(some_vertex_) > reach) return false;
  double most = -kInfinity;
  for (const std::int32_t u : faces_.neighbours(v)) {
    most = larger(most, n.dot(faces_.vertices[static_cast<std::size_t>(u)]));
  }
  return most <= reach;
}

void RevolvedSearch::try_vertices() {
  some_vertex_ = faces_.vertices[static_cast<std::size_t>(faces_.corners(nearest_)[0])];
  Set vertices{};
  for_each(by_corners_, [&](std::size_t f) {
    for (const std::int32_t v : faces_.corners(f)) {
      vertices[static_cast<std::size_t>(v) / 64] |= std::uint64_t{1} << (v & 63);
    }
  });
  for_each(vertices, [this](std::size_t v) { try_vertex(v); });
}

Vector RevolvedSearch::unit_across_axis(const Vector& d) const {
  const Vector out = d - d.dot(body_.axis) * body_.axis;
  const double length = out.norm();
  return length > kOnAxis_m ? Vector(out / length) : unit_across(body_.axis);
}

/// The side of the body nearest to a vertex; or the rim, if the vertex is outside.
void RevolvedSearch::try_vertex(std::size_t v) {
  const Vector d = faces_.vertices[v] - body_.middle;
  const double z = d.dot(body_.axis), h = body_.half_length;
  Vector out = d - z * body_.axis;
  const double from_axis = out.norm();
  const double x = from_axis - body_.lower, y = z + h;  // from the lower rim
  double n_out = body_.out, n_up = body_.up, overlap = -(n_out * x + n_up * y);
  if (!(overlap < best_.overlap)) return;
  if (overlap < 0) {
    const double up_the_side = n_out * y - n_up * x;
    double to_out = 0, to_up = 0;
    if (up_the_side < 0) {
      to_out = x, to_up = y;
    } else if (up_the_side > body_.length) {
      to_out = from_axis - body_.upper, to_up = z - h;
    }
    const double length = std::sqrt(to_out * to_out + to_up * to_up);
    if (length > 0) {
      overlap = -length;
      n_out = to_out / length, n_up = to_up / length;
      if (!(overlap < best_.overlap) || n_out < 0) return;  // else a cap is nearest
    }
  }
  // Once more across the axis: beside it, d is mostly along it.
  out = unit_across_axis(from_axis > kOnAxis_m ? out : Vector(P_.centre - faces_.vertices[v]));
  const Vector n = -n_out * out - n_up * body_.axis;
  if (!supports(v, n)) return;
  take(n, overlap, At::vertex);
  which_ = v;
}

void RevolvedSearch::try_edges() {
  for_each(by_edges_, [this](std::size_t f) {
    const auto beyond = faces_.beyond(f);
    const Vector deepest = behind_[f].deepest;
    for (std::size_t k = 0; k < beyond.size(); ++k) {
      const auto g = static_cast<std::size_t>(beyond[k]);
      const double f_at_g = faces_.offsets[g] - faces_.normals[g].dot(deepest);
      if (f_at_g >= best_.overlap - kSure_m) continue;
      if (g > f || !has(by_edges_, g)) try_edge(f, g, k, f_at_g);  // else seen from there
    }
  });
}

/// The edge of face f at place k, with face g beyond: by bounds first, as in edge_arc.cpp.
void RevolvedSearch::try_edge(std::size_t f, std::size_t g, std::size_t k, double f_at_g) {
  const Vector &m = faces_.normals[f], &n = faces_.normals[g];
  const Behind& at_f = behind_[f];
  const double bound = best_.overlap - kSure_m;
  const Behind& at_g = behind(g);
  const double g_at_f = faces_.offsets[f] - m.dot(at_g.deepest);
  if (g_at_f >= bound) return;
  const double cosine = m.dot(n);
  const double share = at_g.overlap - f_at_g, rest = at_f.overlap - g_at_f;
  const double crossing = at_f.overlap * share + f_at_g * rest;
  const double length2 = share * share + rest * rest + 2 * share * rest * cosine;
  if (bound > 0 && crossing > 0 && crossing * crossing >= bound * bound * length2) return;
  if (!(1 - cosine * cosine > kFlatEdge2)) return;
  const auto v = static_cast<std::size_t>(faces_.corners(f)[k]);
  EdgeArc arc(body_, faces_.vertices[v], m, n, cosine, best_.overlap);
  if (!arc.find()) return;
  take(arc.direction(), arc.overlap(), At::edge);
  which_ = f;
  place_ = k;
  rim_ = arc.rim();
  is_minimum_ = arc.is_minimum();
}

LeastOverlap RevolvedSearch::as_A_sees(const Vector& p, double lead) const {
  if (!is_swapped_) return {true, best_.n, best_.overlap, p, lead};
  const Vector n = -(pair_.R * best_.n);
  return {true, n, best_.overlap, pair_.R * p + pair_.t + best_.overlap * n, lead};
}

LeastOverlap RevolvedSearch::beyond() const {
  return LeastOverlap::beyond(is_swapped_ ? Vector(-(pair_.R * best_.n)) : best_.n, -best_.overlap);
}

FaceDirection RevolvedSearch::face_of_best() const {
  FaceDirection face;
  face.n = is_swapped_ ? Vector(-(pair_.R * best_.n)) : best_.n;
  face.overlap = best_.overlap;
  const bool is_of_A = (where_ == At::face) != is_swapped_;
  face.face_of = is_of_A ? FaceDirection::Of::A : FaceDirection::Of::B;
  face.face = where_ == At::face ? static_cast<std::int32_t>(which_) : 0;
  face.deepest = is_swapped_ ? Vector(pair_.R * deepest_ + pair_.t) : deepest_;
  return face;
}

/// Where a side or a cap is level with a face, another point of it is as deep. False if none is
/// found that is over the face.
bool RevolvedSearch::move_over_face() {
  const Vector lower = body_.deepest(best_.n, false), upper = body_.deepest(best_.n, true);
  const Vector side = upper - lower;
  const double along = best_.n.dot(body_.axis);
  if (std::abs(best_.n.dot(side)) < kLevel_m) {
    const double on = (P_.centre - lower).dot(side) / side.squaredNorm();
    deepest_ = lower + std::clamp(on, 0.0, 1.0) * side;
  } else if (body_.lower * (best_.n - along * body_.axis).norm() < kLevel_m) {
    deepest_ = body_.middle_of(along < 0 && body_.upper > 0);
  } else {
    return false;
  }
  return inside_face(pair_, face_of_best()) >= 0;
}

/// The point of P that touches Q when that has been moved out; whether it is certain.
bool RevolvedSearch::finish_on_P(Vector& p) {
  const double d = best_.overlap;
  switch (where_) {
    case At::face: {
      const bool is_over = inside_face(pair_, face_of_best()) >= 0 || move_over_face();
      p = deepest_ + d * best_.n;
      return is_over;
    }
    case At::cap:
      p = deepest_;
      return inside_face(pair_, face_of_best()) >= 0;
    case At::vertex:
      p = faces_.vertices[which_];
      return true;
    case At::edge:
      return finish_at_edge(p);
    default:
      return false;
  }
}

bool RevolvedSearch::finish_at_edge(Vector& p) const {
  const auto loop = faces_.corners(which_);
  const Vector& u = faces_.vertices[static_cast<std::size_t>(loop[place_])];
  const auto next = loop[place_ + 1 < loop.size() ? place_ + 1 : 0];
  const Vector along = faces_.vertices[static_cast<std::size_t>(next)] - u;
  const Vector& n = best_.n;
  Vector q = body_.deepest(n, rim_ == Rim::upper);
  bool is_inside = is_minimum_ || rim_ == Rim::side;
  if (rim_ == Rim::side) {  // where the lines cross, as seen along n
    const Vector side = body_.deepest(n, true) - q;
    const Vector across = n.cross(along);
    const double rise = across.dot(side);
    const double on = rise != 0 ? across.dot(u - q) / rise : 0.5;
    is_inside = on >= 0 && on <= 1;
    q += std::clamp(on, 0.0, 1.0) * side;
  }
  const double on = (q - u).dot(along) / along.squaredNorm();
  p = u + std::clamp(on, 0.0, 1.0) * along;
  return is_inside && on >= 0 && on <= 1;
}

/// Of what is apart the closest points are known if each is on the part that was taken for it, and
/// no farther from the other than told; else they are found from here. (Along the axis but for
/// rounding a rim is a kink, which Newton's method may take for a minimum.)
std::optional<LeastOverlap> RevolvedSearch::result() {
  Vector p;
  const bool is_certain = finish_on_P(p);
  if (best_.overlap >= -kKissing_m) {
    // Where a side or a cap lies along a face, what is deepest may be any of many points.
    return is_certain ? std::optional(as_A_sees(p, -1)) : std::nullopt;
  }
  if (is_certain && (p - body_.nearest(p)).norm() < kSure_m - best_.overlap)
    return as_A_sees(p, lead_by_turn(-best_.overlap));
  const Vector n = as_A_sees(p, 0).n;
  Simplex simplex;
  simplex.corners[0] = support(pair_, n, hints_);
  simplex.weights[0] = 1;
  simplex.count = 1;
  LeastOverlap found;
  if (!polish(pair_, n, simplex, hints_, found) || found.overlap > best_.overlap + kSure_m) {
    return std::nullopt;
  }
  if (-found.overlap > limit_) return LeastOverlap::beyond(found.n, -found.overlap);
  found.lead = lead_by_turn(-found.overlap);
  return found;
}

std::optional<LeastOverlap> RevolvedSearch::find() {
  nearest_ = look_at_faces();
  try_face(nearest_);
  if (is_beyond_limit()) return beyond();
  try_caps();
  if (is_beyond_limit()) return beyond();
  const FaceDirection face = face_of_best();
  if (is_best(pair_, face)) {
    Vector p;
    finish_on_P(p);
    const bool leads = lead_wanted_ > 0 && is_best(pair_, face, lead_wanted_ / 2);
    return as_A_sees(p, leads ? lead_wanted_ : -1);
  }
  mark_faces();
  if (is_beyond_limit()) return beyond();
  try_vertices();
  if (is_beyond_limit()) return beyond();
  try_edges();
  if (is_beyond_limit()) return beyond();
  return result();
}

}  // namespace

std::optional<LeastOverlap> revolved_overlap(const ConvexPair& pair, double limit,
                                             double lead_wanted, SupportHints& hints) {
  const auto takes = [](const ConvexShape& one, const ConvexShape& other) {
    return RevolvedSearch::is_revolved(one) && RevolvedSearch::is_polytope(other);
  };
  if (!takes(pair.A, pair.B) && !takes(pair.B, pair.A)) return std::nullopt;
  return RevolvedSearch(pair, limit, lead_wanted, hints).find();
}

}  // namespace cradle
