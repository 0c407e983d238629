// Curved cores: cylinders, cones and ellipsoids, at anything but what closed_overlap.cpp,
// revolved_overlap.cpp and revolved_pair.cpp have, or give up.
//
// Symbols as in least_overlap.cpp. The face of one shape that is nearest to the other's centre
// comes first: where shapes rest it is certainly best (best_face.h), and all is done.
//
// If a ball of radius r rolls everywhere inside one of the cores, then M = M' + that ball, and h is
// that of M' plus r. Where h < r at a local minimum, M' does not hold the origin, so that it is the
// one closest point of M' that was found: no other minimum is lower (Blaschke, "Kreis und Kugel"
// (1916), 24, for the ball that rolls). So Newton's method (polish.h), from centre to centre, is
// all that ellipsoids need which are no deeper than the least radius of their curvature; and all
// that cores which are apart need, with r = 0.
//
// Else a polytope grows (expanding_polytope.h) until its nearest face is nearly known; from there
// Newton's method finds a local minimum, whose corners the polytope takes in. It grows on until no
// face is nearer than that, or one is lower. A face through the minimum that leans by less than 10
// or 15 degrees is not looked behind, so another minimum that is up to 1.5 or 3.5 % lower can be
// hidden there: seen in 1 of 5000 random poses, and in 1 of 400 of those about one centre.
//
// Where a flat face of one shape, or in a rim, is what counts, Newton's method is no help, as the
// curvature is infinite there; but the polytope, which then has corners in its plane, soon arrives.
//
// Cost: Newton's method alone, 5 steps, 0.3 .. 0.9 us. A polytope takes 4 support points to begin,
// 6 faces, and 3 to 5 steps of Newton's method: 1.6 .. 2.6 us, of which growing is half.
#include "server/collision/curved_search.h"

#include <algorithm>
#include <cmath>

#include "server/collision/descent.h"
#include "server/collision/lead.h"
#include "server/collision/polish.h"
#include "server/collision/polytope_search.h"

namespace cradle {
namespace {

constexpr double kVeryDeep = 1.0;  // of the thickness: so deep, minima are many
constexpr double kFar = 0.1;  // of a squared distance: from there Newton's method finds the rest
constexpr double kFine = 1e-10;

constexpr int kSearchStepsMax = 40;        // the deepest overlaps of round shapes would take more
constexpr double kLowerShare = 1e-6;       // what counts is lower by that share
constexpr double kNearlyKnown = 0.3;       // of the overlap: what a face leaves open
constexpr double kNearlyKnownSmall = 0.1;  // or of the small length
constexpr int kFlatStepsMax = 5;           // beside a flat face the polytope arrives soon
constexpr int kLooksMax = 8;               // in vain
// A face through the minimum, to that share of it; one that is so near is not even asked about.
constexpr double kThrough = 1e-3;
constexpr double kSameCosine = 0.965, kSameCosineAtEdges = 0.985, kNearCosine = 0.999;

/// What the best direction so far is: a local minimum of some curved part, a face of M, or that of
/// the likely face, of which it is not known whether it is a minimum.
enum class Best { minimum, face, flat };

class CurvedSearch {
 public:
  CurvedSearch(const ConvexPair& pair, double limit, double lead_wanted, SupportHints& hints)
      : pair_(pair),
        limit_(limit),
        lead_wanted_(lead_wanted),
        thickness_(std::min(pair.A.thickness, pair.B.thickness)),
        rolling_(pair.A.rolling_radius + pair.B.rolling_radius),
        is_smooth_(pair.A.kind == ShapeKind::ellipsoid || pair.B.kind == ShapeKind::ellipsoid),
        hints_(hints) {}

  LeastOverlap find();

 private:
  LeastOverlap at_face(const FaceDirection& face) const;
  bool try_at_once(const Vector& n, const Difference& top);
  LeastOverlap by_distance(Simplex& simplex, const Vector& n);
  LeastOverlap by_fine_distance(Simplex& simplex, const Vector& n);
  LeastOverlap by_descent(const LeastOverlap& other);

