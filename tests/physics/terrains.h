/// Surfaces to move on: grids of triangles, jittered and cut at random.
#pragma once

#include <cmath>

#include "tests/physics/solids.h"
#include "tests/physics/worlds.h"

namespace cradle {

/// n x n cells of side `cell` about the origin, with z = height(x, y). With `jitter`, a share of
/// the cell, inner vertices are moved aside at random, and each cell is cut one way or the other.
inline Surface terrain(int n, double cell, double jitter,
                       const std::function<double(double, double)>& height) {
  Surface s;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto at = [n](int i, int j) { return i * (n + 1) + j; };
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const bool is_inner = i > 0 && i < n && j > 0 && j < n;
      const double move = is_inner ? jitter * cell : 0;
      const double x = (i - 0.5 * n) * cell + move * uniform(random);
      const double y = (j - 0.5 * n) * cell + move * uniform(random);
      s.vertices.emplace_back(x, y, height(x, y));
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const int a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
      if (jitter == 0 || uniform(random) < 0) {
        s.triangles.push_back({a, b, c});
        s.triangles.push_back({a, c, d});
      } else {
        s.triangles.push_back({a, b, d});
        s.triangles.push_back({b, c, d});
      }
    }
  }
  return s;
}

inline double flat(double, double) { return 0; }

/// A fixed body of that surface, added to the world.
inline BodyId add_surface(World& world, const GeometryPointer& geometry, const Vec3& p_WBo = {},
                          const Quat& q_WB = {}) {
  REQUIRE(geometry);
  BodySpec spec;
  spec.kind = BodyKind::fixed;
  spec.shape = Shape::stored(geometry->kind(), world.add_geometry(geometry));
  spec.p_WBo = p_WBo;
  spec.q_WB = q_WB;
  return add(world, spec);
}

}  // namespace cradle
