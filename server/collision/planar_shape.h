/// Every shape of the plane as a core grown by a radius: a disc is a corner, a capsule an edge with
/// two sides, a rectangle and a polygon they themselves. Private to this folder.
#pragma once

#include <array>

#include "server/collision/collider.h"

namespace cradle {

/// Two plain numbers: as a packet of two they would be stored apart and loaded at once, over and
/// over, which takes ten times as long as the arithmetic.
using Point = Eigen::Matrix<double, 2, 1, Eigen::DontAlign>;

/// Lengths in m, along the axes x, y of W, from a given origin.
struct PlanarShape {
  static constexpr int kCornersMax = 64;

  int count = 0;  ///< of corners; zero: no shape of the plane with an end
  double radius = 0;
  // Not cleared: that takes time.
  std::array<Point, kCornersMax> corners;  ///< counter-clockwise
  std::array<Point, kCornersMax> normals;  ///< unit, outward; k of the edge from k to the next

  /// The pose must be in z = 0, turned about z.
  PlanarShape(const Collider& collider, const Vector& origin_W) {
    const Pose& X = collider.X_WB;
    place(collider, {X.x.x() - origin_W.x(), X.x.y() - origin_W.y()});
  }

  int edges() const { return count > 1 ? count : 0; }
  int after(int k) const { return k + 1 < count ? k + 1 : 0; }
  int before(int k) const { return k > 0 ? k - 1 : count - 1; }
  const Point& corner(int k) const { return corners[static_cast<std::size_t>(k)]; }
  const Point& normal(int k) const { return normals[static_cast<std::size_t>(k)]; }

  /// The corner that lies farthest in the direction `d`; of several the first.
  int farthest(const Point& d) const;

 private:
  void place(const Collider& collider, const Point& o);
};

}  // namespace cradle
