// Box against box: separating axes, then the clipped faces or one point of two edges.
//
// Method: the 15 axes of Gottschalk, Lin and Manocha, "OBBTree" (1996); what the best axis means
// for the contact after Gregorius, "The separating axis test between convex polyhedra" (GDC 2013);
// closest points of two edges after Ericson, "Real-Time Collision Detection" (2005), 5.1.9.
// Symbols, all in A's frame: C axes of B as columns, t from A's centre to B's, h half extents,
// s separation along an axis (negative: overlap), i an axis of A, j of B, n normal from A to B.
// Where we differ: faces are preferred to edges by a lead that grows with the overlap, and A to B
// by a small one (tolerances.h), if what reaches deepest behind the face is over it: then the depth
// is exact along the normal. A face still counts where edges part the boxes, if they overlap along
// its normal by less than the slack: in a heap of 2000 cubes 110 contacts changed between a face
// and edges in every tick, which kept it in motion for good. So the normal is that of the least
// translation but for ties within these leads. Boxes apart that are nearest beside these axes meet
// by their nearest points (box_corners.cpp); the few that those leave, by the search of
// least_overlap.cpp. Axes and faces are worked on eight pairs at a time (box_method.h); what they
// mean is decided here, pair by pair. Cost of a pair eight abreast, with AVX-512: apart 20 ns,
// flush 100 ns; of one alone 270 ns.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "server/collision/box_batch.h"
#include "server/collision/box_corners.h"
#include "server/collision/box_faces.h"
#include "server/collision/box_kernels.h"
#include "server/collision/pair_functions.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// An edge of a box: the one along `axis` that lies farthest in the direction `d`.
struct Edge {
  Vector middle;
  std::uint32_t name = 0;

  Edge(const Vector& half_extents, int axis, const Vector& d) : middle(half_extents) {
    std::uint32_t bits = 0;
    for (int k = 0; k < 3; ++k) {
      if (d[k] < 0) {
        middle[k] = -half_extents[k];
      } else {
        bits |= 1u << k;
      }
    }
    middle[axis] = 0;
    name = name_of(bits & ~(1u << axis), bits | 1u << axis);
  }
};

/// One point midway between the edges that meet along the axis. None if only their lines meet: if
/// the edges are apart, and farther from each other than along the axis.
Manifold meet_edges(const BoxAxes& boxes, const Pose& X_WA) {
  const BoxAxes::Edges& axis = boxes.edges;
  const Vector a = Vector::Unit(axis.i), b = boxes.C.col(axis.j);
  Vector n = a.cross(b).normalized();
  if (n.dot(boxes.t) < 0) n = -n;
  const Edge edge_A(boxes.h_A, axis.i, n);
  const Edge edge_B(boxes.h_B, axis.j, -(boxes.C.transpose() * n));

  const Vector middle_B = boxes.t + boxes.C * edge_B.middle;
  const Vector d = middle_B - edge_A.middle;
  const double c = a.dot(b), a_d = a.dot(d), b_d = b.dot(d);
  const double end_A = boxes.h_A[axis.i], end_B = boxes.h_B[axis.j];
  double along_A = std::clamp((a_d - c * b_d) / (1 - c * c), -end_A, end_A);
  const double along_B = std::clamp(c * along_A - b_d, -end_B, end_B);
  along_A = std::clamp(a_d + c * along_B, -end_A, end_A);
  const Vector p = edge_A.middle + a * along_A;
  const Vector q = middle_B + b * along_B;

  Manifold manifold;
  if (axis.s > 0 && (q - p).norm() > axis.s + kTolerances.tie_m) return manifold;
  constexpr std::uint32_t kNoFace = 15u << 12;
  manifold.normal_W = X_WA.R * n;
  manifold.count = 1;
  manifold.lead = -1;  // turns with both boxes, the more the less the edges cross
  manifold.points[0] = {X_WA.x + X_WA.R * (0.5 * (p + q)), axis.s,
                        kNoFace | edge_A.name << 6 | edge_B.name};
  return manifold;
}

