// The direction of least overlap of two convex cores.
//
// Symbols, in A's frame: M the set of all a - b, h(n) = max over M of n . m its support function,
// the overlap along n. If the cores are apart, the best n is that of the closest points. If they
// overlap it is the unit vector with the least h: the nearest point of M's surface lies there.
//
// Method: let n be any direction. B moved out along n by h(n) + e is apart from A by e at least.
// The closest points then give a direction n' with h(n') <= h(n) cos(n, n'): this follows from
// |q - p| >= e for q = (h + e) n and its foot p on M. So the steps descend, and rest only where the
// foot lies on n: where a ball about the origin touches M from inside. Where M is flat one step
// arrives; where it is round with radius R, an error shrinks by (h + e) / (R + e) a step.
// (Where steps shrink steadily, their limit is guessed, and taken if it is lower; where they hardly
// shrink, as in deep overlaps, they are stretched.)
// That is a local minimum. The descent begins at the best of the directions in which shapes use to
// leave each other: their faces and sides; and where a face is not certainly best, also at the
// direction of the closest points with B moved away a little.
//
// Where we differ from the expanding polytope algorithm (van den Bergen 2001): only distances of
// sets that are apart are asked for, so nothing degenerates where faces kiss, and curved shapes
// need no triangles; but another local minimum than the least may be found, at corners of hulls
// with many faces in one of fifteen poses, and in deep overlaps.
//
// Cost: a face that is certainly best needs no distance; else 2 to 5 of them, 0.1 .. 0.2 us each
// for polytopes and 0.5 .. 1.5 us for curved shapes.
#include <array>
#include <cmath>
#include <numbers>

#include "server/collision/best_face.h"
#include "server/collision/expanding_polytope.h"
#include "server/collision/polish.h"

namespace cradle {
namespace {

constexpr int kStepsMax = 32;
constexpr double kStill = 1e-5;  // rad: a step so small ends the descent; the error is less
constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr double kDeepStill = 100;
constexpr int kPolished = 3;
constexpr double kSure_m = 1e-11;
constexpr double kRough = 1e-2;  // rad: while steps are larger, closest points need not be exact
constexpr double kRoughGap = 0.1;
constexpr double kBeside = 20;
constexpr int kSeekMax = 40;
constexpr double kSeekShare = 1e-6;
constexpr double kThrough = 1e-3;
constexpr double kSameCosine = 0.965, kSameCosineAtEdges = 0.985;
constexpr int kRoughSteps = 6;
constexpr double kSlow = 0.3;  // of the last step: one that shrinks less is stretched

/// Where the last steps lead to if they shrink steadily (Anderson 1965, of depth two: the tangent
/// plane has two dimensions): from directions n and the directions g that came of them.
class Extrapolation {
 public:
  void add(const Vector& n, const Vector& g) {
    f_[2] = f_[1], f_[1] = f_[0], f_[0] = g - n;
    g_[2] = g_[1], g_[1] = g_[0], g_[0] = g;
    ++count_;
  }

  /// False if they lead nowhere.
  bool guess(Vector& n) const {
    if (count_ < 2) return false;
    const Vector u = f_[0] - f_[1], v = count_ < 3 ? Vector(Vector::Zero()) : Vector(f_[1] - f_[2]);
    const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
    const double uf = u.dot(f_[0]), vf = v.dot(f_[0]);
    const double determinant = uu * vv - uv * uv;
    double a = 0, b = 0;
    if (determinant > 1e-6 * uu * vv) {
      a = (uf * vv - vf * uv) / determinant;
      b = (vf * uu - uf * uv) / determinant;
    } else if (uu > 0) {
      a = uf / uu;
    } else {
      return false;
    }
    n = g_[0] - a * (g_[0] - g_[1]);
    if (b != 0) n -= b * (g_[1] - g_[2]);
    const double length = n.norm();
    n /= length;
    return length > 0.1;
  }

