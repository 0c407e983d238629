// Box against box: separating axes, then the clipped faces or one point of two edges.
//
// Method: the 15 axes of Gottschalk, Lin and Manocha, "OBBTree" (1996); what the best axis means
// for the contact after Gregorius, "The separating axis test between convex polyhedra" (GDC 2013);
// closest points of two edges after Ericson, "Real-Time Collision Detection" (2005), 5.1.9.
// Symbols, all in A's frame: C axes of B as columns, t from A's centre to B's, h half extents,
// s separation along an axis (negative: overlap), i an axis of A, j of B, n normal from A to B.
// Where we differ: faces are preferred to edges by a lead that grows with the overlap, and A to B
// by a small one (tolerances.h), if what reaches deepest behind the face is over it: then the depth
// is exact along the normal. So the normal is that of the least translation but for ties within
// these leads. Boxes apart whose corners are nearest have no such axis: they are left to the
// search for closest points (least_overlap.cpp).
// Cost at -O3: apart 25 ns, at a corner or edge 90 ns, flush 100 ns, with a turn so that eight
// corners are reduced to four 150 ns; corners apart but within the margin 0.5 us.
#include <algorithm>
#include <cmath>

#include "server/collision/box_faces.h"
#include "server/collision/pair_functions.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// B as A sees it.
struct Boxes {
  Vector h_A, h_B;
  Matrix C, abs_C;
  Vector t;
};

struct FaceAxis {
  double s = 0;
  int axis = 0;
  double next = 0;  ///< the largest s of the other axes, and of this one the other way round
};

struct EdgeAxis {
  double s = -kInfinity;
  int i = 0, j = 0;
  double next = -kInfinity;  ///< the largest s of edges that are just too parallel to count
};

/// `t`: the other centre; `reach`: what both boxes have along the axes.
FaceAxis best_face(const Vector& t, const Vector& reach) {
  const double x = std::abs(t.x()) - reach.x(), y = std::abs(t.y()) - reach.y(),
               z = std::abs(t.z()) - reach.z();
  FaceAxis best{x, 0, std::max(y, z)};
  if (y > best.s) best = {y, 1, std::max(x, z)};
  if (z > best.s) best = {z, 2, std::max(x, y)};
  best.next = std::max(best.next, best.s - 2 * std::abs(t[best.axis]));
  return best;
}

FaceAxis best_face_of_A(const Boxes& b) { return best_face(b.t, b.h_A + b.abs_C * b.h_B); }

FaceAxis best_face_of_B(const Boxes& b) {
  return best_face(b.C.transpose() * b.t, b.h_B + b.abs_C.transpose() * b.h_A);
}

/// The axes a_i x b_j. With l their length, s |s| / l^2 sorts them as s / l does, and takes no
/// roots; nor quotients, as fractions are compared crosswise.
struct EdgeSearch {
  const Boxes& b;
  EdgeAxis best;
  double square = -1, length2 = 0;  // s |s| and l^2 of the best: at first -infinity

  template <int i, int j>
  void try_edges() {
    constexpr int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
    const double y = b.C(i1, j), z = b.C(i2, j);
    const double l2 = y * y + z * z;
    constexpr double kSoonCounts = 0.8;
    if (l2 < kSoonCounts * kTolerances.parallel_sine2) return;
    const double s = std::abs(b.t[i2] * y - b.t[i1] * z) - b.h_A[i1] * b.abs_C(i2, j) -
                     b.h_A[i2] * b.abs_C(i1, j) - b.h_B[j1] * b.abs_C(i, j2) -
                     b.h_B[j2] * b.abs_C(i, j1);
    if (l2 < kTolerances.parallel_sine2) {
      best.next = std::max(best.next, s / std::sqrt(l2));
      return;
    }
    const double s2 = s * std::abs(s);
    if (s2 * length2 > square * l2) square = s2, length2 = l2, best.i = i, best.j = j;
  }
  template <int i>
  void try_all() {
    try_edges<i, 0>();
    try_edges<i, 1>();
    try_edges<i, 2>();
  }
};

/// If all edges are parallel, s is -infinity.
EdgeAxis best_edge_axis(const Boxes& b) {
  EdgeSearch search{b, {}};
  search.try_all<0>();
  search.try_all<1>();
  search.try_all<2>();
  if (search.length2 > 0) {
    const double root = std::sqrt(std::abs(search.square) / search.length2);
    search.best.s = search.square < 0 ? -root : root;
  }
  return search.best;
}

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
Manifold meet_edges(const Boxes& boxes, const EdgeAxis& axis, const Pose& X_WA) {
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

/// 1 for crates, smaller for matchboxes: see tolerances.h.
double length_scale(const Boxes& b) {
  return std::min(1.0,
                  std::min(b.h_A.minCoeff(), b.h_B.minCoeff()) / kTolerances.nominal_half_extent_m);
}

/// Null: the manifold has no point.
ContactPoint* deepest(Manifold& manifold) {
  const auto begin = manifold.points.begin(), end = begin + manifold.count;
  return begin == end ? nullptr
                      : &*std::ranges::min_element(begin, end, {}, &ContactPoint::separation);
}

/// How far a point over a face is from its sides.
double inside_face(const Collider& box, int axis, const Vector& p_W) {
  const Vector p = box.X_WB.R.transpose() * (p_W - box.X_WB.x);
  Vector inside = to_eigen(box.shape.half_extents_m()) - p.cwiseAbs();
  inside[axis] = kInfinity;
  return inside.minCoeff();
}

/// What the boxes may move until faces are flush no more.
double until_tilted(const Boxes& b, double cosine) {
  constexpr double kSine = 0.01414;  // where that is
  return (cosine - kTolerances.flush_cosine) / kSine * std::min(b.h_A.maxCoeff(), b.h_B.maxCoeff());
}

Manifold apart(double separation) {
  Manifold nothing;
  nothing.lead = separation;
  return nothing;
}

}  // namespace

