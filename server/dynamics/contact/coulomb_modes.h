/// An oracle for contact with friction: tries for each point whether it opens, sticks or slides.
/// coulomb_modes.cpp.
#pragma once

#include <cstdint>
#include <vector>

#include "server/dynamics/contact/coulomb_problem.h"

namespace cradle {

/// Beyond it the number of modes, 4^points in the plane, is not tried.
inline constexpr int kModePoints = 8;

struct CoulombModes {
  /// N s; of all modes that obey the laws, one for each distinct u.
  std::vector<Eigen::VectorXd> impulses;
  std::vector<Eigen::VectorXd> velocities;  ///< m/s, of them
  std::int64_t tried = 0;
  /// Modes whose equations have no unique solution, and were passed over: redundant points.
  std::int64_t singular = 0;
  /// Nothing was passed over, and each mode has one solution: in the plane, or without friction.
  /// Then there are no other velocities. In space slides are found by iteration, which may miss
  /// one.
  bool is_complete = false;
};

/// At most kModePoints points. `only_one`: ends with the first that is found.
CoulombModes find_modes(const CoulombProblem& problem, bool only_one = false);

}  // namespace cradle
