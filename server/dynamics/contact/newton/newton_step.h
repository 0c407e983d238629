/// The contact solvers "newton" and "accurate": see newton_step.cpp; and "hybrid".
#pragma once

#include "server/dynamics/contact/contact_solver.h"

namespace cradle {

std::unique_ptr<ContactSolver> make_newton_step();
std::unique_ptr<ContactSolver> make_accurate_step();
/// See hybrid_step.cpp.
std::unique_ptr<ContactSolver> make_hybrid_step();

}  // namespace cradle
