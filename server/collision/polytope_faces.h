/// A box or hull as faces, edges and vertices. Private to this folder.
#pragma once

#include <array>
#include <span>

#include "server/collision/convex_shape.h"

namespace cradle {

/// Everything in the frame of the shape, m; the shape must last. Numbers as in ConvexHull.
class PolytopeFaces {
 public:
  explicit PolytopeFaces(const ConvexShape& shape);
  PolytopeFaces(const PolytopeFaces&) = delete;
  PolytopeFaces& operator=(const PolytopeFaces&) = delete;

  std::span<const Vector> vertices, normals;
  std::span<const double> offsets, corner_cosines, edge_cosines;

  /// Corner after corner of a face, counter-clockwise, and the face beyond the edge from each.
  std::span<const std::int32_t> corners(std::size_t face) const { return of_face(loops_, face); }
  std::span<const std::int32_t> beyond(std::size_t face) const { return of_face(beyond_, face); }
  /// Of a vertex, those at the other ends of its edges.
  std::span<const std::int32_t> neighbours(std::size_t vertex) const {
    return part(neighbours_, around_first_, vertex);
  }

 private:
  using Numbers = std::span<const std::int32_t>;
  static Numbers part(Numbers of, Numbers first, std::size_t k) {
    const auto begin = static_cast<std::size_t>(first[k]);
    return of.subspan(begin, static_cast<std::size_t>(first[k + 1]) - begin);
  }
  Numbers of_face(Numbers of, std::size_t face) const { return part(of, first_, face); }

  Numbers loops_, beyond_, first_, neighbours_, around_first_;
  std::array<Vector, 8> box_vertices_;
  std::array<double, 6> box_offsets_;
};

}  // namespace cradle