  bool begin(const Vector& n, const Difference& top);
  LeastOverlap grow();
  bool is_beside_flat(const ExpandingPolytope::Face& face) const;
  bool is_around_best(const ExpandingPolytope::Face& face, double cosine) const;
  Simplex simplex_of(int f) const;
  void look_near(int f, double overlap, const Difference& next);
  void take_in(const Simplex& corners, int f);
  LeastOverlap apart_near(int f);

  void take(const LeastOverlap& best, Best which) {
    best_ = best;
    best_is_ = which;
  }
  bool is_nearly_known(double overlap, double open) const {
    return open < kNearlyKnown * std::max(overlap, kNearlyKnownSmall * pair_.small_length());
  }
  double lower_bound() const { return best_.overlap * (1 - kLowerShare) - kSure_m; }

  /// Of overlaps there may always be another that is hardly larger.
  LeastOverlap ended(LeastOverlap best) const {
    if (-best.overlap > limit_) best.is_within_limit = false;
    best.lead = best.overlap < -kKissing_m ? lead_by_turn(-best.overlap) : -1;
    return best;
  }

  /// Where the best direction is that of a face, which the polytope may have in triangles, the foot
  /// is on one of them.
  LeastOverlap ended_at_foot() {
    const int at_foot =
        best_is_ != Best::minimum ? polytope_.face_at_foot(-1, best_.n, best_.overlap) : -1;
    if (at_foot >= 0) best_.p_A = polytope_.foot_on_A(at_foot);
    return best_.overlap < kVeryDeep * thickness_ ? ended(best_) : by_descent(best_);
  }

