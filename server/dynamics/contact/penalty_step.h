/// The contact solver "penalty": see penalty_step.cpp.
#pragma once

#include "server/dynamics/contact/contact_solver.h"

namespace cradle {

std::unique_ptr<ContactSolver> make_penalty_step();

}  // namespace cradle
