// What two boxes meet by where a face is among the best axes: that face, the other one, or edges.
//
// Symbols as in box_box.cpp. A face counts if what reaches deepest behind it is over it, or nearly;
// else another direction is better. It still counts where edges part the boxes, if they overlap
// along its normal by less than the slack: in a heap of 2000 cubes 110 contacts changed between a
// face and edges in every tick, which kept it in motion for good. So the normal is that of the
// least translation but for ties within these leads.
//
// Flush faces are cut once, along the preferred one, so that points keep their names; the normal
// is that of what touches at the deepest of them: either face, or two edges that cross there. M is
// the set of all points of A less those of B. The line along the preferred normal through that
// point leaves M by a face, of which all points are as deep along its normal as the boxes overlap:
// so the depth is exact, and the normal turns by no more than the faces lean to each other, but for
// edges that cross at a small angle. Of boxes apart such a normal may part them by far less than
// they are apart: it counts only if it cannot be off by more than the slack, or if the boxes are
// nearest where these edges cross.
//
// Where edges or corners are nearest, the rest of the faces is told as far as the foresight goes.
#include <algorithm>
#include <cmath>

#include "server/collision/box_batch.h"
#include "server/collision/box_corners.h"
#include "server/collision/box_edges.h"
#include "server/collision/box_faces.h"
#include "server/collision/box_kernels.h"
#include "server/collision/pair_functions.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

constexpr double kParallelEdges2 = 1e-12;  // squared sine: below, two edges have no common normal

/// Null: the manifold has no point.
ContactPoint* deepest(Manifold& manifold) {
  const auto begin = manifold.points.begin(), end = begin + manifold.count;
  return begin == end ? nullptr
                      : &*std::ranges::min_element(begin, end, {}, &ContactPoint::separation);
}

/// Puts the deepest point lower by `missed`, and others the less, the more they are above it: else
/// separations would jump where another becomes the deepest.
void lower(Manifold& manifold, double missed, double slack) {
  const double near = kTolerances.as_deep * slack;
  const double least = deepest(manifold)->separation;
  for (int k = 0; k < manifold.count; ++k) {
    double& separation = manifold.points[static_cast<std::size_t>(k)].separation;
    separation -= missed * std::max(0.0, 1 - (separation - least) / near);
  }
}

/// How far a point over a face across `axis` is from its sides.
double inside_box_face(const Shape& box, const Pose& X_WB, int axis, const Vector& p_W) {
  const Vector p = X_WB.R.transpose() * (p_W - X_WB.x);
  Vector inside = to_eigen(box.half_extents_m()) - p.cwiseAbs();
  inside[axis] = kInfinity;
  return inside.minCoeff();
}

}  // namespace

BoxBatch::Facing::Face BoxBatch::Facing::face(const Pose& X_WB, double number) {
  const int axis = static_cast<int>(number) / 2, e = (axis + 1) % 3, f = (axis + 2) % 3;
  return {axis, X_WB.R.col(axis), {e, f}, {X_WB.R.col(e), X_WB.R.col(f)}};
}

void BoxBatch::Facing::set(Manifold& manifold) const {
  set_manifold(block, lane, reference_pose(), manifold);
}

/// How far a point over the reference face is from its sides.
double BoxBatch::Facing::inside(const Vector& p_W) const {
  return inside_box_face(on_A() ? *pair.A : *pair.B, reference_pose(), reference().axis, p_W);
}

/// Of boxes apart: whether they are nearest on edges along these axes of theirs.
bool BoxBatch::Facing::are_nearest(int of_reference, int of_incident) const {
  BoxAxes boxes = axes_of(block, lane);
  boxes.edges.i = on_A() ? of_reference : of_incident;
  boxes.edges.j = on_A() ? of_incident : of_reference;
  return edges_are_nearest(boxes);
}

double BoxBatch::Facing::separation_along(const Vector& n) const {
  const auto reach = [&n](const Shape& box, const Pose& X_WB) {
    return to_eigen(box.half_extents_m()).dot((X_WB.R.transpose() * n).cwiseAbs());
  };
  return n.dot(pair.X_WB->x - pair.X_WA->x) - reach(*pair.A, *pair.X_WA) -
         reach(*pair.B, *pair.X_WB);
}

