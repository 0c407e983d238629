/// Solids as meshes, and integrals of them that are independent of the code under test.
#pragma once

#include <catch2/catch.hpp>
#include <functional>
#include <numbers>
#include <random>

#include "server/dynamics/mass_distribution.h"
#include "tests/bench/poses.h"

namespace cradle {

inline constexpr double kPi = std::numbers::pi;

struct Surface {
  std::vector<Vector> vertices;
  std::vector<Triangle> triangles;
};

inline Surface box_surface(const Vector& half) {
  Surface s;
  for (int i = 0; i < 8; ++i) {
    s.vertices.emplace_back((i & 1) ? half.x() : -half.x(), (i & 2) ? half.y() : -half.y(),
                            (i & 4) ? half.z() : -half.z());
  }
  s.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                 {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return s;
}

inline Surface tetrahedron_surface() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

inline Surface octahedron_surface(double a) {
  return {{{a, 0, 0}, {-a, 0, 0}, {0, a, 0}, {0, -a, 0}, {0, 0, a}, {0, 0, -a}},
          {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
}

/// Closed in both directions: point(i, j) for i < n, j < m; outside is to the left of growing i as
/// seen along growing j.
inline Surface wrapped_surface(int n, int m, const std::function<Vector(int, int)>& point) {
  Surface s;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) s.vertices.push_back(point(i, j));
  }
  const auto at = [&](int i, int j) { return (i % n) * m + j % m; };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      s.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      s.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return s;
}

inline Surface torus_surface(double R, double r, int n, int m) {
  return wrapped_surface(n, m, [=](int i, int j) {
    const double u = 2 * M_PI * i / n, v = 2 * M_PI * j / m;
    return Vector((R + r * std::cos(v)) * std::cos(u), (R + r * std::cos(v)) * std::sin(u),
                  r * std::sin(v));
  });
}

/// A solid of revolution about z: a polygon chain (radius, z) from axis to axis, upwards.
inline Surface turned_surface(const std::vector<std::pair<double, double>>& chain, int n) {
  Surface s;
  const int rings = static_cast<int>(chain.size()) - 2;
  s.vertices.emplace_back(0, 0, chain.front().second);
  for (int k = 1; k <= rings; ++k) {
    for (int i = 0; i < n; ++i) {
      const double u = 2 * M_PI * i / n, r = chain[static_cast<std::size_t>(k)].first;
      s.vertices.emplace_back(r * std::cos(u), r * std::sin(u),
                              chain[static_cast<std::size_t>(k)].second);
    }
  }
  s.vertices.emplace_back(0, 0, chain.back().second);
  const auto at = [&](int k, int i) { return 1 + (k - 1) * n + i % n; };
  const int top = 1 + rings * n;
  for (int i = 0; i < n; ++i) {
    s.triangles.push_back({0, at(1, i + 1), at(1, i)});
    s.triangles.push_back({top, at(rings, i), at(rings, i + 1)});
    for (int k = 1; k < rings; ++k) {
      s.triangles.push_back({at(k, i), at(k, i + 1), at(k + 1, i + 1)});
      s.triangles.push_back({at(k, i), at(k + 1, i + 1), at(k + 1, i)});
    }
  }
  return s;
}

inline Surface moved(Surface s, const Vector& shift, const Matrix& R = Matrix::Identity()) {
  for (Vector& v : s.vertices) v = shift + R * v;
  return s;
}

inline MadeGeometry mesh_of(const Surface& s) { return make_mesh(s.vertices, s.triangles); }

inline MassDistribution mass_of(const MadeGeometry& made, double density = 1) {
  CAPTURE(made.fault);
  REQUIRE(made.geometry);
  return mass_distribution(*made.geometry, density);
}

/// Mass, centre and tensor by sampling a box with a grid of midpoints, for solids that a function
/// tells inside from outside: the second method, slow and of second order.
inline MassDistribution sampled(const Vector& lower, const Vector& upper, int n,
                                const std::function<double(const Vector&)>& density) {
  const Vector step = (upper - lower) / n;
  double mass = 0;
  Vector first = Vector::Zero();
  Matrix second = Matrix::Zero();
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k) {
        const Vector p = lower + step.cwiseProduct(Vector(i + 0.5, j + 0.5, k + 0.5));
        const double m = density(p) * step.prod();
        mass += m;
        first += m * p;
        second += m * p * p.transpose();
      }
    }
  }
  const Vector c = first / mass;
  const Matrix C = second / mass - c * c.transpose();
  return {mass, c, C.trace() * Matrix::Identity() - C};
}

inline double relative(const Matrix& a, const Matrix& b) { return (a - b).norm() / b.norm(); }

}  // namespace cradle