Manifold box_box(const Collider& box_A, const Collider& box_B, double margin) {
  const Pose& X_WA = box_A.X_WB;
  const Pose& X_WB = box_B.X_WB;
  Boxes boxes;
  boxes.h_A = to_eigen(box_A.shape.half_extents_m());
  boxes.h_B = to_eigen(box_B.shape.half_extents_m());
  boxes.t = X_WA.R.transpose() * (X_WB.x - X_WA.x);
  boxes.C = X_WA.R.transpose() * X_WB.R;
  boxes.abs_C = boxes.C.cwiseAbs();

  const FaceAxis face_A = best_face_of_A(boxes);
  if (!(face_A.s <= margin)) return apart(face_A.s);
  const FaceAxis face_B = best_face_of_B(boxes);
  if (!(face_B.s <= margin)) return apart(face_B.s);
  const EdgeAxis edge = best_edge_axis(boxes);
  if (edge.s > margin) return apart(edge.s);

  const double scale = length_scale(boxes);
  const double slack = scale * kTolerances.clip_slack_m;
  const double bias = scale * kTolerances.reference_bias_m;
  const double face = std::max(face_A.s, face_B.s);
  const double edge_bias =
      scale * kTolerances.edge_bias_m + kTolerances.edge_bias_per_depth * std::max(0.0, -face);
  const bool is_apart = std::max(face, edge.s) > 0;
  const auto clip = [&](bool on_A) {
    if (on_A) {
      return clip_faces({boxes.h_A, boxes.h_B, boxes.C, boxes.t, X_WA}, face_A.axis, 0, margin,
                        slack);
    }
    const Matrix C = boxes.C.transpose();
    return clip_faces({boxes.h_B, boxes.h_A, C, -(C * boxes.t), X_WB}, face_B.axis, 1, margin,
                      slack);
  };

  const bool on_A = face_B.s <= face_A.s + bias;
  const double upright =
      on_A ? boxes.abs_C.row(face_A.axis).maxCoeff() : boxes.abs_C.col(face_B.axis).maxCoeff();
  const bool is_flush = upright > kTolerances.flush_cosine;
  double missed = 0;
  // A face counts if what reaches deepest is over it; else another direction is better.
  const auto counts = [&](Manifold& at_face, bool of_A) {
    ContactPoint* const point = deepest(at_face);
    const double s = of_A ? face_A.s : face_B.s;
    missed = point == nullptr ? kInfinity : point->separation - s;
    const double allowed = slack + kTolerances.edge_bias_per_depth * std::max(0.0, -s);
    if (!(missed <= (is_flush || !is_apart ? allowed : kTolerances.tie_m))) return false;
    if (!is_flush) point->separation = s;
    return true;
  };
  const auto meet_faces = [&] {
    Manifold manifold = clip(on_A);
    const double bears = manifold.lead;
    manifold.lead = -1;
    if (counts(manifold, on_A)) {
      const double over_faces = on_A ? std::min(face_A.s - face_A.next, face_A.s + bias - face_B.s)
                                     : std::min(face_B.s - face_B.next, face_B.s - bias - face_A.s);
      const double over_edges = face + edge_bias - std::max(edge.s, edge.next);
      const double stays = is_flush ? std::min(slack - missed, until_tilted(boxes, upright))
                           : missed > kTolerances.tie_m
                               ? -1
                               : inside_face(on_A ? box_A : box_B, on_A ? face_A.axis : face_B.axis,
                                             deepest(manifold)->p_W);
      manifold.lead = std::min({over_faces, over_edges, stays, bears});
      return manifold;
    }
    if (std::abs(face_A.s - face_B.s) <= bias) {
      manifold = clip(!on_A);
      manifold.lead = -1;
      if (counts(manifold, !on_A)) return manifold;
    }
    if (is_apart) {
      manifold = convex_convex(box_A, box_B, margin);
      manifold.lead = manifold.count > 0 ? -1 : margin;
    } else if (edge.s > face) {
      manifold = meet_edges(boxes, edge, X_WA);
    } else {
      manifold = clip(face_B.s <= face_A.s);
      manifold.lead = -1;
    }
    return manifold;
  };

  if (edge.s > face + edge_bias) {
    Manifold manifold = meet_edges(boxes, edge, X_WA);
    return manifold.count > 0 ? manifold : meet_faces();
  }
  return meet_faces();
}

}  // namespace cradle
