// Two boxes, many pairs side by side, for the kernels' files alone (see lanes.h).
//
// Separating axes: sources and symbols as in box_box.cpp. An edge axis a_i x b_j has length l; s
// |s| / l^2 sorts axes as s / l does, and takes no roots; nor quotients, as fractions are compared
// crosswise.
//
// Face contact: the part of one face that lies over the other. Both are convex quadrilaterals in
// the plane, so the corners of their intersection are of three kinds: corners of the incident face,
// its edges cut by a side (both by Liang and Barsky, "A new concept and method for line clipping",
// 1984, on each edge by itself), and corners of the reference face inside the incident one (by a
// 2x2 solve). In F, z of a point is its separation, and x, y its place in the face. Where we differ
// from Sutherland and Hodgman (1974): no polygon is carried from side to side, so each point's name
// comes from what it is and not from how it was made, and pairs need no branches; and a corner up
// to `slack` outside counts as inside, so that flush stacks keep their points and names.
//
// Which four of more points: box_choice.h. Whether the face counts: box_verdict.h.
//
// Loops that are marked stay loops else, and keep all that they index in memory: 5 ns a pair.
// Cost, see box_box.cpp.
#pragma once

#include "server/collision/box_choice.h"
#include "server/collision/box_overlaps.h"
#include "server/collision/box_verdict.h"
#include "server/collision/lanes.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

template <class V, int n>
CRADLE_LANES void load_all(V (&to)[n], const double (&rows)[n][kBoxLanes], int lane) {
  for (int k = 0; k < n; ++k) to[k] = load<V>(rows[k] + lane);
}

/// The first numbers of what each lane points to.
template <class V, int n>
CRADLE_LANES void gather_all(V (&to)[n], const double* const* lanes) {
  for (int k = 0; k < n; ++k) {
    if constexpr (kLanes<V> == 1) {
      to[k] = lanes[0][k];
    } else {
      V v{};
      for (int l = 0; l < kLanes<V>; ++l) v[l] = lanes[l][k];
      to[k] = v;
    }
  }
}

// Separating axes.

template <class V>
struct BestFace {
  V s, axis, next;
};

/// `t`: the other centre; `reach`: what both boxes have along the axes.
template <class V>
CRADLE_LANES BestFace<V> best_face(const V* t, const V* reach) {
  V s[3];
  for (int k = 0; k < 3; ++k) s[k] = size_of<V>(t[k]) - reach[k];
  BestFace<V> best{s[0], V{}, larger<V>(s[1], s[2])};
  V size = size_of<V>(t[0]);
  for (int k = 1; k < 3; ++k) {
    const auto is_better = s[k] > best.s;
    best.next = is_better ? larger<V>(s[0], s[3 - k]) : best.next;
    best.axis = is_better ? fill<V>(k) : best.axis;
    size = is_better ? size_of<V>(t[k]) : size;
    best.s = is_better ? s[k] : best.s;
  }
  best.next = larger<V>(best.next, best.s - 2 * size);
  return best;
}

template <class V>
struct BestEdges {
  V square, length2;  // s |s| and l^2
  V edge;
};

template <class V>
CRADLE_LANES void try_edges(int i, int j, const V* h_A, const V* h_B, const V* C, const V* size_C,
                            const V* t, BestEdges<V>& best) {
  const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
  const V y = C[3 * j + i1], z = C[3 * j + i2];
  const V l2 = y * y + z * z;
  const V s = size_of<V>(t[i2] * y - t[i1] * z) - h_A[i1] * size_C[3 * j + i2] -
              h_A[i2] * size_C[3 * j + i1] - h_B[j1] * size_C[3 * j2 + i] -
              h_B[j2] * size_C[3 * j1 + i];
  const V least = fill<V>(kTolerances.crossing_sine2);
  const V s2 = s * size_of<V>(s);
  const auto is_better = (l2 >= least) & (s2 * best.length2 > best.square * l2);
  best.square = is_better ? s2 : best.square;
  best.length2 = is_better ? l2 : best.length2;
  best.edge = is_better ? fill<V>(3 * i + j) : best.edge;
}

