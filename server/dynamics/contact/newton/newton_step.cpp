// The contact solvers "newton" and "accurate": one step a tick, the velocities of each island at
// once as the minimum of a convex problem.
//
// Equations and sources: contact_island.cpp, island_solver.cpp, minimise.cpp.
//   v' = v + dt a + M^-1 J^T g,  x' = x + dt v'
// Islands for which no minimum is found are not taken half done: the soft step moves them in that
// tick (soft_step.cpp), and they are counted: ContactReport::islands_makeshift.
// So are those that are solved to less than they should be.
// What it cannot do: large heaps that fall in on themselves take a hundred times as long as by soft
// steps, so "newton" leaves them to these. It knows no rolling and torsional friction, restitution
// is Newton's.
//
// Order: 1. Cost: an island at rest 0.7 us a manifold; an iteration 2 to 3, in motion dozens.
#include "server/dynamics/contact/newton/newton_step.h"

#include <algorithm>

#include "server/dynamics/contact/newton/island_step.h"

namespace cradle {
namespace {

class NewtonStep final : public IslandStep {
 public:
  using IslandStep::IslandStep;

 private:
  void choose(std::span<const Matrix>, std::span<ContactConstraint* const>) override {
    std::ranges::fill(fates(), Fate::solved);
  }
  bool solve(std::size_t island) override {
    if (solver().solve(bodies(), arrays(), islands_in()[island], tick().dt)) return true;
    ++report().islands_makeshift;
    return false;
  }
};

}  // namespace

std::unique_ptr<ContactSolver> make_newton_step() { return std::make_unique<NewtonStep>(kNewton); }
std::unique_ptr<ContactSolver> make_accurate_step() {
  return std::make_unique<NewtonStep>(kAccurate);
}

}  // namespace cradle
