/// The contact solver "impulse": see impulse_step.cpp.
#pragma once

#include "server/dynamics/contact/contact_solver.h"

namespace cradle {

std::unique_ptr<ContactSolver> make_impulse_step();

}  // namespace cradle
