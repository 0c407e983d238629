#pragma once

#include <cstdint>

#include "server/collision/geometry.h"

namespace cradle {

/// What is known of a pair before its manifold is made: for time, not for what comes out, but for
/// ties of directions and of points.
struct PairHints {
  Vector axis_W = Vector::Zero();  ///< unit, from A to B: of the last manifold; zero: not known
  bool was_apart = false;          ///< along that
  bool wants_lead = false;         ///< else the manifold may come without one
  double foresight = 0;            ///< as of BoxBatch; other shapes have none
  std::uint64_t choice = 0;        ///< of the last manifold: as Manifold::choice
};

}  // namespace cradle
