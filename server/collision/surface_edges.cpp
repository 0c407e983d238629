// A convex shape C near a ridge or a border of a surface: the direction in which C and one triangle
// overlap least, and what touches along it.
#include <cmath>

#include "server/collision/convex_pair.h"
#include "server/collision/feature_overlap.h"
#include "server/collision/surface_contacts.h"
#include "server/collision/triangle_overlap.h"

namespace cradle {

/// Which part of a triangle is farthest along m.
struct TopPart {
  std::size_t vertex = 0, edge = 0;
  bool is_level = false;  ///< the edge is as far
};

namespace {

/// Takes the normal of the triangle, of C's face or of the two edges that touch for the direction,
/// if that is as good: closest points tell it to 1e-8 or so only.
void sharpen_edge(const ConvexPair& pair, const SupportFeature& part, const Vector& edge,
                  LeastOverlap& least, SupportHints& hints) {
  const auto try_normal = [&](const Vector& exact) {
    const double off2 = (exact - least.n).squaredNorm();
    constexpr double kNear2 = kTolerances.sharpen_sine * kTolerances.sharpen_sine;
    if (!(off2 < kNear2) || off2 == 0) return false;
    const double overlap = core_overlap(pair, exact, hints);
    if (overlap > least.overlap + kTolerances.coincident_m) return false;
    least.n = exact;
    least.overlap = overlap;
    return true;
  };
  if (try_normal(-(pair.R * pair.B.triangle->normal))) return;
  if (part.count > 2 && try_normal(part.normal)) return;
  if (part.count != 2) return;
  const Vector across = (part.corners[1] - part.corners[0]).cross(pair.R * edge);
  const double length = across.norm();
  if (length > 0) try_normal(across * ((across.dot(least.n) < 0 ? -1 : 1) / length));
}

/// The same from both sides of an edge; never 0.
std::uint64_t key_of_edge(const SurfaceTriangle& t, std::size_t k) {
  const auto a = static_cast<std::uint64_t>(t.vertices[k]) + 1;
  const auto b = static_cast<std::uint64_t>(t.vertices[(k + 1) % 3]) + 1;
  return std::min(a, b) << 32 | std::max(a, b);
}

TopPart top_of(const SurfaceTriangle& t, const Vector& m) {
  TopPart top;
  for (std::size_t k = 1; k < 3; ++k) {
    if (m.dot(t.corners[k] - t.corners[top.vertex]) > 0) top.vertex = k;
  }
  const std::size_t other = (top.vertex + 2) % 3;
  const double slope = std::abs(m.dot(t.edge(top.vertex))),
               slope_other = std::abs(m.dot(t.edge(other)));
  top.edge = slope <= slope_other ? top.vertex : other;
  constexpr double kLevel2 = 1 - kTolerances.flush_cosine * kTolerances.flush_cosine;
  const double least = std::min(slope, slope_other);
  top.is_level = least * least < kLevel2;
  return top;
}

/// C in one of the wedges between the normals at a triangle's ridges, where it overlaps the edge.
/// Directions go by q, the tangent of half their angle to the normal: no sine of libm, whose bits
/// depend on the processor.
class WedgeSearch {
 public:
  /// `e` unit, along the edge; `n` and `out` span the plane across it: the triangle's normal, and
  /// away from the triangle. The pair's B is the triangle, R turns vectors of A into S.
  WedgeSearch(const ConvexPair& pair, const Matrix& R, const Vector& corner, const Vector& n,
              const Vector& out)
      : pair_(pair), R_(R), corner_(pair.R * corner + pair.t), n_(n), out_(out) {}

  Vector direction(double q) const { return ((1 - q * q) * n_ + 2 * q * out_) / (1 + q * q); }

  /// Of A's core and the line along the edge; `a` is A's farthest point.
  double overlap(double q, Vector& a) {
    const Vector toward = -(R_.transpose() * direction(q));
    a = pair_.A.support(toward, hint_);
    return toward.dot(a - corner_);
  }

  /// The q of least overlap up to `end`: the best of samples, then golden section around it.
  double best(double end) {
    constexpr int kSamples = 8, kSteps = 28;
    constexpr double kGolden = 0.6180339887498949;
    Vector a;
    int at = 0;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= kSamples; ++i) {
      const double h = overlap(end * i / kSamples, a);
      if (h < least) least = h, at = i;
    }
    double low = end * std::max(0, at - 1) / kSamples;
    double high = end * std::min(kSamples, at + 1) / kSamples;
    double x = high - kGolden * (high - low), y = low + kGolden * (high - low);
    double h_x = overlap(x, a), h_y = overlap(y, a);
    for (int step = 0; step < kSteps; ++step) {
      if (h_x < h_y) {
        high = y, y = x, h_y = h_x;
        x = high - kGolden * (high - low), h_x = overlap(x, a);
      } else {
        low = x, x = y, h_x = h_y;
        y = low + kGolden * (high - low), h_y = overlap(y, a);
      }
    }
    return 0.5 * (low + high);
  }

