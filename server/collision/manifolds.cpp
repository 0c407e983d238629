// Compounds: the parts near the other body, found by a tree over boxes of the parts that is made
// once, in the compound's frame, which the other body is taken into. Cost of a pair: one box, the
// nodes of the tree that the other body is near to, and the parts put to the pair table.
#include "server/collision/manifolds.h"

#include <algorithm>

#include "server/collision/bounds.h"
#include "server/collision/box_tree.h"
#include "server/collision/convex_shape.h"
#include "server/collision/extents.h"
#include "server/collision/narrow_phase.h"
#include "server/collision/planar_pairs.h"
#include "server/collision/surface.h"
#include "server/collision/surface_manifolds.h"

namespace cradle {
namespace {

constexpr int kShiftA = 44, kShiftB = 32;

/// m. Boxes are made roomier by this much, for rounding.
constexpr double kPartRoom = 1e-6;

/// A part of a compound as a collider of its own. Stays where it was made: the collider refers to
/// the pose.
struct PosedPart {
  Pose X_WP;
  Collider collider;

  PosedPart(const Compound& compound, std::size_t i, const Pose& X_WB)
      : X_WP{X_WB.x + X_WB.R * compound.X_BP[i].x, X_WB.R * compound.X_BP[i].R},
        collider{compound.parts[i].shape, X_WP, compound.parts[i].geometry.get()} {}
  PosedPart(const PosedPart&) = delete;
  PosedPart& operator=(const PosedPart&) = delete;
};

/// A convex shape, not one without end.
bool is_convex_solid(const Collider& C) {
  return has_inside(C.shape.kind) && (C.shape.kind != ShapeKind::hull || C.hull() != nullptr);
}

/// Everything that belongs to one pair of bodies.
struct Search {
  double margin;
  const PairMethods& methods;
  std::vector<Manifold>& manifolds;
  std::int64_t work = 0;

  void add(const Collider& A, const Collider& B, std::uint64_t part);
  /// A or B is a mesh or a height field.
  void add_surface(const Collider& A, const Collider& B, bool is_A, std::uint64_t part);
  std::vector<std::int32_t> parts_near(const Compound& compound, const Pose& X_WC,
                                       const Collider& other);
};

/// The parts of a compound that another body may touch, ascending.
std::vector<std::int32_t> Search::parts_near(const Compound& compound, const Pose& X_WC,
                                             const Collider& other) {
  std::vector<std::int32_t> near;
  const auto take = [&near](std::int32_t i) { near.push_back(i); };
  const Pose& X_WO = other.X_WB;
  const double reach = margin + kPartRoom;
  if (other.shape.kind == ShapeKind::half_space) {
    const Vector up_W = X_WO.R.col(2), up = X_WC.R.transpose() * up_W;
    const double height = up_W.dot(X_WC.x - X_WO.x);
    work += compound.tree->query_if(
        [&](const FloatBox& box) {
          double lowest = height;
          for (std::size_t k = 0; k < 3; ++k) {
            const double n = up[static_cast<Eigen::Index>(k)];
            lowest += n * static_cast<double>(n < 0 ? box.upper[k] : box.lower[k]);
          }
          return lowest <= reach;
        },
        take);
  } else {
    const Pose X_CO{X_WC.R.transpose() * (X_WO.x - X_WC.x), X_WC.R.transpose() * X_WO.R};
    const Compound* whole = compound_of(other);
    const Aabb box = whole != nullptr ? posed(whole->box, X_CO)
                                      : methods.bounds({other.shape, X_CO, other.geometry});
    if (box.is_empty()) return near;
    work += compound.tree->query(to_float(swept(box, Vector::Zero(), reach), Vector::Zero()), take);
  }
  std::sort(near.begin(), near.end());
  return near;
}

void Search::add_surface(const Collider& A, const Collider& B, bool is_A, std::uint64_t part) {
  const Collider &surface = is_A ? A : B, &other = is_A ? B : A;
  const std::size_t begin = manifolds.size();
  if (other.shape.kind == ShapeKind::half_space) {
    add_surface_half_space(surface, other, margin, part, manifolds);
  } else if (is_convex_solid(other)) {
    add_surface_manifolds(surface, other, margin, part, manifolds);
  }
  if (is_A) return;
  for (std::size_t k = begin; k < manifolds.size(); ++k) {
    manifolds[k].normal_W = -manifolds[k].normal_W;
  }
}

void Search::add(const Collider& A, const Collider& B, std::uint64_t part) {
  if (const Compound* compound = compound_of(A)) {
    for (const std::int32_t i : parts_near(*compound, A.X_WB, B)) {
      const auto k = static_cast<std::size_t>(i);
      const PosedPart P(*compound, k, A.X_WB);
      add(P.collider, B, part | k << kShiftA);
    }
    return;
  }
  if (const Compound* compound = compound_of(B)) {
    for (const std::int32_t i : parts_near(*compound, B.X_WB, A)) {
      const auto k = static_cast<std::size_t>(i);
      const PosedPart P(*compound, k, B.X_WB);
      add(A, P.collider, part | k << kShiftB);
    }
    return;
  }
  ++work;
  const bool is_A = is_surface(A.shape.kind);
  if (is_A || is_surface(B.shape.kind)) return add_surface(A, B, is_A, part);
  Manifold manifold = methods.collide(A, B, margin);
  if (manifold.count == 0) return;
  manifold.part = part;
  manifolds.push_back(manifold);
}

}  // namespace

const PairMethods& pair_methods(bool is_planar) {
  static constexpr PairMethods kOfSpace{collide, bounds},
      kOfPlane{collide_in_plane, bounds_in_plane};
  return is_planar ? kOfPlane : kOfSpace;
}

bool is_composite(ShapeKind kind) { return kind == ShapeKind::compound || is_surface(kind); }

double least_distance(const Collider& A, const Collider& B, double margin) {
  const bool is_A = is_surface(A.shape.kind);
  const Collider &surface = is_A ? A : B, &other = is_A ? B : A;
  if (!is_surface(surface.shape.kind) || !is_convex_solid(other)) return 0;
  return surface_gap(surface, other, margin);
}

std::int64_t add_manifolds(const Collider& A, const Collider& B, double margin,
                           std::vector<Manifold>& manifolds, const PairMethods& methods) {
  Search search{margin, methods, manifolds};
  search.add(A, B, 0);
  return search.work;
}

}  // namespace cradle
