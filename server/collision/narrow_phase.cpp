// The pair table. To add a shape: write its closed forms, give it a row and a column.
#include "server/collision/narrow_phase.h"

#include <cstddef>

#include "server/collision/manifolds.h"
#include "server/collision/pair_functions.h"

namespace cradle {
namespace {

Manifold no_contact(const Collider&, const Collider&, double) { return {}; }

/// A closed form with its arguments the other way round: the one place where bodies are swapped and
/// the normal turned back.
template <PairFunction kFunction>
Manifold swapped(const Collider& A, const Collider& B, double margin) {
  Manifold manifold = kFunction(B, A, margin);
  manifold.normal_W = -manifold.normal_W;
  return manifold;
}

constexpr std::size_t kKinds = 9;

// clang-format off
constexpr PairFunction kPairTable[kKinds][kKinds] = {
    // B: none, sphere, box, half_space, capsule, cylinder, cone, ellipsoid, hull
    // A: none
    {no_contact, no_contact, no_contact, no_contact, no_contact, no_contact, no_contact,
     no_contact, no_contact},
    // A: sphere
    {no_contact, sphere_sphere, sphere_box, sphere_half_space, sphere_capsule, sphere_cylinder,
     sphere_cone, convex_convex, convex_convex},
    // A: box
    {no_contact, swapped<sphere_box>, box_box, box_half_space, convex_convex, convex_convex,
     convex_convex, convex_convex, convex_convex},
    // A: half_space
    {no_contact, swapped<sphere_half_space>, swapped<box_half_space>, no_contact,
     swapped<convex_half_space>, swapped<convex_half_space>, swapped<convex_half_space>,
     swapped<convex_half_space>, swapped<convex_half_space>},
    // A: capsule
    {no_contact, swapped<sphere_capsule>, swapped<convex_convex>, convex_half_space,
     capsule_capsule, convex_convex, convex_convex, convex_convex, convex_convex},
    // A: cylinder
    {no_contact, swapped<sphere_cylinder>, swapped<convex_convex>, convex_half_space,
     swapped<convex_convex>, convex_convex, convex_convex, convex_convex, convex_convex},
    // A: cone
    {no_contact, swapped<sphere_cone>, swapped<convex_convex>, convex_half_space,
     swapped<convex_convex>, swapped<convex_convex>, convex_convex, convex_convex, convex_convex},
    // A: ellipsoid
    {no_contact, swapped<convex_convex>, swapped<convex_convex>, convex_half_space,
     swapped<convex_convex>, swapped<convex_convex>, swapped<convex_convex>, convex_convex,
     convex_convex},
    // A: hull
    {no_contact, swapped<convex_convex>, swapped<convex_convex>, convex_half_space,
     swapped<convex_convex>, swapped<convex_convex>, swapped<convex_convex>,
     swapped<convex_convex>, convex_convex},
};
// clang-format on

}  // namespace

bool can_collide(ShapeKind kind) {
  return static_cast<std::size_t>(kind) < kKinds || is_composite(kind);
}

Manifold collide(const Collider& A, const Collider& B, double margin) {
  const auto row = static_cast<std::size_t>(A.shape.kind);
  const auto column = static_cast<std::size_t>(B.shape.kind);
  if (row >= kKinds || column >= kKinds) return {};
  for (const Collider* one : {&A, &B}) {
    if (one->shape.kind == ShapeKind::hull && one->hull() == nullptr) return {};
  }
  return kPairTable[row][column](A, B, margin);
}

}  // namespace cradle
