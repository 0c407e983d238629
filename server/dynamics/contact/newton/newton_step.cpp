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

#include "server/dynamics/contact/newton/island_solver.h"
#include "server/dynamics/contact/single_contacts.h"
#include "server/dynamics/contact/soft_step.h"
#include "server/dynamics/contact/tick_islands.h"

namespace cradle {
namespace {

std::size_t index(std::int32_t i) { return static_cast<std::size_t>(i); }

class NewtonStep final : public ContactSolver {
 public:
  explicit NewtonStep(const IslandSettings& settings) : solver_(settings) {}

  ContactReport advance(const ContactTick& tick, const BodyArrays& arrays,
                        std::span<const Matrix> inverse_inertia_W,
                        std::span<ContactConstraint> constraints) override {
    report_ = {};
    if (constraints.empty()) return report_;
    tick_ = tick;
    arrays_ = arrays;
    find_islands(constraints);
    begin(tick, inverse_inertia_W);
    ways_.resize(bodies_.lines());
    ends_.resize(bodies_.lines());
    is_solved_.assign(islands_.count(), 0);
    for (std::size_t i = 0; i < islands_.count(); ++i) {
      if (!solver_.solve(bodies_, arrays, islands_in_[i], tick.dt)) continue;
      is_solved_[i] = 1;
      solver_.store(ways_, ends_);
      solver_.keep(report_.residual);
      report_.islands_makeshift += solver_.is_exact() ? 0 : 1;
    }
    if (std::ranges::find(is_solved_, 0) == is_solved_.end()) {
      finish(tick, constraints);
    } else {
      finish_apart(inverse_inertia_W, constraints);
    }
    return report_;
  }

 private:
  void find_islands(std::span<ContactConstraint> constraints) {
    islands_.find(tick_, arrays_.x.size(), constraints);
    report_.islands = static_cast<int>(islands_.count());
    islands_in_.resize(std::max(islands_in_.size(), islands_.count()));
    for (Island& island : islands_in_) {
      island.slots.clear();
      island.constraints.clear();
    }
    for (std::size_t k = 0; k < tick_.moving.size(); ++k) {
      islands_in_[island_of_body(k)].slots.push_back(tick_.moving[k]);
    }
    for (std::size_t k = 0; k < constraints.size(); ++k) {
      islands_in_[islands_.of_constraint(k)].constraints.push_back(&constraints[k]);
    }
  }

  std::size_t island_of_body(std::size_t k) const {
    return islands_.of(static_cast<std::int32_t>(k));
  }
  void begin(const ContactTick& tick, std::span<const Matrix> inverse_inertia_W) {
    bodies_.begin(tick, arrays_, inverse_inertia_W);
    balance_ = {};
    if (tick.is_balanced) bodies_.begin_balance(balance_);
    bodies_.integrate_velocities(tick.dt, 0);
  }

  /// Of all bodies that `bodies_` has.
  void finish(const ContactTick& tick, std::span<ContactConstraint> constraints) {
    const auto set = [&](std::span<const BodyLine> velocities) {
      for (std::size_t k = 0; k < tick.moving.size(); ++k) {
        bodies_.velocities()[k] = velocities[index(islands_.numbers()[index(tick.moving[k])])];
      }
    };
    set(ways_);
    bodies_.integrate_positions(tick.dt, 0);
    set(ends_);
    if (tick.is_balanced) {
      bodies_.take_means(tick.dt);
      for (ContactConstraint& c : constraints) SingleContact(c, bodies_).add_work(balance_);
      bodies_.end_balance(balance_, tick.dt);
      report_.balance.add(balance_);
    }
    for (ContactConstraint& c : constraints) c.torque = Vector::Zero();
    bodies_.finish();
    report_.sub_steps_max = std::max(report_.sub_steps_max, 1);
    report_.body_sub_steps += static_cast<std::int64_t>(tick.moving.size());
    if (report_.choices_used == kSubStepChoices) return;
    const auto islands = static_cast<int>(std::ranges::count(is_solved_, 1));
    const auto moving = static_cast<int>(tick.moving.size());
    report_.choices[report_.choices_used++] = {1, islands, moving, 0};
  }

  /// Islands without a solution by the soft step, then the others by theirs.
  void finish_apart(std::span<const Matrix> inverse_inertia_W,
                    std::span<ContactConstraint> constraints) {
    for (const int solved : {0, 1}) {
      moving_.clear();
      chosen_.clear();
      for (std::size_t k = 0; k < tick_.moving.size(); ++k) {
        if (is_solved_[island_of_body(k)] == solved) moving_.push_back(tick_.moving[k]);
      }
      for (std::size_t k = 0; k < constraints.size(); ++k) {
        if (is_solved_[islands_.of_constraint(k)] == solved) chosen_.push_back(constraints[k]);
      }
      ContactTick tick = tick_;
      tick.moving = moving_;
      if (solved == 0) {
        add(soft_->advance(tick, arrays_, inverse_inertia_W, chosen_));
      } else {
        begin(tick, inverse_inertia_W);
        finish(tick, chosen_);
      }
      auto next = chosen_.begin();
      for (std::size_t k = 0; k < constraints.size(); ++k) {
        if (is_solved_[islands_.of_constraint(k)] == solved) constraints[k] = *next++;
      }
    }
  }

  void add(const ContactReport& soft) {
    const ContactReport own = report_;
    report_ = soft;
    report_.islands = own.islands;
    report_.islands_makeshift = own.islands_makeshift + soft.islands;
    report_.residual.add(own.residual);
  }

  ContactTick tick_;
  BodyArrays arrays_;
  ContactReport report_;
  ContactBalance balance_;
  BodyLines bodies_;
  TickIslands islands_;
  std::vector<Island> islands_in_;
  IslandSolver solver_;
  std::unique_ptr<ContactSolver> soft_ = make_soft_step();
  std::vector<std::uint8_t> is_solved_;  // by island
  std::vector<BodyLine> ways_, ends_;    // by number: velocities that move places; at the end
  std::vector<std::int32_t> moving_;
  std::vector<ContactConstraint> chosen_;
};

}  // namespace

std::unique_ptr<ContactSolver> make_newton_step() { return std::make_unique<NewtonStep>(kNewton); }
std::unique_ptr<ContactSolver> make_accurate_step() {
  return std::make_unique<NewtonStep>(kAccurate);
}

}  // namespace cradle