 private:
  std::array<Vector, 3> f_{Vector::Zero(), Vector::Zero(), Vector::Zero()}, g_ = f_;
  int count_ = 0;
};

/// Down from a direction to a local minimum.
class Descent {
 public:
  Descent(const ConvexPair& pair, Simplex& simplex, SupportHints& hints)
      : pair_(pair), simplex_(simplex), hints_(hints) {}

  LeastOverlap from(const Direction& begin) {
    best_ = {true, begin.n, begin.overlap, Vector::Zero()};
    const double e = pair_.small_length();
    const double thickness = std::min(pair_.A.thickness, pair_.B.thickness);
    const double gap = simplex_.gap;
    bool is_rough = true;
    double last_turn = kInfinity;
    for (int step = 0; step < kStepsMax; ++step) {
      simplex_.gap = is_rough ? kRoughGap : gap;
      const Closest found =
          closest(pair_, (best_.overlap + e) * best_.n, best_.n, kInfinity, simplex_, hints_);
      if (found.kind != Closest::Kind::apart) break;
      best_.p_A = found.p_A;
      LeastOverlap polished;
      if (step < kPolished && polish(pair_, found.n, simplex_, hints_, polished) &&
          polished.overlap <= best_.overlap + kSure_m) {
        best_ = polished;
        break;
      }
      const Vector begin_n = best_.n;
      const double turn = (found.n - begin_n).norm();
      const bool is_lower = take_if_lower(found.n);
      if (!is_lower && !is_rough) break;
      // The deeper, the less a small step says about what is left.
      const double still = kStill / (1 + kDeepStill * std::max(0.0, best_.overlap) / thickness);
      if (turn < still && !is_rough) break;
      const bool was_rough = is_rough;
      is_rough = is_rough && is_lower && turn > kRough && step < kRoughSteps;
      if (was_rough && !is_lower) continue;
      if (!was_rough) {
        extrapolation_.add(begin_n, found.n);
        Vector guess;
        if (extrapolation_.guess(guess) && take_if_lower(guess)) continue;
      }
      if (turn > kSlow * last_turn) stretch(begin_n, found.n);
      last_turn = turn;
    }
    simplex_.gap = gap;
    return best_;
  }

 private:
  bool take_if_lower(const Vector& n) {
    const double overlap = core_overlap(pair_, n, hints_);
    if (!(overlap <= best_.overlap)) return false;
    best_.n = n;
    best_.overlap = overlap;
    return true;
  }

  /// Farther the same way, as long as it goes down.
  void stretch(const Vector& n, const Vector& g) {
    for (double factor = 2; factor < 1000; factor *= 2) {
      const double before = best_.overlap;
      if (!take_if_lower((n + factor * (g - n)).normalized()) || best_.overlap == before) break;
    }
  }

