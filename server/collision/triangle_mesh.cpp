// Is this list of triangles the surface of a solid?
//
// Each edge must have two triangles that run along it in opposite directions: then the surface is
// closed, and its triangles agree about which side is outside. Of each connected part of the
// surface the signed volume tells whether that side is outside indeed: a positive one bounds a
// solid; a negative one is a cavity, if it lies within a solid, and else inside out.
//
// "Within" is asked of one vertex of a part, by the solid angle under which it sees the other parts
// (van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30, 1983): 4 pi times the number of solids
// around it. So parts that lie in one another are found, parts that cut each other are not.
#include <cradle/limits.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

#include "server/collision/index.h"
#include "server/collision/stored_geometry.h"

namespace cradle {
namespace {

/// A triangle's edge, from corner to corner; sorted so that the two sides of an edge are
/// neighbours.
struct Edge {
  std::int32_t low, high;
  bool is_upward;  ///< runs from low to high
  std::int32_t triangle;

  friend bool operator<(const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  }
  bool is_same_place(const Edge& other) const { return low == other.low && high == other.high; }
};

std::vector<Edge> edges_of(const TriangleMesh& mesh) {
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t from = mesh.triangles[t][k], to = mesh.triangles[t][(k + 1) % 3];
      edges.push_back(
          {std::min(from, to), std::max(from, to), from < to, static_cast<std::int32_t>(t)});
    }
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

std::string text_of(const Vector& p) {
  const auto number = [](double x) {
    std::array<char, 32> digits{};
    const auto end =
        std::to_chars(digits.begin(), digits.end(), x, std::chars_format::general, 9).ptr;
    return std::string(digits.begin(), end);
  };
  return "(" + number(p.x()) + ", " + number(p.y()) + ", " + number(p.z()) + ")";
}

std::string text_of(const Edge& edge, const TriangleMesh& mesh) {
  return "the edge from " + text_of(mesh.vertices[index(edge.low)]) + " to " +
         text_of(mesh.vertices[index(edge.high)]);
}

/// The first edge with one triangle only; null if there is none. `edges` are sorted.
const Edge* find_open(const std::vector<Edge>& edges) {
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const bool has_last = i > 0 && edges[i].is_same_place(edges[i - 1]);
    const bool has_next = i + 1 < edges.size() && edges[i].is_same_place(edges[i + 1]);
    if (!has_last && !has_next) return &edges[i];
  }
  return nullptr;
}

/// What makes the surface none, open or closed.
std::string surface_fault(const TriangleMesh& mesh, const std::vector<Edge>& edges) {
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    if (!edges[i].is_same_place(edges[i + 1])) continue;
    if (i + 2 < edges.size() && edges[i].is_same_place(edges[i + 2])) {
      return "has more than two triangles at " + text_of(edges[i], mesh);
    }
    const std::string one = std::to_string(edges[i].triangle);
    const std::string other = std::to_string(edges[i + 1].triangle);
    if (edges[i].is_upward == edges[i + 1].is_upward) {
      const auto corners = [&](const Edge& edge) {
        Triangle sorted = mesh.triangles[index(edge.triangle)];
        std::sort(sorted.begin(), sorted.end());
        return sorted;
      };
      if (corners(edges[i]) == corners(edges[i + 1])) {
        return "has triangles " + one + " and " + other + " in one place; leave one out";
      }
      return "has triangles " + one + " and " + other +
             ", which disagree about which side is outside; turn one round: swap two of its "
             "corners";
    }
  }
  return {};
}

/// What is nothing but lines and points would let everything pass. m: the largest height of a
/// triangle.
double largest_height(const TriangleMesh& mesh) {
  double most = 0;
  for (const Triangle& t : mesh.triangles) {
    const auto side = [&](std::size_t k) {
      return Vector(mesh.vertices[index(t[(k + 1) % 3])] - mesh.vertices[index(t[k])]);
    };
    const double longest = std::max({side(0).norm(), side(1).norm(), side(2).norm()});
    most = std::max(most, side(0).cross(side(1)).norm() / longest);
  }
  return most;
}