/// The best edges, and whether they, or which box's face, the boxes meet by.
template <class V>
CRADLE_LANES void weigh_edges(const V* h_A, const V* h_B, const V* C, const V* size_C, const V* t,
                              const BestFace<V>& A, const BestFace<V>& B, BoxPairBlock& b,
                              int lane) {
  BestEdges<V> best{fill<V>(-1), V{}, V{}};  // at first s is minus infinity
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) try_edges<V>(i, j, h_A, h_B, C, size_C, t, best);
  }
  const auto has_edges = best.length2 > V{};
  const V s = root<V>(size_of<V>(best.square) / (has_edges ? best.length2 : fill<V>(1)));
  const V signed_s = best.square < V{} ? -s : s;
  store(b.s_edge + lane, has_edges ? signed_s : -endless<V>());
  store(b.edge + lane, best.edge);

  const V least_A = smaller<V>(smaller<V>(h_A[0], h_A[1]), h_A[2]);
  const V least_B = smaller<V>(smaller<V>(h_B[0], h_B[1]), h_B[2]);
  const V scale =
      smaller<V>(smaller<V>(least_A, least_B) / kTolerances.nominal_half_extent_m, fill<V>(1));
  const V bias = scale * kTolerances.reference_bias_m, face = larger<V>(B.s, A.s);
  store(b.slack + lane, scale * kTolerances.clip_slack_m);
  store(b.bias + lane, bias);
  store(b.least_edge + lane, face + (scale * kTolerances.edge_bias_m +
                                     kTolerances.edge_bias_per_depth * larger<V>(-face, V{})));
  store(b.on_A + lane, B.s <= A.s + bias ? fill<V>(1) : V{});
}

template <class V>
CRADLE_LANES void separate_lanes(BoxPairBlock& b, int lane) {
  V h_A[3], h_B[3], X_WA[12], X_WB[12], d[3];
  gather_all(h_A, b.half_A + lane);
  gather_all(h_B, b.half_B + lane);
  load_columns<12>(X_WA, b.X_WA + lane);
  load_columns<12>(X_WB, b.X_WB + lane);
  const V *const R_A = X_WA + 3, *const R_B = X_WB + 3;
  for (int k = 0; k < 3; ++k) {
    d[k] = X_WB[k] - X_WA[k];
    store(b.h_A[k] + lane, h_A[k]);
    store(b.h_B[k] + lane, h_B[k]);
  }
  V C[9], size_C[9], t[3], u[3], reach_A[3], reach_B[3];
  for (int i = 0; i < 3; ++i) {
    t[i] = R_A[3 * i] * d[0] + R_A[3 * i + 1] * d[1] + R_A[3 * i + 2] * d[2];
    store(b.t[i] + lane, t[i]);
    for (int j = 0; j < 3; ++j) {
      const int at = 3 * j + i;
      C[at] = R_A[3 * i] * R_B[3 * j] + R_A[3 * i + 1] * R_B[3 * j + 1] +
              R_A[3 * i + 2] * R_B[3 * j + 2];
      size_C[at] = size_of<V>(C[at]);
      store(b.C[at] + lane, C[at]);
    }
  }
  for (int k = 0; k < 3; ++k) {
    u[k] = C[3 * k] * t[0] + C[3 * k + 1] * t[1] + C[3 * k + 2] * t[2];
    store(b.u[k] + lane, u[k]);
    reach_A[k] = h_A[k] + size_C[k] * h_B[0] + size_C[3 + k] * h_B[1] + size_C[6 + k] * h_B[2];
    reach_B[k] =
        h_B[k] + size_C[3 * k] * h_A[0] + size_C[3 * k + 1] * h_A[1] + size_C[3 * k + 2] * h_A[2];
  }
  const BestFace<V> A = best_face<V>(t, reach_A), B = best_face<V>(u, reach_B);
  store(b.s_A + lane, A.s);
  store(b.axis_A + lane, A.axis);
  store(b.next_A + lane, A.next);
  store(b.s_B + lane, B.s);
  store(b.axis_B + lane, B.axis);
  store(b.next_B + lane, B.next);
  const V margin = load<V>(b.margin + lane);
  if (!any<V>((A.s <= margin) & (B.s <= margin))) return;
  weigh_edges<V>(h_A, h_B, C, size_C, t, A, B, b, lane);
}

// Face contact, in F.

template <class V>
CRADLE_LANES V of_axis(const V& axis, const V& x, const V& y, const V& z) {
  const V first = axis == V{} ? x : y;
  return axis == fill<V>(2) ? z : first;
}
/// The parts along the two axes that follow, and along the axis itself.
template <class V>
CRADLE_LANES Triple<V> from_axis(const V& axis, const Triple<V>& v) {
  return {of_axis<V>(axis, v.y, v.z, v.x), of_axis<V>(axis, v.z, v.x, v.y),
          of_axis<V>(axis, v.x, v.y, v.z)};
}