/// Null: the manifold has no point.
ContactPoint* deepest(Manifold& manifold) {
  const auto begin = manifold.points.begin(), end = begin + manifold.count;
  return begin == end ? nullptr
                      : &*std::ranges::min_element(begin, end, {}, &ContactPoint::separation);
}

/// How far a point over a face is from its sides.
double inside_face(const Shape& box, const Pose& X_WB, int axis, const Vector& p_W) {
  const Vector p = X_WB.R.transpose() * (p_W - X_WB.x);
  Vector inside = to_eigen(box.half_extents_m()) - p.cwiseAbs();
  inside[axis] = kInfinity;
  return inside.minCoeff();
}

Manifold apart(double separation) {
  Manifold nothing;
  nothing.lead = separation;
  return nothing;
}

/// Columns of a matrix, or a vector, to rows of a lane.
template <std::size_t n>
void set(BoxPairBlock::Row (&rows)[n], int lane, const double* values) {
  for (std::size_t k = 0; k < n; ++k) rows[k][lane] = values[k];
}

BoxAxes axes_of(const BoxAxesBlock& b, int lane) {
  BoxAxes axes;
  for (int k = 0; k < 3; ++k) {
    axes.h_A[k] = b.h_A[k][lane];
    axes.h_B[k] = b.h_B[k][lane];
    axes.t[k] = b.t[k][lane];
  }
  for (int k = 0; k < 9; ++k) axes.C.data()[k] = b.C[k][lane];
  const int edge = static_cast<int>(b.edge[lane]);
  axes.edges = {b.s_edge[lane], edge / 3, edge % 3};
  return axes;
}

void copy_lane(const BoxAxesBlock& from, int lane, BoxAxesBlock& to, int to_lane) {
  using Row = BoxAxesBlock::Row;
  const auto* const rows = reinterpret_cast<const Row*>(&from);
  auto* const to_rows = reinterpret_cast<Row*>(&to);
  for (std::size_t k = 0; k < sizeof(BoxAxesBlock) / sizeof(Row); ++k) {
    to_rows[k][to_lane] = rows[k][lane];
  }
}

/// What faces part the boxes by, if that is more than the margin, or edges do; else the margin.
double separation_beyond(const BoxPairBlock& b, int lane) {
  const double margin = b.margin[lane];
  if (!(b.s_A[lane] <= margin)) return b.s_A[lane];
  if (!(b.s_B[lane] <= margin)) return b.s_B[lane];
  return std::max(margin, b.s_edge[lane]);
}

}  // namespace

BoxBatch::BoxBatch(MadeManifolds& made, int lanes) : made_(made), kernels_(box_kernels_of(lanes)) {
  if (kernels_.lanes == 1) return;
  pair_block_ = {};  // lanes without a pair are worked on, too
  face_block_ = {};
}

void BoxBatch::add(std::size_t key, const Collider& A, const Collider& B, double margin) {
  const int lane = waiting_++;
  waits_[static_cast<std::size_t>(lane)] = {key, &A.shape, &B.shape, &A.X_WB, &B.X_WB, margin};
  BoxPairBlock& b = pair_block_;
  const Vector d = B.X_WB.x - A.X_WB.x;
  set(b.h_A, lane, A.shape.parameters.data());
  set(b.h_B, lane, B.shape.parameters.data());
  set(b.R_A, lane, A.X_WB.R.data());
  set(b.R_B, lane, B.X_WB.R.data());
  set(b.d, lane, d.data());
  b.margin[lane] = margin;
  if (waiting_ == kBoxLanes) separate();
}

void BoxBatch::finish() {
  if (waiting_ > 0) separate();
  if (facing_ > 0) clip();
}

void BoxBatch::separate() {
  for (int lane = waiting_; lane < kBoxLanes; ++lane) pair_block_.margin[lane] = -1;
  kernels_.separate(pair_block_, waiting_);
  const int pairs = std::exchange(waiting_, 0);
  std::array<int, kBoxLanes> by_faces;
  std::size_t count = 0;
  for (int lane = 0; lane < pairs; ++lane) {
    const Waiting& pair = waits_[static_cast<std::size_t>(lane)];
    const double beyond = separation_beyond(pair_block_, lane);
    if (beyond > pair.margin || beyond != beyond) {
      made_.take(pair.key, apart(beyond));
    } else if (!edges_meet(pair, lane)) {
      by_faces[count++] = lane;
    }
  }
  const std::span<const int> lanes(by_faces.data(), count);
  // As they are, if few lanes are worked on in vain; else with the next ones.
  if (pairs - static_cast<int>(count) <= kernels_.lanes / 4)
    return clip(pair_block_, waits_, lanes);
  for (const int lane : lanes) wait(lane);
}

