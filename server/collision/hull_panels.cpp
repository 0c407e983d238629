// Faces of a hull that are next to each other and level with each other, as corners typed or
// written with noise leave them: which of them is deepest is chance, and a body over one of them
// may be told to touch the other. They carry as one, a panel: the convex hull of their corners in
// the plane of the largest (Andrew's monotone chain, 1979), off that plane by 1e-5 of its width at
// most.
#include <algorithm>
#include <tuple>

#include "server/collision/index.h"
#include "server/collision/polytope_search.h"
#include "server/collision/stored_geometry.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

/// A corner of a panel in its plane: the place in `loops` where an edge leaves it.
struct Corner {
  double x, y;
  std::int32_t place;
};

/// The faces that are level with `seed` and hang together with it, `seed` first. They are of that
/// panel from now on.
std::vector<std::size_t> take_level(ConvexHull& hull, std::size_t seed, std::int32_t panel) {
  std::vector<std::size_t> faces{seed};
  hull.panel_of[seed] = panel;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const auto begin = index(hull.first[faces[i]]), end = index(hull.first[faces[i] + 1]);
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t g = index(hull.beyond[k]);
      const double sine2 = hull.normals[seed].cross(hull.normals[g]).squaredNorm();
      const bool is_level = hull.normals[seed].dot(hull.normals[g]) > 0 &&
                            sine2 < kTolerances.level_sine * kTolerances.level_sine;
      if (!is_level || hull.panel_of[g] >= 0) continue;
      hull.panel_of[g] = panel;
      faces.push_back(g);
    }
  }
  return faces;
}

/// Counter-clockwise as seen from outside; none of them on the line of its neighbours.
std::vector<Corner> outline(std::vector<Corner> corners) {
  std::ranges::sort(corners, [](const Corner& a, const Corner& b) {
    return std::tie(a.x, a.y, a.place) < std::tie(b.x, b.y, b.place);
  });
  std::vector<Corner> loop;
  const auto append = [&loop](const Corner& c, std::size_t fixed) {
    while (loop.size() > fixed + 1) {
      const Corner &a = loop[loop.size() - 2], &b = loop.back();
      if ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > 0) break;
      loop.pop_back();
    }
    loop.push_back(c);
  };
  for (const Corner& c : corners) append(c, 0);
  const std::size_t upper = loop.size() - 1;
  for (std::size_t k = corners.size() - 1; k-- > 0;) append(corners[k], upper);
  loop.pop_back();
  return loop;
}

}  // namespace

void add_panels(ConvexHull& hull) {
  hull.panel_of.assign(hull.face_count(), -1);
  std::vector<std::size_t> seeds(hull.widest.begin(), hull.widest.end());
  for (std::size_t f = 0; f < hull.face_count(); ++f) seeds.push_back(f);
  for (const std::size_t seed : seeds) {
    if (hull.panel_of[seed] >= 0) continue;
    const auto panel = static_cast<std::int32_t>(hull.panel_first.size()) - 1;
    const std::vector<std::size_t> faces = take_level(hull, seed, panel);
    if (faces.size() == 1) {
      hull.panel_of[seed] = -1;
      continue;
    }
    const Vector x = unit_across(hull.normals[seed]), y = hull.normals[seed].cross(x);
    std::vector<Corner> corners;
    for (const std::size_t f : faces) {
      for (std::int32_t k = hull.first[f]; k < hull.first[f + 1]; ++k) {
        const Vector& p = hull.vertices[index(hull.loops[index(k)])];
        corners.push_back({x.dot(p), y.dot(p), k});
      }
    }
    for (const Corner& corner : outline(std::move(corners))) {
      hull.panel_places.push_back(corner.place);
    }
    hull.panel_first.push_back(static_cast<std::int32_t>(hull.panel_places.size()));
  }
}

}  // namespace cradle
