// What two boxes meet by where a face is among the best axes: that face, the other one, or edges.
//
// Symbols as in box_box.cpp. A face counts (box_verdict.h) if what reaches deepest behind it is
// over it, or nearly; else another direction is better. It still counts where edges part the boxes,
// if they overlap along its normal by less than the slack: in a heap of 2000 cubes 110 contacts
// changed between a face and edges in every tick, which kept it in motion for good. So the normal
// is that of the least translation but for ties within these leads.
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

}  // namespace

BoxBatch::Facing::Face BoxBatch::Facing::face(const Pose& X_WB, double number) {
  const int axis = static_cast<int>(number) / 2, e = (axis + 1) % 3, f = (axis + 2) % 3;
  return {axis, X_WB.R.col(axis), {e, f}, {X_WB.R.col(e), X_WB.R.col(f)}};
}

void BoxBatch::Facing::set(Manifold& manifold) const {
  set_manifold(block, lane, reference_pose(), block.z, manifold);
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
bool BoxBatch::Facing::lean(Manifold& at_face) const {
  ContactPoint& point = *deepest(at_face);
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
  at_face.lead = std::min(
      {block.lead[lane], bears ? at_face.lead : -1, block.slack[lane], block.until_tilted[lane]});
  for (int k = 0; k < at_face.count; ++k) {
    at_face.points[static_cast<std::size_t>(k)].separation *= nearest;
  }
  point.separation = separation;
  return true;
}

/// The contact along the reference face, if that counts: box_verdict.h.
bool BoxBatch::Facing::set_if_it_counts(Manifold& manifold) const {
  const double missed = block.missed[lane];
  if (is_flush() && missed > kTolerances.tie_m && missed < kInfinity) {
    set(manifold);
    if (lean(manifold)) return true;
  }
  if (!(block.counts[lane] > 0)) return false;
  set_manifold(block, lane, reference_pose(), block.lowered, manifold);
  manifold.lead = block.stays[lane];
  return true;
}

/// The faces of boxes that meet by edges or corners, if they look at each other: what else of them
/// is within the foresight. Boxes that turn about the point where they touch slam these together
/// within a tick. Each point is on both boxes, the separation that of its ends along the normal.
void BoxBatch::Facing::add_rest_of_faces(Manifold& manifold) const {
  Manifold at_face;
  const bool is_of_A = block.s_A[lane] >= block.s_B[lane];  // whoever of the two is called A
  if (BoxFaceBlock own; is_of_A != on_A()) {
    alone(is_of_A, own).set(at_face);
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
  if (meet_by_edges(manifold) || set_if_it_counts(manifold)) return;
  const double s_A = block.s_A[lane], s_B = block.s_B[lane], s_edge = block.s_edge[lane];
  BoxFaceBlock own;
  if (std::abs(s_A - s_B) <= block.bias[lane] && alone(!on_A(), own).set_if_it_counts(manifold)) {
    manifold.lead = -1;
  } else if (is_apart() || s_edge > std::max(s_A, s_B)) {
    meet_beside_faces(manifold);
  } else {
    alone(s_B <= s_A, own).set(manifold);
    manifold.lead = -1;
  }
}

/// The same along the face of A, or that of B, in a block of its own.
BoxBatch::Facing BoxBatch::Facing::alone(bool face_of_A, BoxFaceBlock& own) const {
  copy_lane(block, lane, own, 0);
  own.on_A[0] = face_of_A ? 1 : 0;
  box_kernels_of(1).clip(own, 1);
  return {pair, own, 0};
}

}  // namespace cradle
