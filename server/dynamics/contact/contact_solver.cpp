#include "server/dynamics/contact/contact_solver.h"

#include "server/dynamics/contact/impulse_step.h"
#include "server/dynamics/contact/lcp_step.h"
#include "server/dynamics/contact/newton/newton_step.h"
#include "server/dynamics/contact/penalty_step.h"
#include "server/dynamics/contact/soft_step.h"

namespace cradle {
namespace {

struct Method {
  const char* name;
  std::unique_ptr<ContactSolver> (*make)();
};
constexpr Method kMethods[] = {{"hybrid", make_hybrid_step},  {"soft", make_soft_step},
                               {"newton", make_newton_step},  {"accurate", make_accurate_step},
                               {"lcp", make_lcp_step},        {"impulse", make_impulse_step},
                               {"penalty", make_penalty_step}};

}  // namespace

std::unique_ptr<ContactSolver> make_contact_solver(std::string_view name) {
  for (const Method& method : kMethods) {
    if (name == method.name) return method.make();
  }
  return nullptr;
}

std::vector<std::string> contact_solver_names() {
  std::vector<std::string> names;
  for (const Method& method : kMethods) names.emplace_back(method.name);
  return names;
}

}  // namespace cradle