/// Fills `mesh`: places once each, and no others than triangles have. Returns the fault, if any.
std::string weld(std::span<const Vector> vertices, std::span<const Triangle> triangles,
                 TriangleMesh& mesh) {
  const auto before = [&](std::int32_t a, std::int32_t b) {
    const Vector &p = vertices[index(a)], &q = vertices[index(b)];
    return std::tie(p.x(), p.y(), p.z()) < std::tie(q.x(), q.y(), q.z());
  };
  std::vector<std::int32_t> order(vertices.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), before);
  std::vector<std::int32_t> same(vertices.size());  // the first vertex at the same place
  for (std::size_t k = 0; k < order.size(); ++k) {
    const bool is_new = k == 0 || before(order[k - 1], order[k]);
    same[index(order[k])] = is_new ? order[k] : same[index(order[k - 1])];
  }

  std::vector<std::int32_t> number(vertices.size(), -1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    Triangle corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t v = triangles[t][k];
      if (v < 0 || index(v) >= vertices.size()) {
        return "has triangle " + std::to_string(t) + " with a corner " + std::to_string(v) +
               ", and " + std::to_string(vertices.size()) + " vertices";
      }
      corners[k] = same[index(v)];
    }
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
      return "has triangle " + std::to_string(t) + " with two corners at one place";
    }
    mesh.triangles.push_back(corners);
    for (const std::int32_t v : corners) number[index(v)] = 0;
  }
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (number[v] < 0) continue;
    number[v] = static_cast<std::int32_t>(mesh.vertices.size());
    mesh.vertices.push_back(vertices[v]);
  }
  for (Triangle& corners : mesh.triangles) {
    for (std::int32_t& v : corners) v = number[index(v)];
  }
  return {};
}

/// For each triangle the number of its connected part, from 0 in the order of first triangles.
std::vector<std::size_t> parts_of(const TriangleMesh& mesh, const std::vector<Edge>& edges,
                                  std::size_t& count) {
  std::vector<std::size_t> root(mesh.triangles.size());
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto find = [&root](std::size_t t) {
    while (root[t] != t) t = root[t] = root[root[t]];
    return t;
  };
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    if (!edges[i].is_same_place(edges[i + 1])) continue;
    const auto a = find(index(edges[i].triangle)), b = find(index(edges[i + 1].triangle));
    root[std::max(a, b)] = std::min(a, b);
  }
  std::vector<std::size_t> part(mesh.triangles.size());
  count = 0;
  for (std::size_t t = 0; t < part.size(); ++t) part[t] = find(t) == t ? count++ : part[find(t)];
  return part;
}

/// Six times the volume between a triangle and `p`, positive if p sees its inner side.
double six_volumes(const TriangleMesh& mesh, const Triangle& t, const Vector& p) {
  const Vector a = mesh.vertices[index(t[0])] - p, b = mesh.vertices[index(t[1])] - p,
               c = mesh.vertices[index(t[2])] - p;
  return a.dot(b.cross(c));
}

/// In how many solids `p` lies, counting what is not of part `own`; on a face of one: half.
double solids_around(const TriangleMesh& mesh, const std::vector<std::size_t>& part,
                     std::size_t own, const Vector& p) {
  double angle = 0;
  for (std::size_t t = 0; t < part.size(); ++t) {
    if (part[t] == own) continue;
    const Triangle& corners = mesh.triangles[t];
    const Vector a = mesh.vertices[index(corners[0])] - p, b = mesh.vertices[index(corners[1])] - p,
                 c = mesh.vertices[index(corners[2])] - p;
    const double A = a.norm(), B = b.norm(), C = c.norm();
    angle +=
        2 * std::atan2(a.dot(b.cross(c)), A * B * C + a.dot(b) * C + b.dot(c) * A + c.dot(a) * B);
  }
  return angle / (4 * std::numbers::pi);
}

