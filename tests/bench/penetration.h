/// How deep bodies overlap, by a check of its own: it shares no code with the engine's collision
/// detection.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/collision/geometry.h"
#include "server/scene.h"
#include "tests/bench/solids.h"

namespace cradle::bench {

/// Over pairs that overlap, of which at least one body is dynamic.
struct Penetration {
  double max_m = 0;   ///< NaN if a pose is not finite
  double mean_m = 0;  ///< over the pairs
  std::int64_t pairs = 0;
  double squares_m2 = 0;  ///< their sum; NaN likewise
};

/// The shortest way that parts two shapes, m; negative: they are apart by at least that much.
/// Of a box and a box it is the least overlap over their fifteen separating axes, of spheres and
/// boxes closed forms, of others what `parting` finds. Shapes without volume, meshes, and two
/// half-spaces are infinitely far apart.
double overlap_m(const Solid& A, const Pose& X_WA, const Solid& B, const Pose& X_WB);

/// Looks at all bodies of a scene but those with a mesh; of two compounds at the two parts that
/// overlap most. Bodies up to the size of the largest dynamic one go through a
/// uniform grid, larger ones (floors and walls) are held against every dynamic body.
class PenetrationCheck {
 public:
  explicit PenetrationCheck(const Scene& scene);

  /// `states` has one entry for each of Scene::bodies.
  Penetration look(std::span<const BodyState> states);

 private:
  using Cell = std::uint64_t;
  template <typename Visit>
  void for_near_pairs(Visit visit);

  struct Part {
    Solid solid;
    Pose X_BP;
  };
  static std::vector<Part> convex_parts(const Scene& scene, const Shape& shape);
  double depth_m(std::size_t i, std::size_t j) const;

  std::vector<bool> is_dynamic_;
  std::vector<std::vector<Part>> parts_;  // of each body
  std::vector<double> radii_;             // of the bounding sphere; infinite for half-spaces
  std::vector<std::size_t> small_;        // bodies in the grid
  std::vector<std::size_t> large_;
  double cell_m_ = 0;
  std::vector<Pose> poses_;
  std::vector<std::pair<Cell, std::size_t>> grid_;  // sorted
};

}  // namespace cradle::bench
