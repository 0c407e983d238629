// Any two convex shapes: the direction of least overlap, then where the parts that look along it
// lie over each other.
//
// Symbols: n normal from A to B, s = -h(n) the separation along it, by the support functions of the
// true shapes; F a frame with z along n, at Ao.
// The method is that of contact patches (as in Coal 3 and Gregorius, GDC 2015): no contact is
// sought by moving the shapes about, so points and names are steady.
// Where we differ: if one face lies across n, the other is cut by it as seen along n, however
// oblique it is, so that a tilted body has all its points; if none does, only the edges or corners
// that touch count. The deepest point has exactly the separation s.
//
// Cost: the direction (least_overlap.cpp), and 0.2 .. 0.4 us for the points.
#include "server/collision/convex_pair.h"

#include <algorithm>
#include <cmath>

#include "server/collision/feature_overlap.h"
#include "server/collision/four_points.h"
#include "server/collision/narrow_phase.h"
#include "server/collision/pair_functions.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

/// How far the shape of a face reaches along the face's normal.
double reach_of(const SupportFeature& face) {
  double reach = -kInfinity;
  for (std::size_t k = 0; k < static_cast<std::size_t>(face.count); ++k) {
    reach = std::max(reach, face.normal.dot(face.corners[k]));
  }
  return reach;
}

/// Turns n into the normal of the face or the two edges that it nearly is, if that overlaps no
/// more: closest points tell a direction to 1e-8 or so, geometry exactly.
void sharpen(const ConvexPair& pair, const SupportFeature& A, const SupportFeature& B,
             LeastOverlap& least, SupportHints& hints) {
  const auto is_near = [&](const Vector& exact) {
    const double off2 = (exact - least.n).squaredNorm();
    constexpr double kNear2 = kTolerances.sharpen_sine * kTolerances.sharpen_sine;
    return off2 < kNear2 && off2 != 0;
  };
  const auto take = [&](const Vector& exact, double overlap, double sine) {
    if (overlap > least.overlap + kTolerances.coincident_m) return;
    least.n = exact;
    least.overlap = overlap;
    least.sine = sine;
  };
  if (A.count > 2 && is_near(A.normal)) {
    const Vector b = pair.B.support(-(pair.R.transpose() * A.normal), hints.B);
    take(A.normal, reach_of(A) - A.normal.dot(pair.R * b + pair.t), 1);
  }
  if (B.count > 2) {
    const Vector n = -(pair.R * B.normal);
    if (is_near(n)) take(n, reach_of(B) + n.dot(pair.A.support(n, hints.A) - pair.t), 1);
  }
  if (A.count == 2 && B.count == 2) {
    const Vector across =
        (A.corners[1] - A.corners[0]).cross(pair.R * (B.corners[1] - B.corners[0]));
    const double length2 = across.squaredNorm();
    if (!(length2 > 0)) return;
    const Vector along = across / std::sqrt(length2);
    const Vector n = along.dot(least.n) < 0 ? Vector(-along) : along;
    if (is_near(n)) take(n, core_overlap(pair, n, hints), least.sine);
  }
}

/// Moves a feature to F, where `T` has the axes of F as rows and `z` is added to its heights.
void place(SupportFeature& feature, const Matrix& T, const Vector& origin, double z) {
  for (std::size_t k = 0; k < static_cast<std::size_t>(feature.count); ++k) {
    feature.corners[k] = T * feature.corners[k] + origin;
    feature.corners[k].z() += z;
  }
  feature.normal = T * feature.normal;
}

/// One point in F that has the separation s: where the closest points were, or a feature that is a
/// point itself.
FeatureContact deepest_point(const ConvexPair& pair, const SupportFeature& A,
                             const SupportFeature& B, const Vector& p_A_F, double s, double slack,
                             const FeatureContacts& others) {
  const auto at = [&](const Vector& p, double height) {
    std::uint32_t name = name_of_point(A, B, others.B_names, p.x(), p.y(), slack, 0);
    if (others.find(name) < others.count) name = 0;
    return FeatureContact{{p.x(), p.y(), s}, height, name, false};
  };
  if (A.count == 1 && B.count == 1) {
    const Vector middle = 0.5 * (A.corners[0] + B.corners[0]);
    return at(middle, middle.z());
  }
  if (A.count == 1) return at(A.corners[0], A.corners[0].z() + 0.5 * s);
  if (B.count == 1) return at(B.corners[0], B.corners[0].z() - 0.5 * s);
  // Of discs that are nearly level closest points tell some point of the rim.
  const bool are_faces = A.count > 2 && B.count > 2;
  const Vector p = are_faces ? common_point(A, B, p_A_F, slack) : p_A_F;
  return at(p, p.z() + pair.A.radius + 0.5 * s);
}

