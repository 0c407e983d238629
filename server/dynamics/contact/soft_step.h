/// The contact solver "soft": see soft_step.cpp.
#pragma once

#include "server/dynamics/contact/contact_solver.h"
#include "server/dynamics/contact/tick_islands.h"

namespace cradle {

class SoftSolver : public ContactSolver {
 public:
  /// As `advance`, with all of a tick's bodies and constraints, whose islands are known: moves
  /// those of `which`, by island 1, or all if it is empty. Others are only read.
  virtual ContactReport advance_some(const ContactTick& tick, const BodyArrays& bodies,
                                     std::span<const Matrix> inverse_inertia_W,
                                     std::span<ContactConstraint* const> constraints,
                                     const TickIslands& islands,
                                     std::span<const std::uint8_t> which) = 0;
};

std::unique_ptr<ContactSolver> make_soft_step();
std::unique_ptr<SoftSolver> make_soft_solver();

}  // namespace cradle
