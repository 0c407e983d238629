/// The contact solver "lcp": see lcp_step.cpp.
#pragma once

#include "server/dynamics/contact/contact_solver.h"

namespace cradle {

std::unique_ptr<ContactSolver> make_lcp_step();

}  // namespace cradle