/// At most how far a point is outside of a box or hull; of other shapes it is not known.
double outside(const ConvexShape& shape, const Vector& p) {
  if (shape.kind == ShapeKind::box) return (p.cwiseAbs() - shape.size).maxCoeff();
  if (shape.kind != ShapeKind::hull) return kInfinity;
  double most = -kInfinity;
  const ConvexHull& hull = *shape.hull;
  for (std::size_t f = 0; f < hull.face_count(); ++f) {
    most = std::max(most, hull.normals[f].dot(p) - hull.offsets[f]);
  }
  return most;
}

/// Removes guesses that are not true: points outside of both bodies by more than they tell.
void remove_wrong_guesses(const ConvexPair& pair, const Matrix& T, double slack,
                          FeatureContacts& contacts) {
  const auto is_wrong = [&](const FeatureContact& c) {
    if (!c.is_guess) return false;
    const Vector p = T.transpose() * Vector(c.p.x(), c.p.y(), c.height);
    const double reach = std::abs(c.p.z()) + slack;
    return outside(pair.A, p) > reach || outside(pair.B, pair.R.transpose() * (p - pair.t)) > reach;
  };
  const auto used = contacts.used();
  contacts.count -=
      static_cast<std::size_t>(used.end() - std::remove_if(used.begin(), used.end(), is_wrong));
}

/// The points of the manifold, in F: the deepest has the separation s, none is deeper.
void find_contacts(const ConvexPair& pair, SupportFeature& A, SupportFeature& B, const Matrix& T,
                   const Vector& p_A, double s, FeatureContacts& contacts) {
  const double scale = std::min(
      1.0, std::min(pair.A.thickness, pair.B.thickness) / kTolerances.nominal_half_extent_m);
  const double slack = scale * kTolerances.clip_slack_m;
  overlap_features(A, B, slack, contacts);
  remove_wrong_guesses(pair, T, slack, contacts);

  FeatureContact* deepest = nullptr;
  for (FeatureContact& c : contacts.used()) {
    c.p.z() = std::max(c.p.z(), s);
    if (deepest == nullptr || c.p.z() < deepest->p.z()) deepest = &c;
  }
  if (deepest != nullptr && deepest->p.z() < s + scale * kTolerances.witness_m) {
    deepest->p.z() = s;
  } else {
    const FeatureContact point = deepest_point(pair, A, B, T * p_A, s, slack, contacts);
    contacts.items[contacts.count++] = point;
  }
}

/// Which of two shapes names a point where both have a corner: an ellipsoid has one always. What
/// else is round touches with another of its points as it turns.
int names_first(const ConvexShape& shape) {
  if (shape.kind == ShapeKind::ellipsoid) return 2;
  return shape.kind == ShapeKind::box || shape.kind == ShapeKind::hull ? 1 : 0;
}

Manifold manifold_apart(const Vector& n_W, double separation) {
  Manifold nothing;
  nothing.normal_W = n_W;
  nothing.lead = separation;
  return nothing;
}

/// A ball touches in one point, on the line through its middle, which needs no name.
Manifold manifold_of_ball(const ConvexPair& pair, const LeastOverlap& least, const Pose& X_WA,
                          double s) {
  Manifold manifold;
  manifold.normal_W = X_WA.R * least.n;
  manifold.count = 1;
  manifold.choice = least.names;
  manifold.lead = least.lead;
  manifold.points[0] = {X_WA.x + manifold.normal_W * (pair.A.radius + 0.5 * s), s, 0};
  return manifold;
}

/// Two lines, up to about 6 degrees.
bool are_along(const SupportFeature& A, const SupportFeature& B) {
  const Vector a = A.corners[1] - A.corners[0], b = B.corners[1] - B.corners[0];
  return a.cross(b).squaredNorm() < 0.01 * a.squaredNorm() * b.squaredNorm();
}

