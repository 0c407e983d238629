// The closest points of two edges after Ericson, "Real-Time Collision Detection" (2005), 5.1.9.
// Symbols as in box_box.cpp. Which axis, edge and side it is is chance: numbers, not branches.
#include "server/collision/box_edges.h"

#include "server/collision/box_faces.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

/// An edge of a box: the one along `axis` that lies farthest in the direction `d`.
struct Edge {
  Vector middle;
  std::uint32_t name = 0;

  Edge(const Vector& half_extents, int axis, const Vector& d) : middle(half_extents) {
    std::uint32_t bits = 0;
    for (int k = 0; k < 3; ++k) {
      middle[k] = toward(d[k], half_extents[k]);
      bits |= std::uint32_t{!(d[k] < 0)} << k;
    }
    middle[axis] = 0;
    name = name_of(bits & ~(1u << axis), bits | 1u << axis);
  }
};

}  // namespace

void meet_edges(const BoxAxes& boxes, const Pose& X_WA, Manifold& manifold) {
  const BoxAxes::Edges& axis = boxes.edges;
  Vector a = Vector::Zero();
  a[axis.i] = 1;
  const Vector b = boxes.C.col(axis.j), across = a.cross(b);
  const Vector n = toward(across.dot(boxes.t), 1) * across.normalized();
  const Edge edge_A(boxes.h_A, axis.i, n);
  const Edge edge_B(boxes.h_B, axis.j, -(boxes.C.transpose() * n));

  const Vector middle_B = boxes.t + boxes.C * edge_B.middle;
  const Vector d = middle_B - edge_A.middle;
  const double c = a.dot(b), a_d = a.dot(d), b_d = b.dot(d);
  const double end_A = boxes.h_A[axis.i], end_B = boxes.h_B[axis.j];
  double along_A = within(-end_A, (a_d - c * b_d) / (1 - c * c), end_A);
  const double along_B = within(-end_B, c * along_A - b_d, end_B);
  along_A = within(-end_A, a_d + c * along_B, end_A);
  const Vector p = edge_A.middle + a * along_A;
  const Vector q = middle_B + b * along_B;

  manifold.count = 0;
  manifold.lead = 0;
  manifold.choice = 0;
  if (axis.s > 0 && (q - p).norm() > axis.s + kTolerances.tie_m) return;
  manifold.normal_W = X_WA.R * n;
  manifold.count = 1;
  manifold.lead = -1;  // turns with both boxes, the more the less the edges cross
  manifold.points[0] = {X_WA.x + X_WA.R * (0.5 * (p + q)), axis.s,
                        kNoFace | edge_A.name << 6 | edge_B.name};
}

}  // namespace cradle
