/// Two rims of bodies of revolution: where they overlap least. Private to this folder.
#pragma once

#include "server/collision/side_arc.h"

namespace cradle {

/// Symbols in rim_patch.cpp; m. What is sought is on an arc of each rim.
struct RimPatch {
  double r_A, r_B;
  double cosine;         ///< of a and b
  double d_A, d_B, d_e;  ///< from A's rim to B's, along v_A, v_B and e
  double d_squared;
  double low_A, high_A, low_B, high_B;  ///< cosines: the ends of the arcs

  /// One of the arcs has no length.
  bool is_empty() const { return !(low_A < high_A && low_B < high_B); }
  /// Whether points on the arcs may be nearer to each other than `most`, as seen from their
  /// middles.
  bool may_be_nearer(double most, const HalfAngle& middle_A, const HalfAngle& middle_B) const;
  /// From two points to a minimum on the arcs. False: the way leads off them.
  bool polish(HalfAngle& at_A, HalfAngle& at_B) const;
};

}  // namespace cradle
