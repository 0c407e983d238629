// What collision wants to know of a hull: planes, who is next to whom, and a ball inside.
#include <algorithm>
#include <map>
#include <numeric>

#include "server/collision/stored_geometry.h"

namespace cradle {
namespace {

constexpr std::size_t kWidest = 256;  // faces tried first as the side to leave by

std::size_t index(std::int32_t i) { return static_cast<std::size_t>(i); }

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
  for (const std::int32_t k : hull.around) hull.neighbours.push_back(next[index(k)]);
}

}  // namespace

void complete(ConvexHull& hull) {
  add_planes(hull);
  add_neighbours(hull);
  Vector sum = Vector::Zero();
  for (const Vector& v : hull.vertices) sum += v;
  hull.centre = sum / static_cast<double>(hull.vertices.size());
  hull.inner_radius = std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f < hull.face_count(); ++f) {
    hull.inner_radius =
        std::min(hull.inner_radius, hull.offsets[f] - hull.normals[f].dot(hull.centre));
  }
}

}  // namespace cradle