/// For flush faces, where what reaches deepest is beside the reference face: turns the normal to
/// that of what touches at the deepest point. False if none is found, because of what counts as
/// over a face by the slack.
bool BoxBatch::Facing::lean(Manifold& at_face, ContactPoint& point) const {
  const Face face = reference(), other = incident();
  const Vector along = at_face.normal_W;
  Vector best = along;
  double nearest = 0, separation = kInfinity;
  bool bears = true;
  const auto try_normal = [&](Vector n, auto holds) {  // whether no other need be tried
    const double length2 = n.squaredNorm();
    if (!(length2 > kParallelEdges2)) return false;
    n *= (n.dot(along) < 0 ? -1 : 1) / std::sqrt(length2);
    const double cosine = n.dot(along), s = separation_along(n);
    const double off = std::abs(cosine * point.separation - s) - kTolerances.tie_m;
    const double sine2 = 1 - cosine * cosine, slack = 2 * block.slack[lane];
    const bool is_near = off <= 0 || off * off <= slack * slack * sine2;
    if (!(cosine > nearest && is_near)) return false;
    // Boxes apart are nearer than the point is to the face, and farther than along n.
    const bool is_sure = !is_apart() || (1 - cosine) * point.separation <= block.slack[lane];
    if (!is_sure && !holds()) return false;
    bears = is_sure;
    best = n;
    nearest = cosine;
    separation = s;
    return off <= 0;
  };
  const auto try_all = [&] {
    if (try_normal(other.axis_W, [] { return false; })) return;
    for (const std::size_t i : {0u, 1u}) {
      for (const std::size_t j : {0u, 1u}) {
        const auto holds = [&] { return are_nearest(face.edges[i], other.edges[j]); };
        if (try_normal(face.edges_W[i].cross(other.edges_W[j]), holds)) return;
      }
    }
  };
  try_all();
  if (!(separation < kInfinity)) return false;
  at_face.normal_W = best;
  if (!bears) at_face.lead = -1;
  for (int k = 0; k < at_face.count; ++k) {
    at_face.points[static_cast<std::size_t>(k)].separation *= nearest;
  }
  point.separation = separation;
  return true;
}

/// A face counts if what reaches deepest is over it; else another direction is better. How far
/// that is from the separation of the boxes along it: `missed`.
bool BoxBatch::Facing::counts(Manifold& at_face, double& missed) const {
  ContactPoint* const point = deepest(at_face);
  const double s = block.s[lane], slack = block.slack[lane];
  missed = point == nullptr ? kInfinity : point->separation - s;
  if (point == nullptr) return false;
  if (is_flush() && missed > kTolerances.tie_m && lean(at_face, *point)) {
    missed = 0;
    return true;
  }
  if (is_apart()) {
    // No face parts what edges do if they overlap behind it. And unless they are flush, the face is
    // nearest if and only if the point is over it. But within the slack all stays as it is, so that
    // what lies on an edge beside a face does not change between them from tick to tick.
    if (!(s > -slack)) return false;
    const bool stays = is_flush() || s <= slack;
    if (!stays && !(missed <= kTolerances.tie_m && inside(point->p_W) >= -kTolerances.tie_m)) {
      return false;
    }
  }
  const double allowed = slack + kTolerances.edge_bias_per_depth * std::max(0.0, -s);
  if (!(missed <= (stays_by_edges() ? kTolerances.tie_m : allowed))) return false;
  lower(at_face, missed, slack);
  return true;
}

/// How long a face contact that bears so far is as it is: no other axis is better, and what touches
/// is over the face.
double BoxBatch::Facing::lead(Manifold& manifold, double missed) const {
  const double bears = std::min(block.lead[lane], manifold.lead);
  if (is_flush()) {
    return std::min({bears, block.slack[lane] - missed, block.until_tilted[lane]});
  }
  const double stays = missed > kTolerances.tie_m ? -1 : inside(deepest(manifold)->p_W);
  const double s = block.s[lane];
  const double until_apart =  // by edges: see `counts`
      s > 0 ? kInfinity : std::max(s + block.slack[lane], -block.s_edge[lane]);
  return std::min({bears, stays, until_apart});
}