/// What both bodies may move until the normal is another one. It turns the faster the more nearly
/// parallel the edges are that it is across, and what touches slides along them.
double lead(const ConvexPair& pair, const LeastOverlap& least, const SupportFeature& A,
            const SupportFeature& B) {
  constexpr double kTurn = 2.5e-3;  // rad
  if (least.lead <= 0) return least.lead;
  // Where one end of a line is nearest to a line along it, the other may soon be.
  if (least.sine == 1 && A.count == 2 && B.count == 2 && are_along(A, B)) return -1;
  if (least.sine == 1) return least.lead;
  return std::min(least.lead, kTurn * least.sine * std::min(pair.A.thickness, pair.B.thickness));
}

}  // namespace

double lead_worth_knowing(const ConvexPair& pair) {
  return 2 * kTolerances.kept_motion * 2 * std::min({1.0, pair.A.thickness, pair.B.thickness});
}

Manifold convex_manifold(const ConvexPair& pair, LeastOverlap least, SupportHints& hints,
                         const Pose& X_WA, double margin) {
  if (!least.is_within_limit)
    return manifold_apart(X_WA.R * least.n, -least.overlap - pair.radii());
  if (pair.A.kind == ShapeKind::sphere) {
    const double s = -least.overlap - pair.radii();
    return s <= margin ? manifold_of_ball(pair, least, X_WA, s)
                       : manifold_apart(X_WA.R * least.n, s);
  }

  SupportFeature A = support_feature(pair.A, least.n, hints.A, least.farthest.A);
  SupportFeature B =
      support_feature(pair.B, -(pair.R.transpose() * least.n), hints.B, least.farthest.B);
  sharpen(pair, A, B, least, hints);
  const double s = -least.overlap - pair.radii();
  if (!(s <= margin)) return manifold_apart(X_WA.R * least.n, s);

  const Matrix T = frame_along(least.n);
  place(A, T, Vector::Zero(), pair.A.radius);
  place(B, T * pair.R, T * pair.t, -pair.B.radius);
  if (!is_flush(A) && !is_flush(B)) {
    keep_highest(A, 1);
    keep_highest(B, -1);
  }
  FeatureContacts contacts;
  contacts.B_names = names_first(pair.B) > names_first(pair.A);
  find_contacts(pair, A, B, T, least.p_A, s, contacts);

  const auto end = std::remove_if(contacts.used().begin(), contacts.used().end(),
                                  [&](const FeatureContact& c) { return !(c.p.z() <= margin); });
  std::span<FeatureContact> points(contacts.used().begin(), end);
  if (points.size() > kManifoldPoints) {
    bring_best_four(points);
    points = points.first(kManifoldPoints);
  }
  const Matrix R_WF = X_WA.R * T.transpose();
  Manifold manifold;
  manifold.normal_W = R_WF.col(2);
  manifold.count = static_cast<int>(points.size());
  manifold.choice = least.names;
  manifold.lead = std::min(lead(pair, least, A, B), kTolerances.kept_slide_m / contacts.steepness);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vector& p = points[k].p;
    manifold.points[k] = {X_WA.x + R_WF * Vector(p.x(), p.y(), points[k].height), p.z(),
                          points[k].name};
  }
  return manifold;
}

Manifold convex_convex(const Collider& collider_A, const Collider& collider_B, double margin) {
  const ConvexPair pair(collider_A, collider_B);
  if (!pair.is_finite()) return {};
  SupportHints hints;
  const LeastOverlap least =
      least_overlap(pair, margin + pair.radii(), hints, lead_worth_knowing(pair));
  return convex_manifold(pair, least, hints, collider_A.X_WB, margin);
}

std::optional<Manifold> still_apart(const Collider& A, const Collider& B, double margin,
                                    const PairHints& hints) {
  if (!hints.was_apart || hints.axis_W.isZero(0) || !begins_at_axis(A.shape.kind, B.shape.kind))
    return std::nullopt;
  const ConvexPair pair(A, B);
  SupportHints none;
  const double separation =
      -core_overlap(pair, A.X_WB.R.transpose() * hints.axis_W, none) - pair.radii();
  if (!(separation > margin)) return std::nullopt;
  return manifold_apart(hints.axis_W, separation);
}

}  // namespace cradle
