/// Turns a pair of shapes into a manifold, by closed forms, chosen from a table by the two kinds.
#pragma once

#include <optional>

#include "server/collision/box_batch.h"
#include "server/collision/collider.h"
#include "server/collision/convex_shape.h"
#include "server/collision/manifold.h"
#include "server/collision/pair_hints.h"
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

/// Whether it saves time to know an axis: not for two boxes, whose axes are all tried, many at a
/// time, nor for half-spaces.
inline bool begins_at_axis(ShapeKind A, ShapeKind B) {
  const std::uint64_t both = bit_of(A) | bit_of(B);
  return (both & ~kKindsWithInside) == 0 && both != bit_of(ShapeKind::box);
}

/// Without points, if the two are farther apart than the margin along the axis still that they were
/// apart along: two support points instead of a search.
std::optional<Manifold> still_apart(const Collider& A, const Collider& B, double margin,
                                    const PairHints& hints);

/// Manifolds of many pairs: of boxes many at a time, of hulls a few, of others as they come; the
/// same as one by one.
class Collisions {
 public:
  /// `lanes`: one of machine_lanes(), or 0: the most.
  explicit Collisions(MadeManifolds& made, int lanes = 0)
      : made_(made), boxes_(made, lanes), polytopes_(made) {}

  /// Shapes and poses must last until `finish`.
  void add(std::size_t key, const Collider& A, const Collider& B, double margin,
           const PairHints& hints = {}) {
    if (A.shape.kind == ShapeKind::box && B.shape.kind == ShapeKind::box) {
      boxes_.add(key, A, B, margin, hints.foresight, hints.choice);
    } else if (PolytopeBatch::takes(A, B)) {
      polytopes_.add(key, A, B, margin, hints);
    } else if (const auto apart =
                   hints.was_apart ? still_apart(A, B, margin, hints) : std::nullopt) {
      made_.take(key, *apart);
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
