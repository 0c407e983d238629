// Box against box: separating axes, then the clipped faces or one point of two edges.
//
// Method: the 15 axes of Gottschalk, Lin and Manocha, "OBBTree" (1996); what the best axis means
// for the contact after Gregorius, "The separating axis test between convex polyhedra" (GDC 2013).
// Symbols, all in A's frame: C axes of B as columns, t from A's centre to B's, h half extents,
// s separation along an axis (negative: overlap), i an axis of A, j of B, n normal from A to B.
// Where we differ: faces are preferred to edges by a lead that grows with the overlap, and A to B
// by a small one (tolerances.h), see box_facing.cpp. Boxes apart that are nearest beside these axes
// meet by their nearest points (box_corners.cpp); the few that those leave, by the search of
// least_overlap.cpp. Axes and faces are worked on eight pairs at a time (box_method.h). Cost of a
// pair eight abreast, with AVX-512: apart 20 ns, flush 100 ns; of one alone 270 ns.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include "server/collision/box_batch.h"
#include "server/collision/box_kernels.h"
#include "server/collision/pair_functions.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

Manifold apart(double separation) {
  Manifold nothing;
  nothing.lead = separation;
  return nothing;
}

/// Bo, then axes.
const double* numbers_of(const Pose& X_WB) {
  static_assert(sizeof(Pose) == 12 * sizeof(double) && offsetof(Pose, x) == 0);
  return X_WB.x.data();
}

/// Lanes without a pair that are worked on, too: as the first, but apart.
void fill_up(BoxPairBlock& block, int pairs, int lanes) {
  for (int lane = pairs; lane % lanes != 0; ++lane) {
    for (auto* numbers : {&block.half_A, &block.half_B, &block.X_WA, &block.X_WB}) {
      (*numbers)[lane] = (*numbers)[0];
    }
    block.margin[lane] = -1;
  }
}

/// What faces part the boxes by, if that is more than the margin, or edges do; else the margin.
double separation_beyond(const BoxPairBlock& b, int lane, double margin) {
  const double s_A = b.s_A[lane], s_B = b.s_B[lane];
  const double beyond[] = {std::max(margin, b.s_edge[lane]), s_B, s_A, s_A};  // it is chance
  return beyond[(s_A <= margin ? 0 : 2) + (s_B <= margin ? 0 : 1)];
}

}  // namespace

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

BoxBatch::BoxBatch(MadeManifolds& made, int lanes) : made_(made), kernels_(box_kernels_of(lanes)) {
  if (kernels_.lanes == 1) return;
  for (Queue& queue : queues_) queue.block = {};  // lanes without a pair are worked on, too
  face_block_ = {};
}

void BoxBatch::add(std::size_t key, const Collider& A, const Collider& B, double margin,
                   double foresight, std::uint64_t choice) {
  Queue& queue = queues_[choice != 0 ? 1 : 0];  // it is chance: no branch
  const int lane = queue.waiting++;
  const bool met_by_edges = choice == kEdgesOfChoice;  // likewise
  queue.pairs[static_cast<std::size_t>(lane)] = {key, &A.shape, &B.shape, &A.X_WB, &B.X_WB, margin};
  choice &= met_by_edges ? 0 : ~std::uint64_t{0};
  BoxPairBlock& b = queue.block;
  b.half_A[lane] = A.shape.parameters.data();
  b.half_B[lane] = B.shape.parameters.data();
  b.X_WA[lane] = numbers_of(A.X_WB);
  b.X_WB[lane] = numbers_of(B.X_WB);
  b.margin[lane] = margin + foresight;
  b.last_set[lane] = static_cast<double>(choice & kSetOfChoice);
  b.last_faces[lane] = static_cast<double>(choice >> kBoxCandidates);
  b.met_by_edges[lane] = static_cast<double>(met_by_edges);
  if (queue.waiting == kBoxLanes) separate(queue);
}

void BoxBatch::finish() {
  for (Queue& queue : queues_) {
    if (queue.waiting > 0) separate(queue);
  }
  if (facing_ > 0) clip();
}

void BoxBatch::separate(Queue& queue) {
  BoxPairBlock& block = queue.block;
  fill_up(block, queue.waiting, kernels_.lanes);
  kernels_.separate(block, queue.waiting);
  const int pairs = std::exchange(queue.waiting, 0);
  std::array<int, kBoxLanes> near;
  std::size_t count = 0;
  for (int lane = 0; lane < pairs; ++lane) {
    const Waiting& pair = queue.pairs[static_cast<std::size_t>(lane)];
    const double beyond = separation_beyond(block, lane, pair.margin);
    if (beyond > pair.margin || beyond != beyond) {
      made_.take(pair.key, apart(beyond));
    } else {
      near[count++] = lane;
    }
  }
  const std::span<const int> lanes(near.data(), count);
  // As they are, if few lanes are worked on in vain; else with the next ones.
  if (pairs - static_cast<int>(count) <= kernels_.lanes / 4) return clip(block, queue.pairs, lanes);
  for (const int lane : lanes) wait(queue, lane);
}

void BoxBatch::wait(const Queue& queue, int lane) {
  copy_lane(queue.block, lane, face_block_, facing_);
  faces_[static_cast<std::size_t>(facing_++)] = queue.pairs[static_cast<std::size_t>(lane)];
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
  for (const int lane : lanes) {
    const Waiting& pair = pairs[static_cast<std::size_t>(lane)];
    Manifold& manifold = made_.room(pair.key);
    manifold.clear();
    Facing{pair, block, lane}.meet(manifold);
    made_.take(pair.key, manifold);
  }
}

Manifold box_box(const Collider& A, const Collider& B, double margin) {
  struct Only final : MadeManifolds {
    Manifold& room(std::size_t) override { return manifold; }
    void take(std::size_t, const Manifold& made) override { manifold = made; }
    Manifold manifold;
  } only;
  BoxBatch batch(only, 1);
  batch.add(0, A, B, margin);
  batch.finish();
  return only.manifold;
}

}  // namespace cradle