  const ConvexPair& pair_;
  const double limit_, lead_wanted_, thickness_;
  const double rolling_;  ///< radius of a ball that rolls everywhere inside M
  const bool is_smooth_;
  SupportHints& hints_;
  ExpandingPolytope polytope_;
  bool is_broken_ = false;  ///< the polytope is of no more use
  int looks_in_vain_ = 0, flat_steps_ = 0;
  FaceDirection flat_;  ///< the likely face
  Best best_is_ = Best::minimum;
  LeastOverlap best_{true, Vector::Zero(), kInfinity, Vector::Zero()};
};

LeastOverlap CurvedSearch::find() {
  Vector n = pair_.middles();
  Difference top = support(pair_, n, hints_);
  const double overlap = n.dot(top.w);
  if (-overlap > limit_) return LeastOverlap::beyond(n, -overlap);
  const FaceDirection face = flat_ = likely_face(pair_, hints_);
  if (-face.overlap > limit_) return LeastOverlap::beyond(face.n, -face.overlap);
  if (is_best(pair_, face)) return at_face(face);

  const bool is_toward_face = face.overlap < overlap;
  if (rolling_ > 0) {
    if (is_toward_face) {
      n = face.n;
      top = support(pair_, n, hints_);
    }
    if (try_at_once(n, top)) return ended(best_);
    if (best_.overlap < kInfinity) return grow();
  }
  if (std::min(overlap, face.overlap) > kDeepOverlap * thickness_ &&
      (begin(n, top) || begin_anywhere(pair_, hints_, polytope_))) {
    return grow();
  }
  Simplex simplex;
  simplex.corners[0] = top;
  simplex.count = 1;
  return by_distance(simplex, is_toward_face ? face.n : n);
}

LeastOverlap CurvedSearch::at_face(const FaceDirection& face) const {
  const bool leads = lead_wanted_ > 0 && is_best(pair_, face, lead_wanted_ / 2);
  return {true, face.n, face.overlap,
          face.face_of == FaceDirection::Of::A ? Vector(face.deepest + face.overlap * face.n)
                                               : face.deepest,
          leads ? lead_wanted_ : -1};
}

/// By Newton's method alone. If that finds a minimum that may not be the lowest, the polytope has
/// begun around it.
bool CurvedSearch::try_at_once(const Vector& n, const Difference& top) {
  Simplex simplex;
  simplex.corners[0] = top;
  simplex.weights[0] = 1;
  simplex.count = 1;
  LeastOverlap found;
  if (!polish(pair_, n, simplex, hints_, found)) return false;
  const bool is_kissing = std::abs(found.overlap) <= kKissing_m;
  if (found.overlap < rolling_ && !is_kissing) {
    best_ = found;
    return true;
  }
  if (is_kissing || !(begin(found.n, simplex.corners[0]))) return false;
  best_ = found;
  take_in(simplex, 0);
  return false;
}

/// Of what is apart, or nearly.
LeastOverlap CurvedSearch::by_distance(Simplex& simplex, const Vector& n) {
  simplex.gap = kFar;
  const Closest far = closest(pair_, Vector::Zero(), n, limit_, simplex, hints_);
  if (far.kind == Closest::Kind::beyond_limit) return LeastOverlap::beyond(far.n, far.distance);
  if (far.kind == Closest::Kind::apart) {
    Simplex corners = simplex;
    LeastOverlap found;
    if (polish(pair_, far.n, corners, hints_, found) && found.overlap < -kKissing_m) {
      return ended(found);
    }
    return by_fine_distance(simplex, far.n);
  }
  const bool has_begun = (simplex.count == 4 && polytope_.begin(simplex.corners)) ||
                         begin_anywhere(pair_, hints_, polytope_);
  return has_begun ? grow() : by_descent(best_);
}

LeastOverlap CurvedSearch::by_fine_distance(Simplex& simplex, const Vector& n) {
  simplex.gap = kFine;
  const Closest found = closest(pair_, Vector::Zero(), n, limit_, simplex, hints_);
  if (found.kind == Closest::Kind::beyond_limit)
    return LeastOverlap::beyond(found.n, found.distance);
  if (found.kind == Closest::Kind::apart && found.distance > kKissing_m) {
    const Direction from{found.n, core_overlap(pair_, found.n, hints_)};
    if (found.distance > pair_.small_length()) {
      return {true, from.n, from.overlap, found.p_A, lead_by_turn(found.distance)};
    }
    return ended(descend(pair_, from, hints_));
  }
  // Of those that kiss, the closest points tell no direction.
  const bool has_begun = (simplex.count == 4 && polytope_.begin(simplex.corners)) ||
                         begin_anywhere(pair_, hints_, polytope_);
  return has_begun ? grow() : by_descent(best_);
}

/// Where the polytope has not told all.
LeastOverlap CurvedSearch::by_descent(const LeastOverlap& other) {
  const LeastOverlap found = descend(pair_, best_face(pair_, hints_), hints_);
  return ended(found.overlap < other.overlap ? found : other);
}

bool CurvedSearch::begin(const Vector& n, const Difference& top) {
  std::array<Difference, 4> corners;
  const std::array<Vector, 3> sides = around(n);
  for (std::size_t k = 0; k < 3; ++k) corners[k + 1] = support(pair_, sides[k], hints_);
  return begin_below(pair_, corners, top, polytope_);
}

LeastOverlap CurvedSearch::grow() {
  bool has_begun_anew = false;
  for (int step = 0; step < kSearchStepsMax; ++step) {
    if (is_broken_) {
      if (has_begun_anew || !begin_anywhere(pair_, hints_, polytope_)) break;
      has_begun_anew = true;
      is_broken_ = false;
    }
    const double bound = lower_bound();
    const int nearest = polytope_.nearest(bound);
    if (nearest < 0) return ended_at_foot();
    const ExpandingPolytope::Face& face = polytope_.face(nearest);
    if (is_around_best(face, kNearCosine)) {
      polytope_.close(nearest);
      continue;
    }
    const Difference next = support(pair_, face.n, hints_);
    const double overlap = face.n.dot(next.w), open = overlap - face.distance;
    if (overlap < -kKissing_m) return apart_near(nearest);
    if (open <= kSure_m) {
      if (overlap < bound) {
        take({true, face.n, overlap, polytope_.foot_on_A(nearest)}, Best::face);
      }
      polytope_.close(nearest);
    } else if (is_beside_flat(face) && flat_steps_ < kFlatStepsMax) {
      ++flat_steps_;
      if (flat_.overlap < bound) take({true, flat_.n, flat_.overlap, Vector::Zero()}, Best::flat);
      if (best_is_ == Best::flat && (polytope_.has_foot(nearest) || best_.p_A.isZero(0))) {
        best_.p_A = polytope_.foot_on_A(nearest);
      }
      is_broken_ = !polytope_.expand(nearest, next);
    } else if ((overlap < bound || best_is_ == Best::flat) &&
               (best_.overlap < kInfinity || is_nearly_known(overlap, open))) {
      look_near(nearest, overlap, next);
    } else if (is_around_best(face, is_smooth_ ? kSameCosine : kSameCosineAtEdges)) {
      polytope_.close(nearest);
    } else {
      is_broken_ = !polytope_.expand(nearest, next);
    }
  }
  return by_descent(best_);
}

/// The polytope arrives there by itself.
bool CurvedSearch::is_beside_flat(const ExpandingPolytope::Face& face) const {
  return flat_.overlap < kInfinity && (face.n - flat_.n).squaredNorm() < kBesideFace2;
}

/// A face through the local minimum that leans by little.
bool CurvedSearch::is_around_best(const ExpandingPolytope::Face& face, double cosine) const {
  const double here = face.n.dot(best_.n);
  return best_is_ != Best::flat && here > cosine &&
         face.distance > (here - kThrough) * best_.overlap - kSure_m;
}

/// The corners of a face, but for the point inside M, and their weights in the foot of the origin.
Simplex CurvedSearch::simplex_of(int f) const {
  Simplex simplex;
  const auto corners = polytope_.corners_of(f);
  const auto weights = polytope_.weights_at_foot(f);
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (corners[i].w == -pair_.centre) continue;
    simplex.corners[simplex.count] = corners[i];
    simplex.weights[simplex.count] = std::max(0.0, weights[i]);
    sum += simplex.weights[simplex.count++];
  }
  for (std::size_t i = 0; i < simplex.count; ++i) {
    double& weight = simplex.weights[i];
    weight = sum > 0 ? weight / sum : 1 / static_cast<double>(simplex.count);
  }
  return simplex;
}

/// Down from a face to a local minimum; `next` is farthest along the face's normal.
void CurvedSearch::look_near(int f, double overlap, const Difference& next) {
  const Vector n = polytope_.face(f).n;
  Simplex simplex = simplex_of(f);
  LeastOverlap found;
  if (polish(pair_, n, simplex, hints_, found, AtFace::give_up) && found.overlap < best_.overlap) {
    take(found, Best::minimum);
    take_in(simplex, f);
    return;
  }
  is_broken_ = !polytope_.expand(f, next);
  if (best_.overlap < kInfinity || ++looks_in_vain_ > kLooksMax) {
    found = descend(pair_, {n, overlap}, hints_);
    take(found.overlap < best_.overlap ? found : best_, Best::minimum);
  }
}

/// Corners of a minimum; face f is likely to see the first.
void CurvedSearch::take_in(const Simplex& corners, int f) {
  for (std::size_t i = 0; i < corners.count && !is_broken_; ++i) {
    const Vector& w = corners.corners[i].w;
    f = polytope_.sees(f, w, kSure_m) ? f : polytope_.face_seen_from(w, kSure_m);
    if (f >= 0) is_broken_ = !polytope_.expand(f, corners.corners[i]);
    f = std::max(f, 0);
  }
}

/// A face tells that they are apart.
LeastOverlap CurvedSearch::apart_near(int f) {
  const Vector& n = polytope_.face(f).n;
  Simplex near = simplex_of(f), simplex;
  LeastOverlap found;
  if (polish(pair_, n, near, hints_, found) && found.overlap < -kKissing_m) {
    return ended(found);
  }
  std::ranges::copy(polytope_.corners_of(f), simplex.corners.begin());
  simplex.count = 3;
  return by_distance(simplex, n);
}

}  // namespace

LeastOverlap curved_overlap(const ConvexPair& pair, double limit, double lead_wanted,
                            SupportHints& hints) {
  return CurvedSearch(pair, limit, lead_wanted, hints).find();
}

}  // namespace cradle
