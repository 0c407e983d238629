#include "server/collision/broad_phase.h"

namespace cradle {
namespace {

struct BroadPhaseMethod {
  const char* name;
  std::unique_ptr<BroadPhase> (*make)();
};
constexpr BroadPhaseMethod kBroadPhases[] = {{"kept", make_kept_broad_phase},
                                             {"fcl", make_fcl_broad_phase}};

}  // namespace

std::vector<std::string> broad_phase_names() {
  std::vector<std::string> names;
  for (const BroadPhaseMethod& method : kBroadPhases) names.emplace_back(method.name);
  return names;
}

std::unique_ptr<BroadPhase> make_broad_phase(std::string_view name) {
  for (const BroadPhaseMethod& method : kBroadPhases) {
    if (name == method.name) return method.make();
  }
  return nullptr;
}

}  // namespace cradle
