/// Projected Gauss-Seidel on the points of a ContactSystem: sequential impulses.
#pragma once

#include "server/dynamics/contact/contact_system.h"

namespace cradle {

struct SweepSettings {
  int sweeps_max = 200;   ///< a stack of n, the top one R times as heavy, asks for 3 n^2 + 7 n R
  double enough = 1e-10;  ///< of the largest change in the first sweep
  double still = 1e-13;   ///< m/s, or m: or so much, which is rounding ("what falls")
  bool has_friction = true;
};

/// Adds to `impulses`, which have been given to the lines already, by point: until no point changes
/// any more. False if sweeps ran out.
///
/// A point takes lambda = -K^-1 (u + bias n) where that is within its cone, K its own 3 x 3; else
/// its normal, and then friction towards |lt| <= mu ln. So one contact that sticks is exact at
/// once. Sources: Jean and Moreau (1992), Catto (2005). Order: linear, worse the heavier what is
/// carried.
bool sweep(ContactSystem::Points points, std::span<Vector> impulses, BodyLine* lines,
           const SweepSettings& settings = {});

}  // namespace cradle