/// The reference face, and the incident one, which looks most against its normal. Edges of this:
/// from each corner to the next, -2e, -2f, 2e, 2f.
template <class V>
struct FacePair {
  V half_x, half_y;  // of the reference face
  Triple<V> middle, e, f;
  V length_e, length_f;
  V slope2;  // of the incident plane, m / m, squared
  Triple<V> corners[4];
  V outside[4][4];             // of each corner, how far, by side x+, x-, y+, y-
  V per_x[2], per_y[2];        // of e and f: 1 / twice x, y
  V slope2_x[2], slope2_y[2];  // of e and f, m / m: what z changes by where x, y does; squared
};

/// Lets them face each other, and sets what does not depend on where they meet.
template <class V>
CRADLE_LANES void face_each_other(BoxFaceBlock& b, int lane, FacePair<V>& faces) {
  V h_A[3], h_B[3], C[9], t[3], u[3];
  load_all(h_A, b.h_A, lane);
  load_all(h_B, b.h_B, lane);
  load_all(C, b.C, lane);
  load_all(t, b.t, lane);
  load_all(u, b.u, lane);
  const auto on_A = load<V>(b.on_A + lane) > V{};
  const V axis_A = load<V>(b.axis_A + lane), axis_B = load<V>(b.axis_B + lane);
  const V axis = on_A ? axis_A : axis_B, one = fill<V>(1);
  const auto along = [&](const V* of_A, const V* of_B) CRADLE_LAMBDA {
    return from_axis<V>(axis, select(on_A, Triple<V>{of_A[0], of_A[1], of_A[2]},
                                     Triple<V>{of_B[0], of_B[1], of_B[2]}));
  };
  const Triple<V> h = along(h_A, h_B);
  const V back[3] = {-u[0], -u[1], -u[2]};
  const Triple<V> to = along(t, back);
  Triple<V> axes[3];  // of the incident box
  for (int k = 0; k < 3; ++k) {
    const V row[3] = {C[k], C[3 + k], C[6 + k]};
    axes[k] = along(C + 3 * k, row);
  }
  const V size_x = size_of<V>(axes[0].z), size_y = size_of<V>(axes[1].z),
          size_z = size_of<V>(axes[2].z);
  const V x_or_z = size_x >= size_z ? V{} : fill<V>(2),
          y_or_z = size_y >= size_z ? one : fill<V>(2);
  const V incident = size_x >= size_y ? x_or_z : y_or_z;
  const auto of_incident = [&](const V& x, const V& y, const V& z) CRADLE_LAMBDA {
    return from_axis<V>(incident, {x, y, z});
  };
  const Triple<V> x = of_incident(axes[0].x, axes[1].x, axes[2].x);
  const Triple<V> y = of_incident(axes[0].y, axes[1].y, axes[2].y);
  const Triple<V> z = of_incident(axes[0].z, axes[1].z, axes[2].z);
  const Triple<V> h_i =
      of_incident(on_A ? h_B[0] : h_A[0], on_A ? h_B[1] : h_A[1], on_A ? h_B[2] : h_A[2]);
  const V turn = to.z >= V{} ? one : -one;
  const auto is_upper = turn * z.z < V{};
  const V out = is_upper ? h_i.z : -h_i.z;
  faces.half_x = h.x;
  faces.half_y = h.y;
  faces.middle = {to.x + x.z * out, to.y + y.z * out, turn * (to.z + z.z * out) - h.z};
  faces.e = {x.x * h_i.x, y.x * h_i.x, turn * z.x * h_i.x};
  faces.f = {x.y * h_i.y, y.y * h_i.y, turn * z.y * h_i.y};
  faces.length_e = h_i.x;
  faces.length_f = h_i.y;
  faces.slope2 = 1 / (z.z * z.z) - 1;
  store(b.reference + lane, 2 * axis + (to.z >= V{} ? one : V{}));
  store(b.incident + lane, 2 * incident + (is_upper ? one : V{}));
  store(b.faces + lane, 1 + 2 * axis + (to.z >= V{} ? one : V{}) +
                            6 * (2 * incident + (is_upper ? one : V{})) +
                            (on_A ? fill<V>(36) : V{}));

  constexpr double kSine = 0.01414;  // where faces are flush no more
  const V most_A = larger<V>(larger<V>(h_A[0], h_A[1]), h_A[2]);
  const V most_B = larger<V>(larger<V>(h_B[0], h_B[1]), h_B[2]);
  store(b.until_tilted + lane,
        (size_of<V>(z.z) - kTolerances.flush_cosine) / kSine * smaller<V>(most_A, most_B));
  const V s_A = load<V>(b.s_A + lane), s_B = load<V>(b.s_B + lane);
  const V next_A = load<V>(b.next_A + lane), next_B = load<V>(b.next_B + lane);
  const V bias = load<V>(b.bias + lane);
  const V s = on_A ? s_A : s_B;
  const V over_other = s - (on_A ? s_B : s_A) + (on_A ? bias : -bias);
  const V over_edges = load<V>(b.least_edge + lane) - load<V>(b.s_edge + lane);
  store(b.s + lane, s);
  store(b.lead + lane,
        smaller<V>(over_edges, smaller<V>(over_other, s - (on_A ? next_A : next_B))));
}

