/// The contact solver "newton": see newton_step.cpp.
#pragma once

#include "server/dynamics/contact/contact_solver.h"

namespace cradle {

std::unique_ptr<ContactSolver> make_newton_step();

}  // namespace cradle
