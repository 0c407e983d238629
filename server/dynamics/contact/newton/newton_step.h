/// The contact solvers "newton" and "accurate": see newton_step.cpp.
#pragma once

#include "server/dynamics/contact/contact_solver.h"

namespace cradle {

std::unique_ptr<ContactSolver> make_newton_step();
std::unique_ptr<ContactSolver> make_accurate_step();

}  // namespace cradle