template <class V>
CRADLE_LANES void list_corners(FacePair<V>& faces) {
  for (int k = 0; k < 4; ++k) {
    const Triple<V> p = faces.middle + kSignX[k] * faces.e + kSignY[k] * faces.f;
    faces.corners[k] = p;
    faces.outside[k][0] = p.x - faces.half_x;
    faces.outside[k][1] = -p.x - faces.half_x;
    faces.outside[k][2] = p.y - faces.half_y;
    faces.outside[k][3] = -p.y - faces.half_y;
  }
  for (int k = 0; k < 2; ++k) {
    const Triple<V>& side = k == 0 ? faces.e : faces.f;
    faces.per_x[k] = 0.5 / side.x;
    faces.per_y[k] = 0.5 / side.y;
    const V by_x = 2 * side.z * faces.per_x[k], by_y = 2 * side.z * faces.per_y[k];
    faces.slope2_x[k] = by_x * by_x;
    faces.slope2_y[k] = by_y * by_y;
  }
}

/// Sets where the edge from corner `k` to the next enters the reference face, and where it leaves
/// it. Ends that are inside are set as corners: each by the edge that starts there. `steep2`: what
/// a separation changes by at most where reference edges cross this one.
template <class V>
CRADLE_LANES void clip_edge(int k, const FacePair<V>& faces, const V& slack, BoxFaceBlock& b,
                            int lane, FacePoints<V>& points, V& steep2) {
  const int next = (k + 1) % 4;
  const Triple<V>&p0 = faces.corners[k], &p1 = faces.corners[next];
  const V one = fill<V>(1), none{};
  V enter = none, leave = one, misses_by = -endless<V>();
  V enter_side = fill<V>(kNoSide), leave_side = enter_side;
  for (int side = 0; side < 4; ++side) {
    const V d0 = faces.outside[k][side], d1 = faces.outside[next][side];
    const V per = side < 2 ? faces.per_x[k % 2] : faces.per_y[k % 2];  // 1 / |d0 - d1|, with a sign
    const V fraction = (side % 2 == 0) == (k < 2) ? d0 * per : -d0 * per;
    const V low = smaller<V>(d0, d1), high = larger<V>(d0, d1);
    misses_by = larger<V>(misses_by, low);
    const V in = d0 > slack ? fraction : none, out = d1 > slack ? fraction : one;
    enter_side = in > enter ? fill<V>(1 + side) : enter_side;
    leave_side = out < leave ? fill<V>(1 + side) : leave_side;
    enter = larger<V>(in, enter);
    leave = smaller<V>(out, leave);
    const V slope2 = side < 2 ? faces.slope2_x[k % 2] : faces.slope2_y[k % 2];
    const V reached = high > slack ? slope2 : none;
    steep2 = larger<V>(low > slack ? none : reached, steep2);
  }
  enter = smaller<V>(enter, one);
  leave = larger<V>(leave, none);
  const V meets = misses_by > slack ? none : one;
  const V corner_inside =
      smaller<V>(faces.half_x - size_of<V>(p0.x), faces.half_y - size_of<V>(p0.y));
  const V enters = enter < one ? meets : none, leaves = leave < one ? meets : none;
  points.set(2 * k, p0 + enter * (p1 - p0), enter > leave ? none : enters,
             enter > none ? none : corner_inside);
  points.set(2 * k + 1, p0 + leave * (p1 - p0), enter < leave ? leaves : none, none);
  store(b.side[2 * k] + lane, enter_side);
  store(b.side[2 * k + 1] + lane, leave_side);
}

