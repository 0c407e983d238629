/// Methods that move bodies in contact through a tick, behind one interface; one file a method.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/dynamics/contact_constraint.h"

namespace cradle {

struct ContactTick {
  double dt = 0;  ///< s
  int sub_steps = 1;
  std::span<const std::int32_t> moving;  ///< slots of the dynamic bodies to move, ascending
  std::span<const std::int32_t> driven;  ///< slots of kinematic bodies they touch, ascending
};

class ContactSolver {
 public:
  virtual ~ContactSolver() = default;

  /// Moves the bodies of `tick.moving` through the tick: their x, q, v, w. Kinematic and static
  /// ones are read only. Impulses in `constraints` are last tick's on entry, this tick's on return.
  virtual void advance(const ContactTick& tick, const BodyArrays& bodies,
                       std::span<const Matrix> inverse_inertia_W,
                       std::span<ContactConstraint> constraints) = 0;
};

/// By name, e.g. "soft"; null for an unknown one.
std::unique_ptr<ContactSolver> make_contact_solver(std::string_view name);

/// All names, the default first.
std::vector<std::string> contact_solver_names();

}  // namespace cradle
