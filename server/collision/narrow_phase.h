/// Turns a pair of shapes into a manifold, by closed forms, chosen from a table by the two kinds.
#pragma once

#include "server/collision/box_batch.h"
#include "server/collision/collider.h"
#include "server/collision/manifold.h"
#include "server/collision/polytope_batch.h"

namespace cradle {

/// False for shapes that no pair of the table knows yet; true for `none`, which wants no contact.
bool can_collide(ShapeKind kind);

/// Contacts of A and B that are closer than `margin` (m). Symmetric in its arguments up to the
/// sign of the normal, but for two boxes whose best faces are equally good: then A's gives it.
/// Pairs without a closed form, with a shape `none` or with a pose that is not finite give none.
Manifold collide(const Collider& A, const Collider& B, double margin);

/// The same for shapes without stored geometry.
inline Manifold collide(const Shape& shape_A, const Pose& X_WA, const Shape& shape_B,
                        const Pose& X_WB, double margin) {
  return collide({shape_A, X_WA}, {shape_B, X_WB}, margin);
}

/// Manifolds of many pairs: of boxes many at a time, of hulls a few, of others as they come; the
/// same as one by one.
class Collisions {
 public:
  /// `lanes`: one of machine_lanes(), or 0: the most.
  explicit Collisions(MadeManifolds& made, int lanes = 0)
      : made_(made), boxes_(made, lanes), polytopes_(made) {}

  /// Shapes and poses must last until `finish`. `wants_lead`: else the manifold may come without
  /// one. `foresight`: as of BoxBatch; other shapes have none.
  void add(std::size_t key, const Collider& A, const Collider& B, double margin,
           bool wants_lead = false, double foresight = 0) {
    if (A.shape.kind == ShapeKind::box && B.shape.kind == ShapeKind::box) {
      boxes_.add(key, A, B, margin, foresight);
    } else if (PolytopeBatch::takes(A, B)) {
      polytopes_.add(key, A, B, margin, wants_lead);
    } else {
      made_.take(key, collide(A, B, margin));
    }
  }
  void finish() {
    boxes_.finish();
    polytopes_.finish();
  }

 private:
  MadeManifolds& made_;
  BoxBatch boxes_;
  PolytopeBatch polytopes_;
};

}  // namespace cradle