/// What makes a closed surface that of no solid.
std::string solid_fault(const TriangleMesh& mesh, const std::vector<Edge>& edges) {
  std::size_t count = 0;
  const std::vector<std::size_t> part = parts_of(mesh, edges, count);
  std::vector<double> volume(count, 0), size(count, 0);
  std::vector<Vector> origin(count);
  std::vector<bool> is_begun(count, false);
  double all = 0, all_sizes = 0;
  for (std::size_t t = 0; t < part.size(); ++t) {
    const Vector& corner = mesh.vertices[index(mesh.triangles[t][0])];
    if (!is_begun[part[t]]) origin[part[t]] = corner;
    is_begun[part[t]] = true;
    const double v = six_volumes(mesh, mesh.triangles[t], origin[part[t]]);
    volume[part[t]] += v;
    size[part[t]] += std::abs(v);
  }
  // Smaller than this the volume is nothing but rounding; or that of less than the least
  // tetrahedron.
  constexpr double kRounding = 1e-13;
  constexpr double kLeast_m3 = limits::kSizeMin_m * limits::kSizeMin_m * limits::kSizeMin_m;
  for (std::size_t k = 0; k < count; ++k) {
    if (!(std::abs(volume[k]) > kRounding * size[k])) return "encloses no volume";
    all += volume[k];
    all_sizes += size[k];
  }
  const std::string fix = "; turn all its triangles round: swap two corners of each";
  const bool is_all_inverted =
      std::all_of(volume.begin(), volume.end(), [](double v) { return v < 0; });
  if (is_all_inverted) {
    return "is inside out: its triangles run clockwise as seen from outside" + fix;
  }
  if (!(all > std::max(kLeast_m3, kRounding * all_sizes))) return "encloses no volume";
  constexpr std::size_t kPartsExamined = 1000;  // the time grows with parts times triangles
  if (count == 1) return {};
  if (count > kPartsExamined) return "is in more than 1000 pieces";
  for (std::size_t k = 0; k < count; ++k) {
    const double around = solids_around(mesh, part, k, origin[k]);
    const std::string which = "the piece at " + text_of(origin[k]);
    if (volume[k] < 0 && around < 0.25) return "has " + which + " inside out" + fix;
    if (volume[k] > 0 && around > 0.75) return "has " + which + " within another one";
  }
  return {};
}

std::string point_fault(std::span<const Vector> points) {
  if (points.size() > static_cast<std::size_t>(limits::kPoints)) return "has too many vertices";
  for (const Vector& p : points) {
    if (!p.allFinite()) return "has a vertex that is not finite";
    if (p.cwiseAbs().maxCoeff() > limits::kSizeMax_m) {
      return "has the vertex " + text_of(p) + ", out of range";
    }
  }
  return {};
}

}  // namespace

std::string open_edge(const TriangleMesh& mesh) {
  const std::vector<Edge> edges = edges_of(mesh);
  const Edge* open = find_open(edges);
  return open ? text_of(*open, mesh) + " has a triangle on one side only" : "";
}

MadeGeometry make_mesh(std::span<const Vector> vertices, std::span<const Triangle> triangles) {
  if (triangles.empty()) return {nullptr, "has no triangles"};
  if (triangles.size() > static_cast<std::size_t>(limits::kTriangles)) {
    return {nullptr, "has too many triangles"};
  }
  TriangleMesh mesh;
  std::string fault = point_fault(vertices);
  if (fault.empty()) fault = weld(vertices, triangles, mesh);
  if (!fault.empty()) return {nullptr, fault};
  if (largest_height(mesh) < limits::kSizeMin_m) {
    return {nullptr, "has no triangle that is wider than 1e-4 m"};
  }
  const std::vector<Edge> edges = edges_of(mesh);
  fault = surface_fault(mesh, edges);
  mesh.is_closed = find_open(edges) == nullptr;
  if (fault.empty() && mesh.is_closed) fault = solid_fault(mesh, edges);
  if (!fault.empty()) return {nullptr, fault};
  complete(mesh);
  return {std::make_shared<const StoredGeometry>(StoredGeometry{std::move(mesh)}), {}};
}

}  // namespace cradle