 private:
  const ConvexPair& pair_;
  const Matrix R_;
  const Vector corner_, n_, out_;
  std::int32_t hint_ = 0;
};

/// A triangle alone can be left in ways that the surface does not allow, which hide the best that
/// it does. Where that is so: the least overlap in the wedges at its ridges, if C's deepest point
/// there is beside the edge. Sets the direction, the overlap and the edge.
bool find_in_wedges(const SurfaceView& surface, const SurfaceTriangle& t, const ConvexPair& pair,
                    const Matrix& R, LeastOverlap& found, std::size_t& edge) {
  bool is_found = false;
  for (std::size_t k = 0; k < 3; ++k) {
    if (surface.edge_kind(t, k) != EdgeKind::ridge) continue;
    const Vector e = t.edge(k);
    const Vector n_beyond = surface.triangle(surface.neighbour(t, k)).normal;
    constexpr double kEndMax = 10;  // 169 degrees: edges sharper than knives
    const double beside = 1 + t.normal.dot(n_beyond);
    const double turned = t.normal.cross(n_beyond).dot(e);
    const double end = turned < kEndMax * beside ? turned / beside : kEndMax;
    WedgeSearch wedge(pair, R, t.corners[k], t.normal, e.cross(t.normal));
    const double q = wedge.best(end);
    constexpr double kAtEnd = 1e-4;  // the faces see to that
    if (q < kAtEnd || q > end - kAtEnd) continue;
    const Vector m = wedge.direction(q), corner = pair.R * t.corners[k] + pair.t;
    Vector a;
    const double overlap = wedge.overlap(q, a);
    if (is_found && overlap >= found.overlap) continue;
    // What of C lies there may be an edge, of which `a` is one end.
    std::int32_t hint = 0;
    const SupportFeature part = support_feature(pair.A, -(R.transpose() * m), hint);
    double first = e.dot(R * (a - corner)), last = first;
    for (std::size_t i = 0; i < static_cast<std::size_t>(part.count); ++i) {
      const double along = e.dot(R * (part.corners[i] - corner));
      first = std::min(first, along), last = std::max(last, along);
    }
    if (last < 0 || first > (t.corners[(k + 1) % 3] - t.corners[k]).norm()) continue;
    found.n = -(R.transpose() * m);
    found.overlap = overlap;
    found.p_A = a;
    edge = k;
    is_found = true;
  }
  return is_found;
}

}  // namespace

/// C and a triangle along the direction of least overlap, and what of them touches.
struct SurfaceContactFinder::Touch {
  LeastOverlap found;   ///< in the frame of C, from C to the triangle
  SupportFeature part;  ///< of C, in its frame
  TopPart top;          ///< of the triangle
  Vector normal;        ///< in S, to C
  double separation = 0;
  double scale = 1;          ///< of tolerances
  bool is_edge = false;      ///< else the top vertex touches
  bool is_in_wedge = false;  ///< the direction was sought in the wedge at the edge

  Touch(const ConvexPair& pair, const Matrix& R, const SurfaceTriangle& t,
        const LeastOverlap& least, SupportHints& hints)
      : found(least),
        part(support_feature(pair.A, found.n, hints.A)),
        top(top_of(t, -(R * found.n))) {
    const Vector n = found.n;
    settle(pair, R, t, hints);
    if (found.n != n) top = top_of(t, normal);
  }

  /// In the wedge at the edge `k`, which touches.
  void take_wedge(const ConvexPair& pair, const Matrix& R, const SurfaceTriangle& t, std::size_t k,
                  SupportHints& hints) {
    top.edge = k;
    is_edge = is_in_wedge = true;
    part = support_feature(pair.A, found.n, hints.A);
    settle(pair, R, t, hints);
  }

 private:
  void settle(const ConvexPair& pair, const Matrix& R, const SurfaceTriangle& t,
              SupportHints& hints) {
    sharpen_edge(pair, part, t.edge(top.edge), found, hints);
    normal = -(R * found.n);
    separation = -found.overlap - pair.A.radius;
  }
};

/// Along the triangle's own normal: also a point with the least separation, if none of the others
/// has it.
void SurfaceContactFinder::add_face_of_least(const SurfaceTriangle& t, const Over& over,
                                             const Touch& touch) {
  const double s = touch.separation;
  const std::size_t begin = contacts_.size();
  add_face_points(t, over, false, -std::numeric_limits<double>::infinity());
  for (std::size_t i = begin; i < contacts_.size(); ++i) {
    if (contacts_[i].separation < s + touch.scale * kTolerances.witness_m) return;
  }
  const Vector p = X_SC_.x + X_SC_.R * touch.found.p_A;
  add_point(t, touch.normal, p - touch.normal * (shape_.radius + 0.5 * s), s, 0);
}

/// Of an edge that is level and cannot be felt, C may touch all but the end.
bool SurfaceContactFinder::is_at_top(const SurfaceTriangle& t, const Touch& touch) const {
  if (!touch.top.is_level) return true;
  Vector d = t.corners[touch.top.vertex] - (X_SC_.x + X_SC_.R * touch.found.p_A);
  d -= touch.normal.dot(d) * touch.normal;
  const double slack = touch.scale * kTolerances.clip_slack_m;
  return d.squaredNorm() <= slack * slack;
}

