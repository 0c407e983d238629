/// What tests of collisions say often.
#pragma once

#include <array>
#include <vector>

#include "tests/bench/poses.h"
#include "tests/bench/solids.h"

namespace cradle {

inline constexpr double kExact = 1e-9;   ///< m
inline constexpr double kMargin = 0.02;  ///< m

inline const Shape kCube = Shape::box({0.5, 0.5, 0.5});

inline constexpr std::array kConvex = {ShapeKind::sphere,   ShapeKind::box,  ShapeKind::capsule,
                                       ShapeKind::cylinder, ShapeKind::cone, ShapeKind::ellipsoid,
                                       ShapeKind::hull};

inline Solid hull_of_box(const Vector& half) {
  std::vector<Vector> corners;
  for (int k = 0; k < 8; ++k) {
    const Vector signs(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
    corners.push_back(half.cwiseProduct(signs));
  }
  return Solid(make_hull(corners).geometry);
}

}  // namespace cradle
