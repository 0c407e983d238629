/// What two materials are to each other.
#pragma once

#include <cradle/types.h>

#include <algorithm>
#include <cmath>

namespace cradle {

struct ContactMaterial {
  double friction, restitution;
  double rolling_m, torsional_m;
};

inline double combined(CombineRule rule, double a, double b) {
  switch (rule) {
    case CombineRule::average:
      return 0.5 * (a + b);
    case CombineRule::minimum:
      return std::min(a, b);
    case CombineRule::multiply:
      return a * b;
    case CombineRule::maximum:
      return std::max(a, b);
    case CombineRule::by_default:
    case CombineRule::geometric_mean:
      break;
  }
  return std::sqrt(a * b);
}

/// The larger enumerator is the stronger rule. Rolling and torsional friction are the larger one of
/// each, whatever the rules: one soft body is enough to make a contact wide.
inline ContactMaterial combined(const Material& A, const Material& B) {
  const CombineRule friction = std::max(A.friction_rule, B.friction_rule);
  CombineRule restitution = std::max(A.restitution_rule, B.restitution_rule);
  if (restitution == CombineRule::by_default) restitution = CombineRule::maximum;
  return {combined(friction, A.friction, B.friction),
          combined(restitution, A.restitution, B.restitution),
          std::max(A.rolling_friction_m, B.rolling_friction_m),
          std::max(A.torsional_friction_m, B.torsional_friction_m)};
}

}  // namespace cradle
