/// The contact solver "soft": see soft_step.cpp.
#pragma once

#include "server/dynamics/contact/contact_solver.h"

namespace cradle {

std::unique_ptr<ContactSolver> make_soft_step();

}  // namespace cradle