  const ConvexPair& pair_;
  Simplex& simplex_;
  SupportHints& hints_;
  Extrapolation extrapolation_;
  LeastOverlap best_;
};

LeastOverlap descend(const ConvexPair& pair, const Direction& from, SupportHints& hints) {
  Simplex simplex;
  return Descent(pair, simplex, hints).from(from);
}

}  // namespace

ConvexPair::ConvexPair(const Collider& collider_A, const Collider& collider_B)
    : A(collider_A),
      B(collider_B),
      R(collider_A.X_WB.R.transpose() * collider_B.X_WB.R),
      t(collider_A.X_WB.R.transpose() * (collider_B.X_WB.x - collider_A.X_WB.x)),
      centre(t + R * B.centre - A.centre) {}

namespace {

/// Of its core.
bool is_polytope(const ConvexShape& shape) {
  switch (shape.kind) {
    case ShapeKind::sphere:
    case ShapeKind::capsule:
    case ShapeKind::box:
    case ShapeKind::hull:
      return true;
    default:
      return false;
  }
}

constexpr double kKissing_m = 1e-8;

/// Some tetrahedron in M, as wide as may be.
bool begin_anywhere(const ConvexPair& pair, SupportHints& hints, ExpandingPolytope& polytope) {
  std::array<Difference, 4> corners;
  const auto farther = [&](const Vector& d) {
    const Difference one = support(pair, d, hints), other = support(pair, -d, hints);
    const double middle = d.dot(corners[0].w);
    return d.dot(one.w) - middle >= middle - d.dot(other.w) ? one : other;
  };
  corners[0] = support(pair, Vector::UnitX(), hints);
  corners[1] = support(pair, -Vector::UnitX(), hints);
  const Vector along = corners[1].w - corners[0].w;
  corners[2] = farther(
      along.cross(std::abs(along.y()) < std::abs(along.z()) ? Vector::UnitY() : Vector::UnitZ()));
  corners[3] = farther(along.cross(corners[2].w - corners[0].w));
  return polytope.begin(corners);
}

/// False if rounding got in the way.
bool least_by_expanding(const ConvexPair& pair, const Simplex& simplex, SupportHints& hints,
                        LeastOverlap& best) {
  ExpandingPolytope polytope;
  const bool has_begun = simplex.count == 4 && polytope.begin(simplex.corners);
  if (!has_begun && !begin_anywhere(pair, hints, polytope)) return false;
  best = {true, Vector::Zero(), kInfinity, Vector::Zero()};
  for (;;) {
    const int f = polytope.nearest(best.overlap - kSure_m);
    if (f < 0) return true;
    const ExpandingPolytope::Face& face = polytope.face(f);
    const Difference next = support(pair, face.n, hints);
    const double overlap = face.n.dot(next.w);
    const bool is_surface = overlap - face.distance <= kSure_m;
    if (overlap < best.overlap) {
      best.n = face.n;
      best.overlap = overlap;
      best.p_A = is_surface ? polytope.foot_on_A(face) : next.a;
    }
    if (is_surface) {
      polytope.close(f);
    } else if (!polytope.expand(f, next)) {
      return false;
    }
  }
}

}  // namespace

namespace {

LeastOverlap of_polytopes(const ConvexPair& pair, double limit, SupportHints& hints) {
  Simplex simplex;
  const double length = pair.centre.norm();
  const Vector n = length > 0 ? Vector(pair.centre / length) : Vector(Vector::UnitZ());
  const Closest found = closest(pair, Vector::Zero(), n, limit, simplex, hints);
  if (found.kind == Closest::Kind::beyond_limit) return {};
  // Of those that kiss, the closest points tell no direction.
  if (found.kind == Closest::Kind::apart && found.distance > kKissing_m) {
    return {true, found.n, core_overlap(pair, found.n, hints), found.p_A};
  }
  LeastOverlap best;
  if (least_by_expanding(pair, simplex, hints, best)) return best;
  return descend(pair, best_face(pair, hints), hints);
}

/// The local minimum that closest points lead to from a direction, with the corners that it is
/// between; not found where rounding or flat parts are in the way.
bool find_near(const ConvexPair& pair, const Direction& from, double limit, Simplex& simplex,
               SupportHints& hints, LeastOverlap& least) {
  simplex.gap = kRoughGap;
  const double out = from.overlap > 0 ? from.overlap + kBeside * pair.small_length() : 0;
  const Closest found =
      closest(pair, out * from.n, from.n, out > 0 ? kInfinity : limit, simplex, hints);
  if (found.kind == Closest::Kind::beyond_limit) {
    least = {};
    return true;
  }
  return found.kind == Closest::Kind::apart && polish(pair, found.n, simplex, hints, least) &&
         least.overlap <= from.overlap + kSure_m;
}

/// A polytope about the local minimum at n, which is between the corners of the simplex.
bool begin_at(const ConvexPair& pair, const Vector& n, const Simplex& simplex, SupportHints& hints,
              ExpandingPolytope& polytope) {
  std::array<Difference, 4> corners = simplex.corners;
  if (simplex.count == 3) {
    corners[3] = support(pair, -n, hints);
    return polytope.begin(corners);
  }
  for (const double aside : {0.45, 2.0}) {
    if (simplex.count == 2) {
      const Vector e = aside * n.cross(corners[1].w - corners[0].w).normalized();
      corners[2] = support(pair, n + e, hints);
      corners[3] = support(pair, n - e, hints);
    } else {
      const Vector helper = std::abs(n.x()) < 0.57 ? Vector::UnitX() : Vector::UnitY();
      const Vector e = aside * helper.cross(n).normalized(), f = n.cross(e);
      constexpr double kRoot = std::numbers::sqrt3 / 2;
      if (simplex.count == 0) corners[0] = support(pair, n, hints);
      corners[1] = support(pair, n + e, hints);
      corners[2] = support(pair, n + (-0.5 * e + kRoot * f), hints);
      corners[3] = support(pair, n + (-0.5 * e - kRoot * f), hints);
    }
    if (polytope.begin(corners)) return true;
  }
  return false;
}

/// Looks whether another minimum is lower.
void seek_lower(const ConvexPair& pair, const Simplex& simplex, SupportHints& hints,
                LeastOverlap& best) {
  ExpandingPolytope polytope;
  if (!begin_at(pair, best.n, simplex, hints, polytope) && !begin_anywhere(pair, hints, polytope)) {
    return;
  }
  const bool is_smooth = pair.A.kind == ShapeKind::ellipsoid || pair.B.kind == ShapeKind::ellipsoid;
  const double same_cosine = is_smooth ? kSameCosine : kSameCosineAtEdges;
  bool has_begun_anew = false;
  for (int step = 0; step < kSeekMax; ++step) {
    const int nearest = polytope.nearest(best.overlap * (1 - kSeekShare) - kSure_m);
    if (nearest < 0) return;
    const ExpandingPolytope::Face& face = polytope.face(nearest);
    const Difference next = support(pair, face.n, hints);
    const double overlap = face.n.dot(next.w);
    if (overlap < best.overlap * (1 - kSeekShare) - kSure_m) {
      const LeastOverlap other = descend(pair, {face.n, overlap}, hints);
      if (other.overlap < best.overlap) best = other;
    }
    const double cosine = face.n.dot(best.n);
    const bool is_around_best =
        cosine > same_cosine && face.distance > (cosine - kThrough) * best.overlap - kSure_m;
    if (is_around_best || overlap - face.distance <= kSure_m) {
      polytope.close(nearest);
    } else if (!polytope.expand(nearest, next)) {
      if (has_begun_anew || !begin_anywhere(pair, hints, polytope)) return;
      has_begun_anew = true;
    }
  }
}

LeastOverlap of_curved(const ConvexPair& pair, double limit, SupportHints& hints) {
  const FaceDirection face = best_face(pair, hints);
  if (-face.overlap > limit) return {};
  if (is_best(pair, face)) {
    const bool of_A = face.face_of == FaceDirection::Of::A;
    return {true, face.n, face.overlap,
            of_A ? Vector(face.deepest + face.overlap * face.n) : face.deepest};
  }
  LeastOverlap best;
  Simplex corners;
  if (!find_near(pair, face, limit, corners, hints, best)) {
    corners.count = 0;
    Simplex simplex;
    const Closest found = closest(pair, Vector::Zero(), face.n, limit, simplex, hints);
    if (found.kind == Closest::Kind::beyond_limit) return {};
    Direction from = face;
    if (found.kind == Closest::Kind::apart) {
      const Direction n{found.n, core_overlap(pair, found.n, hints)};
      if (found.distance > pair.small_length()) return {true, n.n, n.overlap, found.p_A};
      if (n.overlap < from.overlap) from = n;  // else they kiss, and n is noise
    }
    best = descend(pair, from, hints);
  }
  if (best.is_within_limit && best.overlap > 0) seek_lower(pair, corners, hints, best);
  if (-best.overlap > limit) best.is_within_limit = false;
  return best;
}

}  // namespace

LeastOverlap least_overlap(const ConvexPair& pair, double limit, SupportHints& hints) {
  return is_polytope(pair.A) && is_polytope(pair.B) ? of_polytopes(pair, limit, hints)
                                                    : of_curved(pair, limit, hints);
}

}  // namespace cradle