/// Makes the manifold if so.
bool BoxBatch::edges_meet(const Waiting& pair, int lane) {
  if (!(pair_block_.s_edge[lane] > pair_block_.least_edge[lane])) return false;
  const Manifold manifold = meet_edges(axes_of(pair_block_, lane), *pair.X_WA);
  if (manifold.count > 0) made_.take(pair.key, manifold);
  return manifold.count > 0;
}

void BoxBatch::wait(int lane) {
  copy_lane(pair_block_, lane, face_block_, facing_);
  faces_[static_cast<std::size_t>(facing_++)] = waits_[static_cast<std::size_t>(lane)];
  if (facing_ == kBoxLanes) clip();
}

void BoxBatch::clip() {
  constexpr std::array<int, kBoxLanes> kAll = {0, 1, 2, 3, 4, 5, 6, 7};
  clip(face_block_, faces_, {kAll.data(), static_cast<std::size_t>(std::exchange(facing_, 0))});
}

void BoxBatch::clip(BoxFaceBlock& block, const std::array<Waiting, kBoxLanes>& pairs,
                    std::span<const int> lanes) {
  if (lanes.empty()) return;
  kernels_.clip(block, lanes.back() + 1);
  Manifold manifold;
  for (const int lane : lanes) {
    const Waiting& pair = pairs[static_cast<std::size_t>(lane)];
    Facing{pair, block, lane}.meet(manifold);
    made_.take(pair.key, manifold);
  }
}

void BoxBatch::Facing::set(Manifold& manifold) const {
  set_manifold(block, lane, on_A() ? *pair.X_WA : *pair.X_WB, manifold);
}

/// How far a point over the reference face is from its sides.
double BoxBatch::Facing::inside(const Vector& p_W) const {
  return inside_face(on_A() ? *pair.A : *pair.B, on_A() ? *pair.X_WA : *pair.X_WB,
                     static_cast<int>(block.reference[lane]) / 2, p_W);
}

/// A face counts if what reaches deepest is over it; else another direction is better. How far
/// that is from the separation of the boxes along it: `missed`.
bool BoxBatch::Facing::counts(Manifold& at_face, double& missed) const {
  ContactPoint* const point = deepest(at_face);
  const double s = block.s[lane], slack = block.slack[lane];
  missed = point == nullptr ? kInfinity : point->separation - s;
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
  if (!(missed <= allowed)) return false;
  if (!is_flush()) point->separation = s;
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
      s > 0 ? kInfinity
            : std::max(s + block.slack[lane], -std::max(block.s_edge[lane], block.next_edge[lane]));
  return std::min({bears, stays, until_apart});
}

/// Sets the contact along the preferred face, if that counts; else takes that along the other one,
/// or of edges.
void BoxBatch::Facing::meet(Manifold& manifold) const {
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
  if (is_apart()) {
    if (meet_corners(axes_of(block, lane), *pair.X_WA, pair.margin, manifold)) return;
    manifold = convex_convex({*pair.A, *pair.X_WA}, {*pair.B, *pair.X_WB}, pair.margin);
    manifold.lead = manifold.count > 0 ? -1 : pair.margin;
  } else if (s_edge > std::max(s_A, s_B)) {
    manifold = meet_edges(axes_of(block, lane), *pair.X_WA);
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

Manifold box_box(const Collider& A, const Collider& B, double margin) {
  struct Only final : MadeManifolds {
    void take(std::size_t, const Manifold& made) override { manifold = made; }
    Manifold manifold;
  } only;
  BoxBatch batch(only, 1);
  batch.add(0, A, B, margin);
  batch.finish();
  return only.manifold;
}

}  // namespace cradle
