#include "server/collision/polytope_faces.h"

#include <numbers>

namespace cradle {
namespace {

/// Of all boxes. Bit k of a vertex's number tells on which side of axis k it is; face 2 k is below
/// along that axis, 2 k + 1 above.
struct BoxTopology {
  std::array<std::int32_t, 24> loops{}, beyond{}, neighbours{};
  std::array<std::int32_t, 7> first{};
  std::array<std::int32_t, 9> around_first{};
  std::array<Vector, 6> normals;
  std::array<double, 6> corner_cosines, edge_cosines;

  BoxTopology() {
    corner_cosines.fill(std::numbers::inv_sqrt3);
    edge_cosines.fill(0.5 * std::numbers::sqrt2);
    for (std::size_t f = 0; f < 6; ++f) set_face(f);
    for (std::size_t f = 0; f < 7; ++f) first[f] = static_cast<std::int32_t>(4 * f);
    for (std::size_t v = 0; v < 8; ++v) {
      for (std::size_t k = 0; k < 3; ++k) {
        neighbours[3 * v + k] = static_cast<std::int32_t>(v ^ (std::size_t{1} << k));
      }
    }
    for (std::size_t v = 0; v < 9; ++v) around_first[v] = static_cast<std::int32_t>(3 * v);
  }

 private:
  void set_face(std::size_t f) {
    const std::size_t axis = f / 2, upper = f % 2;
    // Counter-clockwise as seen from outside.
    const std::size_t x = (axis + (upper == 1 ? 1 : 2)) % 3, y = 3 - axis - x;
    normals[f] = Vector::Unit(static_cast<Eigen::Index>(axis)) * (upper == 1 ? 1.0 : -1.0);
    const std::array<std::size_t, 4> right = {1, 0, 0, 1}, up = {1, 1, 0, 0};
    const std::array<std::size_t, 4> faces_beyond = {2 * y + 1, 2 * x, 2 * y, 2 * x + 1};
    for (std::size_t k = 0; k < 4; ++k) {
      loops[4 * f + k] = static_cast<std::int32_t>(upper << axis | right[k] << x | up[k] << y);
      beyond[4 * f + k] = static_cast<std::int32_t>(faces_beyond[k]);
    }
  }
};

}  // namespace

PolytopeFaces::PolytopeFaces(const ConvexShape& shape) {
  if (shape.hull != nullptr) {
    const ConvexHull& hull = *shape.hull;
    vertices = hull.vertices, normals = hull.normals, offsets = hull.offsets;
    loops_ = hull.loops, beyond_ = hull.beyond, first_ = hull.first;
    neighbours_ = hull.neighbours, around_first_ = hull.around_first;
    corner_cosines = hull.corner_cosines, edge_cosines = hull.edge_cosines;
    return;
  }
  static const BoxTopology kBox;
  const Vector& h = shape.size;
  for (std::size_t v = 0; v < 8; ++v) {
    box_vertices_[v] = {v & 1 ? h.x() : -h.x(), v & 2 ? h.y() : -h.y(), v & 4 ? h.z() : -h.z()};
  }
  box_offsets_ = {h.x(), h.x(), h.y(), h.y(), h.z(), h.z()};
  vertices = box_vertices_, normals = kBox.normals, offsets = box_offsets_;
  loops_ = kBox.loops, beyond_ = kBox.beyond, first_ = kBox.first;
  neighbours_ = kBox.neighbours, around_first_ = kBox.around_first;
  corner_cosines = kBox.corner_cosines, edge_cosines = kBox.edge_cosines;
}

}  // namespace cradle
