// What collision wants to know of a hull: planes, who is next to whom, and a ball inside.
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <span>

#include "server/collision/direction_grid.h"
#include "server/collision/index.h"
#include "server/collision/stored_geometry.h"

namespace cradle {
namespace {

constexpr std::size_t kWidest = 256;   // faces tried first as the side to leave by
constexpr std::size_t kLikely = 4096;  // vertices: beyond, cells would hold too many of them
constexpr std::size_t kFoursMost = 16384;

/// Twice the area of a face along its normal (Newell), about its first corner.
Vector area_of(const ConvexHull& hull, std::size_t f) {
  const auto loop = hull.face(f);
  const Vector& o = hull.vertices[index(loop[0])];
  Vector area = Vector::Zero();
  for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
    area += (hull.vertices[index(loop[k])] - o).cross(hull.vertices[index(loop[k + 1])] - o);
  }
  return area;
}

void add_planes(ConvexHull& hull) {
  std::vector<double> areas;
  for (std::size_t f = 0; f < hull.face_count(); ++f) {
    const Vector area = area_of(hull, f);
    areas.push_back(area.norm());
    hull.normals.push_back(area / areas.back());
    double offset = -std::numeric_limits<double>::infinity();
    for (const std::int32_t v : hull.face(f)) {
      offset = std::max(offset, hull.normals[f].dot(hull.vertices[index(v)]));
    }
    hull.offsets.push_back(offset);
  }
  hull.widest.resize(hull.face_count());
  std::iota(hull.widest.begin(), hull.widest.end(), 0);
  std::stable_sort(hull.widest.begin(), hull.widest.end(), [&](std::int32_t a, std::int32_t b) {
    return areas[index(a)] > areas[index(b)];
  });
  hull.widest.resize(std::min(hull.widest.size(), kWidest));
}

void add_neighbours(ConvexHull& hull) {
  const std::size_t places = hull.loops.size();
  hull.face_at.resize(places);
  hull.edge_at.resize(places);
  std::vector<std::int32_t> next(places);
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> edges;
  for (std::size_t f = 0; f < hull.face_count(); ++f) {
    const auto begin = index(hull.first[f]), end = index(hull.first[f + 1]);
    for (std::size_t k = begin; k < end; ++k) {
      hull.face_at[k] = static_cast<std::int32_t>(f);
      next[k] = hull.loops[k + 1 < end ? k + 1 : begin];
      const auto ends = std::minmax(hull.loops[k], next[k]);
      hull.edge_at[k] = edges.emplace(ends, static_cast<std::int32_t>(edges.size())).first->second;
    }
  }
  hull.around.resize(places);
  std::iota(hull.around.begin(), hull.around.end(), 0);
  std::stable_sort(hull.around.begin(), hull.around.end(), [&](std::int32_t a, std::int32_t b) {
    return hull.loops[index(a)] < hull.loops[index(b)];
  });
  hull.around_first.assign(hull.vertices.size() + 1, 0);
  for (const std::int32_t v : hull.loops) ++hull.around_first[index(v) + 1];
  std::partial_sum(hull.around_first.begin(), hull.around_first.end(), hull.around_first.begin());
  for (const std::int32_t k : hull.around) {
    const std::int32_t from = hull.loops[index(k)], to = next[index(k)];
    hull.neighbours.push_back(to);
    hull.edges_along.push_back(
        (hull.vertices[index(to)] - hull.vertices[index(from)]).normalized());
  }
}

void add_faces_beyond(ConvexHull& hull) {
  std::vector<std::int32_t> sum(hull.loops.size());  // of the numbers of an edge's two faces
  for (std::size_t k = 0; k < hull.loops.size(); ++k)
    sum[index(hull.edge_at[k])] += hull.face_at[k];
  for (std::size_t k = 0; k < hull.loops.size(); ++k) {
    hull.beyond.push_back(sum[index(hull.edge_at[k])] - hull.face_at[k]);
  }
}

/// The least cosine between the normals of the faces at a vertex and their mean direction.
double vertex_cosine(const ConvexHull& hull, std::size_t v) {
  const auto begin = index(hull.around_first[v]), end = index(hull.around_first[v + 1]);
  const auto normal = [&](std::size_t k) {
    return hull.normals[index(hull.face_at[index(hull.around[k])])];
  };
  Vector sum = Vector::Zero();
  for (std::size_t k = begin; k < end; ++k) sum += normal(k);
  double least = sum.norm();
  for (std::size_t k = begin; k < end; ++k) least = std::min(least, normal(k).dot(sum));
  return std::max(0.0, least / sum.norm());
}

void add_cosines(ConvexHull& hull) {
  hull.corner_cosines.assign(hull.face_count(), 1);
  hull.edge_cosines.assign(hull.face_count(), 1);
  std::vector<double> of_vertex;
  for (std::size_t v = 0; v < hull.vertices.size(); ++v)
    of_vertex.push_back(vertex_cosine(hull, v));
  for (std::size_t k = 0; k < hull.loops.size(); ++k) {
    const std::size_t f = index(hull.face_at[k]), g = index(hull.beyond[k]);
    double &corner = hull.corner_cosines[f], &edge = hull.edge_cosines[f];
    corner = std::min(corner, of_vertex[index(hull.loops[k])]);
    // Half the angle between two unit vectors.
    edge = std::min(edge, 0.5 * (hull.normals[f] + hull.normals[g]).norm());
  }
}

/// Leaves the vertices that no other one surpasses everywhere within the angle with the sine `sine`
/// about the unit vector `d`.
void keep_likely(const ConvexHull& hull, const Vector& d, double sine,
                 std::vector<std::uint16_t>& vertices) {
  const auto is_surpassed = [&](std::uint16_t v, std::uint16_t by) {
    const Vector lead = hull.vertices[by] - hull.vertices[v];
    return lead.dot(d) > sine * lead.norm();
  };
  const std::uint16_t farthest =
      *std::max_element(vertices.begin(), vertices.end(), [&](std::uint16_t a, std::uint16_t b) {
        return hull.vertices[a].dot(d) < hull.vertices[b].dot(d);
      });
  std::erase_if(vertices, [&](std::uint16_t v) { return is_surpassed(v, farthest); });
  const std::vector<std::uint16_t> all = vertices;
  std::erase_if(vertices, [&](std::uint16_t v) {
    return std::ranges::any_of(all, [&](std::uint16_t by) { return is_surpassed(v, by); });
  });
}

/// By fours, the last of them filled up.
void append_fours(const ConvexHull& hull, std::span<const std::uint16_t> numbers,
                  std::vector<FourVertices>& fours) {
  for (std::size_t begin = 0; begin < numbers.size(); begin += 4) {
    FourVertices& four = fours.emplace_back();
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint16_t v = numbers[begin + k < numbers.size() ? begin + k : 0];
      const Vector& p = hull.vertices[v];
      four.x[k] = p.x(), four.y[k] = p.y(), four.z[k] = p.z();
      four.numbers[k] = v;
    }
  }
}

