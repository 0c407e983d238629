// The pair table. To add a shape: write its closed forms, give it a row and a column.
#include "server/collision/narrow_phase.h"

#include <cstddef>

#include "server/collision/pair_functions.h"

namespace cradle {
namespace {

Manifold no_contact(const Shape&, const Pose&, const Shape&, const Pose&, double) { return {}; }

/// A closed form with its arguments the other way round: the one place where bodies are swapped and
/// the normal turned back.
template <PairFunction kFunction>
Manifold swapped(const Shape& shape_A, const Pose& X_WA, const Shape& shape_B, const Pose& X_WB,
                 double margin) {
  Manifold manifold = kFunction(shape_B, X_WB, shape_A, X_WA, margin);
  manifold.normal_W = -manifold.normal_W;
  return manifold;
}

constexpr std::size_t kKinds = 4;

// clang-format off
constexpr PairFunction kPairTable[kKinds][kKinds] = {
    // B: none    sphere                      box                      half_space            A:
    {no_contact, no_contact,                 no_contact,              no_contact},         // none
    {no_contact, sphere_sphere,              sphere_box,              sphere_half_space},  // sphere
    {no_contact, swapped<sphere_box>,        box_box,                 box_half_space},     // box
    {no_contact, swapped<sphere_half_space>, swapped<box_half_space>, no_contact},         // half_space
};
// clang-format on

}  // namespace

bool can_collide(ShapeKind kind) { return static_cast<std::size_t>(kind) < kKinds; }

Manifold collide(const Shape& shape_A, const Pose& X_WA, const Shape& shape_B, const Pose& X_WB,
                 double margin) {
  const auto row = static_cast<std::size_t>(shape_A.kind);
  const auto column = static_cast<std::size_t>(shape_B.kind);
  if (row >= kKinds || column >= kKinds) return {};
  return kPairTable[row][column](shape_A, X_WA, shape_B, X_WB, margin);
}

}  // namespace cradle
