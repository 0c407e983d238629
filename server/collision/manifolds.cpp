#include "server/collision/manifolds.h"

#include "server/collision/bounds.h"
#include "server/collision/narrow_phase.h"

namespace cradle {
namespace {

constexpr int kShiftA = 44, kShiftB = 32;

/// A part of a compound as a collider of its own. Stays where it was made: the collider refers to
/// the pose.
struct PosedPart {
  Pose X_WP;
  Collider collider;

  PosedPart(const CompoundPart& part, const Pose& X_WB)
      : X_WP{X_WB.x + X_WB.R * part.p_BoPo, X_WB.R * part.q_BP.toRotationMatrix()},
        collider{part.shape, X_WP, part.geometry.get()} {}
  PosedPart(const PosedPart&) = delete;
  PosedPart& operator=(const PosedPart&) = delete;
};

const Compound* compound_of(const Collider& C) {
  if (C.shape.kind != ShapeKind::compound || C.geometry == nullptr) return nullptr;
  return std::get_if<Compound>(&C.geometry->value);
}

bool may_touch(const Collider& A, const Collider& B, double margin) {
  const Aabb box_A = bounds(A), box_B = bounds(B);
  if (box_A.is_empty() || box_B.is_empty()) return true;  // without end: the pair table knows
  return swept(box_A, Vector::Zero(), margin).overlaps(box_B);
}

void add(const Collider& A, const Collider& B, double margin, std::uint64_t part,
         std::vector<Manifold>& manifolds) {
  if (const Compound* compound = compound_of(A)) {
    for (std::size_t i = 0; i < compound->parts.size(); ++i) {
      const PosedPart P(compound->parts[i], A.X_WB);
      if (may_touch(P.collider, B, margin))
        add(P.collider, B, margin, part | i << kShiftA, manifolds);
    }
    return;
  }
  if (const Compound* compound = compound_of(B)) {
    for (std::size_t i = 0; i < compound->parts.size(); ++i) {
      const PosedPart P(compound->parts[i], B.X_WB);
      if (may_touch(A, P.collider, margin))
        add(A, P.collider, margin, part | i << kShiftB, manifolds);
    }
    return;
  }
  Manifold manifold = collide(A, B, margin);
  if (manifold.count == 0) return;
  manifold.part = part;
  manifolds.push_back(manifold);
}

}  // namespace

bool is_composite(ShapeKind kind) { return kind == ShapeKind::compound; }

void add_manifolds(const Collider& A, const Collider& B, double margin,
                   std::vector<Manifold>& manifolds) {
  add(A, B, margin, 0, manifolds);
}

}  // namespace cradle