void add_likely(ConvexHull& hull) {
  if (hull.vertices.size() > kLikely) return;
  std::map<std::vector<std::uint16_t>, FoursOfCell> known;
  for (std::size_t cell = 0; cell < DirectionGrid::kCells; ++cell) {
    const auto corners = DirectionGrid::corners(cell);
    const Vector middle = (corners[0] + corners[1] + corners[2] + corners[3]).normalized();
    double cosine = 1;
    for (const Vector& corner : corners) cosine = std::min(cosine, corner.dot(middle));
    constexpr double kRounding = 1e-9;
    const double sine = std::sqrt(1 - cosine * cosine) + kRounding;
    std::vector<std::uint16_t> vertices(hull.vertices.size());
    std::iota(vertices.begin(), vertices.end(), std::uint16_t{0});
    keep_likely(hull, middle, sine, vertices);
    const auto [place, is_new] = known.try_emplace(vertices);
    if (is_new) {
      const std::size_t first = hull.likely.size();
      append_fours(hull, vertices, hull.likely);
      if (hull.likely.size() > kFoursMost) {
        hull.likely.clear();
        hull.likely_of.clear();
        return;
      }
      place->second = {static_cast<std::uint16_t>(first),
                       static_cast<std::uint16_t>(hull.likely.size() - first)};
    }
    hull.likely_of.push_back(place->second);
  }
}

}  // namespace

void complete(ConvexHull& hull) {
  add_likely(hull);
  add_planes(hull);
  add_neighbours(hull);
  add_faces_beyond(hull);
  add_cosines(hull);
  add_panels(hull);
  Vector sum = Vector::Zero();
  for (const Vector& v : hull.vertices) sum += v;
  hull.centre = sum / static_cast<double>(hull.vertices.size());
  hull.lower = hull.upper = hull.vertices.front();
  for (const Vector& v : hull.vertices) {
    hull.lower = hull.lower.cwiseMin(v);
    hull.upper = hull.upper.cwiseMax(v);
  }
  hull.inner_radius = std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f < hull.face_count(); ++f) {
    hull.inner_radius =
        std::min(hull.inner_radius, hull.offsets[f] - hull.normals[f].dot(hull.centre));
  }
}

}  // namespace cradle