/// The faces of boxes that meet by edges or corners, if they look at each other: what else of them
/// is within the foresight. Boxes that turn about the point where they touch slam these together
/// within a tick. Each point is on both boxes, the separation that of its ends along the normal.
void BoxBatch::Facing::add_rest_of_faces(Manifold& manifold) const {
  Manifold at_face;
  const bool is_of_A = block.s_A[lane] >= block.s_B[lane];  // whoever of the two is called A
  if (BoxFaceBlock own; is_of_A != on_A()) {
    alone(is_of_A, own, at_face);
  } else {
    set(at_face);
  }
  const double cosine = at_face.normal_W.dot(manifold.normal_W);
  if (!(cosine > kTolerances.facing_cosine)) return;
  const double near = kTolerances.same_place_m * block.slack[lane] / kTolerances.clip_slack_m;
  const int nearest = manifold.count;
  const auto is_beside_nearest = [&](const Vector& p_W) {
    return std::any_of(
        manifold.points.begin(), manifold.points.begin() + nearest,
        [&](const ContactPoint& p) { return (p.p_W - p_W).squaredNorm() < near * near; });
  };
  const double least = manifold.points[0].separation;
  for (int k = 0; k < at_face.count && manifold.count < kManifoldPoints; ++k) {
    ContactPoint point = at_face.points[static_cast<std::size_t>(k)];
    if (is_beside_nearest(point.p_W)) continue;
    point.separation = std::max(cosine * point.separation, least);
    manifold.points[static_cast<std::size_t>(manifold.count++)] = point;
  }
}

/// By edges that part the boxes better than any face.
bool BoxBatch::Facing::meet_by_edges(Manifold& manifold) const {
  if (!(block.s_edge[lane] > block.least_edge[lane])) return false;
  meet_edges(axes_of(block, lane), *pair.X_WA, manifold);
  if (manifold.count == 0) return false;
  manifold.choice = kEdgesOfChoice;
  add_rest_of_faces(manifold);
  return true;
}

/// What is nearest where no face counts: corners or edges of boxes apart, edges of others.
void BoxBatch::Facing::meet_beside_faces(Manifold& manifold) const {
  if (!is_apart()) {
    meet_edges(axes_of(block, lane), *pair.X_WA, manifold);
  } else if (!meet_corners(axes_of(block, lane), *pair.X_WA, pair.margin, manifold)) {
    manifold = convex_convex({*pair.A, *pair.X_WA}, {*pair.B, *pair.X_WB}, pair.margin);
    manifold.lead = manifold.count > 0 ? -1 : pair.margin;
  }
  if (manifold.count == 0) return;
  manifold.choice = kEdgesOfChoice;
  add_rest_of_faces(manifold);
}

/// Sets the contact along the preferred face, if that counts; else takes that along the other one,
/// or of edges.
void BoxBatch::Facing::meet(Manifold& manifold) const {
  if (meet_by_edges(manifold)) return;
  set(manifold);
  double missed = 0;
  if (counts(manifold, missed)) {
    manifold.lead = lead(manifold, missed);
    return;
  }
  const double s_A = block.s_A[lane], s_B = block.s_B[lane], s_edge = block.s_edge[lane];
  BoxFaceBlock own;
  if (std::abs(s_A - s_B) <= block.bias[lane] &&
      alone(!on_A(), own, manifold).counts(manifold, missed)) {
    return;
  }
  if (is_apart() || s_edge > std::max(s_A, s_B)) {
    meet_beside_faces(manifold);
  } else {
    alone(s_B <= s_A, own, manifold);
  }
}

/// The same along the face of A, or that of B, in a block of its own.
BoxBatch::Facing BoxBatch::Facing::alone(bool face_of_A, BoxFaceBlock& own,
                                         Manifold& manifold) const {
  copy_lane(block, lane, own, 0);
  own.on_A[0] = face_of_A ? 1 : 0;
  box_kernels_of(1).clip(own, 1);
  const Facing facing{pair, own, 0};
  facing.set(manifold);
  manifold.lead = -1;
  return facing;
}

}  // namespace cradle
