#include "server/dynamics/schemes/scheme.h"

namespace cradle {
namespace {

constexpr Scheme kSchemes[] = {
    {"exact", exact, 6, "closed forms; Blanes, Casas, Ros 2000"},
    {"explicit_euler", explicit_euler, 1, "Rueth, II.C.1"},
    {"implicit_euler", implicit_euler, 1, "Rueth, II.C.2"},
    {"stoermer_verlet", stoermer_verlet, 2, "Rueth, II.C.3; Bou-Rabee, Marsden 2009"},
    {"semi_implicit_euler", semi_implicit_euler, 1, "Hairer, Lubich, Wanner 2006, I.1.2"},
    {"rk4", rk4, 4, "Kutta 1901"},
};

}  // namespace

std::span<const Scheme> schemes() { return kSchemes; }

const Scheme* find_scheme(std::string_view name) {
  for (const Scheme& scheme : kSchemes) {
    if (name == scheme.name) return &scheme;
  }
  return nullptr;
}

}  // namespace cradle
