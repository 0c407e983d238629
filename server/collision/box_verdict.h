// Whether the face that boxes meet by counts, for the kernels' files alone (see lanes.h). What that
// is for: box_facing.cpp.
#pragma once

#include "server/collision/box_choice.h"
#include "server/collision/lanes.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

/// Of the points in a set of candidates (a sum of 2^c), the deepest: the first, of several.
template <class V>
struct Deepest {
  V x, y, z;
};

template <class V>
CRADLE_LANES Deepest<V> deepest_of(const BoxFaceBlock& b, int lane, const V& set) {
  Deepest<V> deepest{{}, {}, endless<V>()};
  V rest = set;
#pragma GCC unroll 12
  for (int c = kBoxCandidates - 1; c >= 0; --c) {
    const auto is_in = take_out<V>(c, rest);
    const V x = load<V>(b.x[c] + lane), y = load<V>(b.y[c] + lane), z = load<V>(b.z[c] + lane);
    const auto is_deeper = is_in & (z <= deepest.z);
    deepest.x = is_deeper ? x : deepest.x;
    deepest.y = is_deeper ? y : deepest.y;
    deepest.z = is_deeper ? z : deepest.z;
  }
  return deepest;
}

/// A face counts if what reaches deepest is over it; else another direction is better. Sets whether
/// the boxes are apart, how far the deepest point is from their separation along the face's normal,
/// whether the face counts, unless it leans, and how long such a contact is as it is. `half_x`,
/// `half_y`: of the reference face.
template <class V>
CRADLE_LANES void weigh_face(BoxFaceBlock& b, int lane, const V& half_x, const V& half_y,
                             const V& set) {
  constexpr double kTie = kTolerances.tie_m;
  const V one = fill<V>(1), none{};
  const V s = load<V>(b.s + lane), s_edge = load<V>(b.s_edge + lane);
  const V slack = load<V>(b.slack + lane), until_tilted = load<V>(b.until_tilted + lane);
  const Deepest<V> point = deepest_of<V>(b, lane, set);
  const V missed = point.z - s;
  const V inside = smaller<V>(half_x - size_of<V>(point.x), half_y - size_of<V>(point.y));
  const auto is_flush = until_tilted > none, meets = missed <= fill<V>(kTie);

  // No face parts what edges do if they overlap behind it. And unless they are flush, the face is
  // nearest if and only if the point is over it. But within the slack all stays as it is, so that
  // what lies on an edge beside a face does not change between them from tick to tick.
  const V of_faces = larger<V>(load<V>(b.s_A + lane), load<V>(b.s_B + lane));
  const auto is_apart = larger<V>(of_faces, s_edge) > none;
  const auto is_nearest =
      (s > -slack) & (is_flush | (s <= slack) | (meets & (inside >= fill<V>(-kTie))));
  const auto stays_by_edges = (load<V>(b.met_by_edges + lane) > none) & (s_edge > -slack);
  const V allowed = slack + kTolerances.edge_bias_per_depth * larger<V>(-s, none);
  const V within = missed <= (stays_by_edges ? fill<V>(kTie) : allowed) ? one : none;
  const V nearest = is_nearest ? within : none;
  store(b.apart + lane, is_apart ? one : none);
  store(b.missed + lane, missed);
  store(b.counts + lane, is_apart ? nearest : within);

  // The deepest point lower by what is missed, others the less, the more they are above it: else
  // separations would jump where another becomes the deepest.
  const V per_near = one / (kTolerances.as_deep * slack);
#pragma GCC unroll 12
  for (int c = 0; c < kBoxCandidates; ++c) {
    const V z = load<V>(b.z[c] + lane);
    store(b.lowered[c] + lane, z - missed * larger<V>(one - (z - point.z) * per_near, none));
  }

  // No other axis is better, and what touches is over the face.
  const V bears = smaller<V>(load<V>(b.lead + lane), load<V>(b.bears + lane));
  const V while_flush = smaller<V>(smaller<V>(bears, slack - missed), until_tilted);
  const V while_over = meets ? inside : -one;
  const V until_apart =  // by edges
      s > none ? endless<V>() : larger<V>(s + slack, -s_edge);
  store(b.stays + lane,
        is_flush ? while_flush : smaller<V>(smaller<V>(bears, while_over), until_apart));
}

}  // namespace
}  // namespace cradle