/// False, and nothing is added, if C passes the end of an edge whose wedge was searched.
bool SurfaceContactFinder::add_edge_or_vertex(const SurfaceTriangle& t, Touch& touch) {
  const Matrix T = frame_along(touch.found.n);
  const double s = touch.separation;
  SupportFeature& part = touch.part;
  for (std::size_t i = 0; i < static_cast<std::size_t>(part.count); ++i) {
    part.corners[i] = T * part.corners[i];
    part.corners[i].z() += shape_.radius;
  }
  part.normal = T * part.normal;
  SupportFeature felt;
  const auto add_corner = [&](std::size_t k) {
    felt.add(T * (X_SC_.R.transpose() * (t.corners[k] - X_SC_.x)),
             static_cast<std::uint32_t>(t.vertices[k]), name_of_edge(t, touch.top.edge));
  };
  add_corner(touch.is_edge ? touch.top.edge : touch.top.vertex);
  if (touch.is_edge) add_corner((touch.top.edge + 1) % 3);
  if (!is_flush(part)) keep_highest(part, 1);

  FeatureContacts points;
  overlap_features(part, felt, touch.scale * kTolerances.clip_slack_m, points);
  bool has_deepest = false;
  for (FeatureContact& point : points.used()) {
    point.p.z() = std::max(point.p.z(), s);
    has_deepest = has_deepest || point.p.z() < s + touch.scale * kTolerances.witness_m;
  }
  if (touch.is_in_wedge && !has_deepest && part.count != 1) return false;

  const std::uint64_t key = touch.is_edge ? key_of_edge(t, touch.top.edge) : 0;
  const auto emit = [&](const Vector& p, double separation, std::uint32_t name) {
    if (!(separation <= margin_)) return;
    contacts_.push_back({touch.normal, X_SC_.x + X_SC_.R * (T.transpose() * p), separation, name,
                         t.number, key, s});
  };
  for (const FeatureContact& point : points.used()) {
    if (point.is_guess) continue;
    emit({point.p.x(), point.p.y(), point.height}, point.p.z(), point.name);
  }
  const Vector half(0, 0, 0.5 * s);
  if (has_deepest) return true;
  if (part.count == 1) {
    emit(part.corners[0] + half, s, name_of_corner(part.corner_names[0]));
  } else if (felt.count == 1) {
    emit(felt.corners[0] - half, s, name_of_vertex(t.vertices[touch.top.vertex]));
  } else {
    emit(T * touch.found.p_A + Vector(0, 0, shape_.radius) + half, s, 0);
  }
  return true;
}

/// If something of the triangle is nearest that can be felt, adds it, and sets `least` to the
/// separation.
SurfaceContactFinder::Nearest SurfaceContactFinder::add_nearest(const SurfaceTriangle& t,
                                                                const std::array<Vector, 3>& seen,
                                                                const Over& over, double& least) {
  const double limit = margin_ + shape_.radius;
  const std::optional<LeastOverlap> quick = triangle_overlap(shape_, seen, limit);
  if (quick && !quick->is_within_limit) return Nearest::beyond;
  const ConvexShape flat(t);
  const Pose in_S;
  const ConvexPair pair(shape_, X_SC_, flat, in_S);
  SupportHints hints;
  const LeastOverlap found = quick ? *quick : least_overlap(pair, limit, hints);
  if (!found.is_within_limit) return Nearest::beyond;
  Touch touch(pair, X_SC_.R, t, found, hints);
  if (!(touch.separation <= margin_)) return Nearest::beyond;
  touch.scale = std::min(scale_, flat.thickness / kTolerances.nominal_half_extent_m);
  least = touch.separation;

  constexpr double kNear2 = kTolerances.sharpen_sine * kTolerances.sharpen_sine;
  if ((touch.normal - t.normal).squaredNorm() < kNear2) {
    add_face_of_least(t, over, touch);
    return Nearest::face;
  }
  const TopPart& top = touch.top;
  constexpr double kSine = kTolerances.wedge_sine;
  touch.is_edge = top.is_level && admits_edge(surface_, t, top.edge, touch.normal, kSine);
  const bool is_vertex = !touch.is_edge && is_at_top(t, touch) &&
                         admits_vertex(surface_, t, top.vertex, touch.normal, kSine);
  if (!touch.is_edge && !is_vertex) {
    std::size_t edge = 0;
    if (!(least < 0) || !find_in_wedges(surface_, t, pair, X_SC_.R, touch.found, edge)) {
      return Nearest::none;
    }
    touch.take_wedge(pair, X_SC_.R, t, edge, hints);
    least = touch.separation;
  }
  if (!add_edge_or_vertex(t, touch)) return Nearest::none;
  add_parting(touch.normal, t.corners[touch.is_edge ? touch.top.edge : touch.top.vertex], least);
  return Nearest::edge;
}

}  // namespace cradle
