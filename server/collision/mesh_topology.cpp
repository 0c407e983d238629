// What contact has to know of a triangle mesh beyond its triangles: normals, neighbours, which
// edges can be felt, and a tree of boxes.
//
// Symbols: n normal of a triangle, e its edge as its corners run, n' the normal of the neighbour
// there. The surface bends away if (n x n') . e > 0.
#include <algorithm>
#include <cmath>
#include <tuple>

#include "server/collision/index.h"
#include "server/collision/stored_geometry.h"
#include "server/collision/surface.h"

namespace cradle {
namespace {

/// Below this height over its longest edge, relative to that, a triangle has no normal of its own:
/// the digits of its corners are used up.
constexpr double kSliver = 1e-6;

/// A side of an edge.
struct Side {
  std::int32_t low, high, triangle;
  std::size_t k;  ///< its corner where the edge begins
};

void find_neighbours(TriangleMesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<std::int32_t>(t), k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  mesh.neighbours.assign(mesh.triangles.size(), {-1, -1, -1});
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    const Side &a = sides[i], &b = sides[i + 1];
    if (a.low != b.low || a.high != b.high) continue;
    mesh.neighbours[index(a.triangle)][a.k] = b.triangle;
    mesh.neighbours[index(b.triangle)][b.k] = a.triangle;
  }
}

std::size_t longest_edge(const TriangleMesh& mesh, const Triangle& t) {
  std::size_t longest = 0;
  double most = -1;
  for (std::size_t k = 0; k < 3; ++k) {
    const double length2 =
        (mesh.vertices[index(t[(k + 1) % 3])] - mesh.vertices[index(t[k])]).squaredNorm();
    if (length2 > most) most = length2, longest = k;
  }
  return longest;
}

void find_normals(TriangleMesh& mesh) {
  mesh.normals.assign(mesh.triangles.size(), Vector::Zero());
  std::vector<std::int32_t> slivers;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& corners = mesh.triangles[t];
    const std::size_t k = longest_edge(mesh, corners);
    const Vector& p = mesh.vertices[index(corners[k])];
    const Vector edge = mesh.vertices[index(corners[(k + 1) % 3])] - p;
    const Vector area = edge.cross(mesh.vertices[index(corners[(k + 2) % 3])] - p);
    const double size = area.norm();
    if (size > kSliver * edge.squaredNorm()) {
      mesh.normals[t] = area / size;
    } else {
      slivers.push_back(static_cast<std::int32_t>(t));
    }
  }
  // Rows of slivers one behind the other, each by the neighbour at its longest edge; where two
  // share that, by any neighbour. Each pass settles one at least.
  const auto take_normal = [&](std::int32_t t, std::size_t k) {
    const std::int32_t u = mesh.neighbours[index(t)][k];
    if (u >= 0) mesh.normals[index(t)] = mesh.normals[index(u)];
    return !mesh.normals[index(t)].isZero(0);
  };
  const auto by_longest = [&](std::int32_t t) {
    return take_normal(t, longest_edge(mesh, mesh.triangles[index(t)]));
  };
  const auto by_any = [&](std::int32_t t) {
    return take_normal(t, 0) || take_normal(t, 1) || take_normal(t, 2);
  };
  while (std::erase_if(slivers, by_longest) > 0 || std::erase_if(slivers, by_any) > 0) {
  }
}

void find_edges(TriangleMesh& mesh) {
  mesh.edges.resize(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& corners = mesh.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t u = mesh.neighbours[t][k];
      const Vector edge =
          mesh.vertices[index(corners[(k + 1) % 3])] - mesh.vertices[index(corners[k])];
      mesh.edges[t][k] =
          u < 0 ? EdgeKind::border : kind_of_edge(mesh.normals[t], mesh.normals[index(u)], edge);
    }
  }
}

void plant_tree(TriangleMesh& mesh) {
  std::vector<Aabb> boxes(mesh.triangles.size());
  std::vector<std::int32_t> numbers(mesh.triangles.size());
  for (std::size_t t = 0; t < boxes.size(); ++t) {
    numbers[t] = static_cast<std::int32_t>(t);
    for (const std::int32_t v : mesh.triangles[t]) {
      boxes[t].lower = boxes[t].lower.cwiseMin(mesh.vertices[index(v)]);
      boxes[t].upper = boxes[t].upper.cwiseMax(mesh.vertices[index(v)]);
    }
    mesh.box.lower = mesh.box.lower.cwiseMin(boxes[t].lower);
    mesh.box.upper = mesh.box.upper.cwiseMax(boxes[t].upper);
  }
  for (const Vector& v : mesh.vertices) mesh.reach = std::max(mesh.reach, v.norm());
  mesh.origin = 0.5 * (mesh.box.lower + mesh.box.upper);
  std::vector<FloatBox> small(boxes.size());
  for (std::size_t t = 0; t < boxes.size(); ++t) small[t] = to_float(boxes[t], mesh.origin);
  const auto tree = std::make_shared<BoxTree>();
  tree->build(small, numbers, MortonCurve(small, numbers));
  mesh.tree = tree;
}

void measure_thickness(TriangleMesh& mesh) {
  if (!mesh.is_closed) return;
  double volume = 0, area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vector a = mesh.vertices[index(t[0])] - mesh.origin,
                 b = mesh.vertices[index(t[1])] - mesh.origin,
                 c = mesh.vertices[index(t[2])] - mesh.origin;
    volume += a.dot(b.cross(c)) / 6;
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  mesh.thickness = std::max(0.0, volume / area);
}

}  // namespace

EdgeKind kind_of_edge(const Vector& n, const Vector& n_beyond, const Vector& edge) {
  const Vector turn = n.cross(n_beyond);
  const bool is_flat =
      turn.squaredNorm() < kTolerances.flat_sine * kTolerances.flat_sine && n.dot(n_beyond) >= 0;
  return !is_flat && turn.dot(edge) > 0 ? EdgeKind::ridge : EdgeKind::inner;
}

void complete(TriangleMesh& mesh) {
  find_neighbours(mesh);
  find_normals(mesh);
  find_edges(mesh);
  plant_tree(mesh);
  measure_thickness(mesh);
}

}  // namespace cradle