/// Sets the corners of the reference face that are inside the incident face, or up to the slack
/// outside (else boxes whose corners only just reach over each other lose all points at once), but
/// for those with a candidate within the slack: so a flush stack has four candidates, and need not
/// be reduced.
template <class V>
CRADLE_LANES void set_reference_corners(BoxFaceBlock& b, int lane, const FacePair<V>& faces,
                                        const V& slack, FacePoints<V>& points) {
  const Triple<V>&c = faces.middle, &e = faces.e, &f = faces.f;
  const V inverse = 1 / (e.x * f.y - e.y * f.x);
#pragma GCC unroll 4
  for (int k = 0; k < 4; ++k) {
    const V x = kSignX[k] * faces.half_x, y = kSignY[k] * faces.half_y;
    const V along_e = ((x - c.x) * f.y - (y - c.y) * f.x) * inverse;
    const V along_f = ((y - c.y) * e.x - (x - c.x) * e.y) * inverse;
    const V inside = smaller<V>((1 - size_of<V>(along_e)) * faces.length_e,
                                (1 - size_of<V>(along_f)) * faces.length_f);
    V is_there = inside > -slack ? fill<V>(1) : V{};
    // The others are on the sides of the incident face, whose corners are at least 60 degrees in
    // the plane: this far inside, none is near.
    if (any<V>(size_of<V>(inside) < 2 * slack)) {
      for (int other = 0; other < 8 + k; ++other) {
        const V far = larger<V>(size_of<V>(points.x[other] - x), size_of<V>(points.y[other] - y));
        is_there = far <= slack ? is_there * (1 - points.used[other]) : is_there;
      }
    }
    points.set(8 + k, {x, y, c.z + along_e * e.z + along_f * f.z}, is_there, inside);
    store(b.side[8 + k] + lane, fill<V>(5 + k));
  }
}

template <class V>
CRADLE_LANES void clip_lanes(BoxFaceBlock& b, int lane) {
  const V slack = load<V>(b.slack + lane), margin = load<V>(b.margin + lane);
  FacePair<V> faces;
  face_each_other<V>(b, lane, faces);
  list_corners<V>(faces);
  FacePoints<V> points;
  points.inside = -endless<V>();
  V steep2 = faces.slope2;
#pragma GCC unroll 4
  for (int k = 0; k < 4; ++k) {
    clip_edge<V>(k, faces, slack, b, lane, points, steep2);
  }
  set_reference_corners<V>(b, lane, faces, slack, points);
  V count{}, set{};
#pragma GCC unroll 12
  for (int k = 0; k < kBoxCandidates; ++k) {
    points.used[k] = points.z[k] <= margin ? points.used[k] : V{};
    count = count + points.used[k];
    set = set + (1 << k) * points.used[k];
    store(b.x[k] + lane, points.x[k]);
    store(b.y[k] + lane, points.y[k]);
    store(b.z[k] + lane, points.z[k]);  // before any is chosen
  }
  constexpr double kLevel =
      5e-5;  // raises no point by more than it may be off, however far it slides
  // What a separation changes by at most as features slide, m / m: corners of the reference face
  // over the incident plane, and its edges over the sides.
  const V steepness = faces.slope2 < fill<V>(kLevel * kLevel) ? V{} : root<V>(steep2);
  store(b.bears + lane, smaller<V>(kTolerances.kept_slide_m / steepness, points.inside + slack));
  const auto are_many = count > fill<V>(4);
  if (any<V>(are_many))
    set = are_many ? choose_four_again<V>(points, are_many, b, lane, slack) : set;
  store(b.set + lane, set);
  weigh_face<V>(b, lane, faces.half_x, faces.half_y, set);
}

template <class V>
struct BoxPasses {
  static void separate(BoxPairBlock& b, int pairs) {
    for (int lane = 0; lane < pairs; lane += kLanes<V>) separate_lanes<V>(b, lane);
  }
  static void clip(BoxFaceBlock& b, int pairs) {
    for (int lane = 0; lane < pairs; lane += kLanes<V>) clip_lanes<V>(b, lane);
  }
};

template <class V>
constexpr BoxKernels box_kernels() {
  return {kLanes<V>, BoxPasses<V>::separate, BoxPasses<V>::clip,
          find_overlaps<typename FloatsOf<V>::Type>};
}

}  // namespace
}  // namespace cradle
