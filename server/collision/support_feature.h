/// The part of a convex shape that looks along a direction: a face, an edge or a point. Contacts
/// are where two such parts lie over each other. Private to this folder.
#pragma once

#include <array>
#include <cstdint>

#include "server/collision/convex_shape.h"

namespace cradle {

/// Of the core. m, in the frame of the shape, until someone moves it.
struct SupportFeature {
  static constexpr int kCornersMax = 24;

  int count = 0;  ///< 1: a point; 2: an edge; more: a face, counter-clockwise as seen from outside
  std::array<Vector, kCornersMax> corners;
  std::array<std::uint32_t, kCornersMax> corner_names;  ///< 15 bits
  std::array<std::uint32_t, kCornersMax> edge_names;    ///< from a corner to the next; 15 bits
  Vector normal = Vector::Zero();                       ///< of a face: unit, outward
  /// Of an edge, at its two ends: the radius of what it is a line of, m, so that beside the line
  /// the surface falls away as a circle does; 0: sharp.
  std::array<double, 2> roundness = {0, 0};
  bool is_round = false;  ///< a face whose edges are chords of a disc: corners k and k + 4 opposite
  bool is_level = false;  ///< a disc of which no point is farthest: its corners may be any

  void add(const Vector& p, std::uint32_t corner, std::uint32_t edge) {
    const auto k = static_cast<std::size_t>(count++);
    corners[k] = p;
    corner_names[k] = corner & 0x7fff;
    edge_names[k] = edge & 0x7fff;
  }
};

/// What of the shape looks most along the unit vector `d`. The core's farthest point along d is one
/// of the corners; where a face or edge is farthest as a whole, it is that. `hint` as for support.
/// `farthest`: the vertex of a hull that is farthest along d, if not below 0.
SupportFeature support_feature(const ConvexShape& shape, const Vector& d, std::int32_t& hint,
                               std::int32_t farthest = -1);

}  // namespace cradle
