/// The result of the narrow phase: where and how two shapes touch, or are about to.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "server/collision/geometry.h"

namespace cradle {

inline constexpr int kManifoldPoints = 4;

/// Not set until it is used: zeros for points that nobody reads cost a fifth of a pair of boxes.
struct ContactPoint {
  Vector p_W;             ///< m, midway between the two surfaces along the normal
  double separation;      ///< m, along the normal; negative: overlap
  std::uint32_t feature;  ///< which features meet here; the same under small motion
};

/// Up to four points that share one normal: the first `count`.
struct Manifold {
  std::uint64_t part = 0;  ///< which parts of two bodies meet: see manifolds.h; 0 of convex ones
  Vector normal_W = Vector::UnitZ();  ///< unit, from A to B
  int count = 0;                      ///< of points; zero: nothing within the margin
  /// m. With points: how much the normal leads over the next best direction, or what both bodies
  /// may move together until it has turned, if that is less; 0 and below: not known, or too little
  /// to rely on. Without: a separation that the shapes have at least, of pairs that
  /// begin at an axis (narrow_phase.h) along the normal; 0: not known.
  double lead = 0;
  /// For the next time, 0: none. Of two boxes with more than four candidates: which four they are;
  /// of a hull and what has corners: where the search ended.
  std::uint64_t choice = 0;
  std::array<ContactPoint, kManifoldPoints> points;

  /// Of what nothing is known yet.
  void clear() {
    part = choice = 0;
    normal_W = Vector::UnitZ();
    count = 0;
    lead = 0;
  }
  /// A copy of what is used: most pairs have no points.
  void copy_used(const Manifold& from) {
    part = from.part;
    normal_W = from.normal_W;
    count = from.count;
    lead = from.lead;
    choice = from.choice;
    std::copy_n(from.points.begin(), count, points.begin());
  }
};

/// Takes the manifolds of pairs as they are made, in any order.
class MadeManifolds {
 public:
  virtual ~MadeManifolds() = default;
  /// Where one may be made, so that it need not be copied: then that itself is given to `take`.
  virtual Manifold& room(std::size_t key) = 0;
  virtual void take(std::size_t key, const Manifold& manifold) = 0;
};

}  // namespace cradle
