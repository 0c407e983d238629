// Order: 1, of what is solved at once: x' = x + dt v'. What an island gets is its own: the order in
// which they are moved changes nothing.
#include "server/dynamics/contact/newton/island_step.h"

#include <algorithm>

#include "server/collision/index.h"
#include "server/dynamics/contact/single_contacts.h"

namespace cradle {
IslandStep::IslandStep(const IslandSettings& settings)
    : settings_(settings), solver_(settings), soft_(make_soft_solver()) {}

ContactReport IslandStep::advance(const ContactTick& tick, const BodyArrays& arrays,
                                  std::span<const Matrix> inverse_inertia_W,
                                  std::span<ContactConstraint* const> constraints) {
  report_ = {};
  if (constraints.empty()) return report_;
  tick_ = tick;
  give_ = settings_.is_always_exact ? 0 : tick.dt * tick.dt * settings_.yield;
  arrays_ = arrays;
  all_ = constraints;
  islands_.find(tick_, arrays_.x.size(), all_);
  report_.islands = static_cast<int>(islands_.count());
  fates_.assign(islands_.count(), Fate::soft);
  choose(inverse_inertia_W, all_);
  if (has(Fate::solved)) {
    list_solved();
    begin(tick, inverse_inertia_W);
    try_islands();
  }
  const bool are_soft = has(Fate::soft), are_solved = has(Fate::solved), rest = has(Fate::rests);
  if (are_soft && !are_solved && !rest) {
    add(soft_->advance_some(tick, arrays, inverse_inertia_W, all_, islands_, {}));
  } else if (are_solved && !are_soft && !rest) {
    finish(tick, all_);
  } else {
    finish_apart(inverse_inertia_W);
  }
  if (are_solved || rest) add_choice();
  end();
  return report_;
}

void IslandStep::add_choice() {
  report_.sub_steps_max = std::max(report_.sub_steps_max, 1);
  if (report_.choices_used == kSubStepChoices) return;
  SubStepChoice choice{1, static_cast<int>(std::ranges::count_if(fates_, is_at_once)), 0, 0};
  for (std::size_t k = 0; k < tick_.moving.size(); ++k) {
    choice.bodies += is_at_once(fates_[island_of_body(k)]) ? 1 : 0;
  }
  for (std::size_t k = 0; k < all_.size(); ++k) {
    if (!is_at_once(fates_[islands_.of_constraint(k)])) continue;
    choice.sag_m = std::max(choice.sag_m, sag_m(*all_[k]));
  }
  report_.sag_max_m = std::max(report_.sag_max_m, choice.sag_m);
  const auto first = report_.choices.begin(), end = first + report_.choices_used++;
  *end = choice;
  std::rotate(first, end, end + 1);
}

/// Of what rests elsewhere than it touches: as gap() has it (contact_constraint.h).
double IslandStep::sag_m(const ContactConstraint& c) const {
  double most = 0;
  for (const ConstraintPoint& p : c.used()) {
    if (p.force > 0) most = std::max(most, -c.rest(p).m + give_ * (c.load(p) - c.rest(p).load));
  }
  return most;
}

bool IslandStep::has(Fate fate) const { return std::ranges::find(fates_, fate) != fates_.end(); }

void IslandStep::list_solved() {
  islands_in_.resize(std::max(islands_in_.size(), islands_.count()));
  for (Island& island : islands_in_) {
    island.slots.clear();
    island.constraints.clear();
  }
  const BlockKernels& kernels = block_kernels_of(tick_.lanes);
  for (std::size_t i = 0; i < islands_.count(); ++i) islands_in_[i].H.use(kernels);
  for (std::size_t k = 0; k < tick_.moving.size(); ++k) {
    const std::size_t i = island_of_body(k);
    if (fates_[i] == Fate::solved) islands_in_[i].slots.push_back(tick_.moving[k]);
  }
  for (std::size_t k = 0; k < all_.size(); ++k) {
    const std::size_t i = islands_.of_constraint(k);
    if (fates_[i] == Fate::solved) islands_in_[i].constraints.push_back(all_[k]);
  }
}

void IslandStep::begin(const ContactTick& tick, std::span<const Matrix> inverse_inertia_W) {
  bodies_.begin(tick, arrays_, inverse_inertia_W);
  balance_ = {};
  if (tick.is_balanced) bodies_.begin_balance(balance_);
  bodies_.integrate_velocities(tick.dt, 0);
}

void IslandStep::try_islands() {
  ways_.resize(bodies_.lines());
  ends_.resize(bodies_.lines());
  for (std::size_t i = 0; i < islands_.count(); ++i) {
    if (fates_[i] != Fate::solved) continue;
    if (!solve(i)) {
      fates_[i] = Fate::soft;
      continue;
    }
    solver_.store(ways_, ends_);
    solver_.keep(report_.residual);
    keep(i);
    report_.islands_makeshift += solver_.is_exact() ? 0 : 1;
  }
}

/// Of all bodies that `bodies_` has.
void IslandStep::finish(const ContactTick& tick, std::span<ContactConstraint* const> constraints) {
  const auto set = [&](std::span<const BodyLine> velocities) {
    for (std::size_t k = 0; k < tick.moving.size(); ++k) {
      twist(bodies_.velocities()[k]) =
          twist(velocities[index(islands_.numbers()[index(tick.moving[k])])]);
    }
  };
  set(ways_);
  bodies_.integrate_positions(tick.dt, 0);
  set(ends_);
  if (tick.is_balanced) {
    bodies_.take_means(tick.dt);
    for (ContactConstraint* c : constraints) SingleContact(*c, bodies_).add_work(balance_);
    bodies_.end_balance(balance_, tick.dt);
    report_.balance.add(balance_);
  }
  for (ContactConstraint* c : constraints) c->torque = Vector::Zero();
  bodies_.finish();
  report_.body_sub_steps += static_cast<std::int64_t>(tick.moving.size());
}

/// Islands without a solution by the soft step, then the others by theirs.
void IslandStep::finish_apart(std::span<const Matrix> inverse_inertia_W) {
  if (has(Fate::soft)) {
    are_soft_.resize(fates_.size());
    std::ranges::transform(fates_, are_soft_.begin(),
                           [](Fate own) { return std::uint8_t{own == Fate::soft}; });
    add(soft_->advance_some(tick_, arrays_, inverse_inertia_W, all_, islands_, are_soft_));
  }
  if (!has(Fate::solved)) return;
  list_found();
  ContactTick tick = tick_;
  tick.moving = moving_;
  begin(tick, inverse_inertia_W);
  finish(tick, chosen_);
}

/// What islands that are solved have, in the tick's order.
void IslandStep::list_found() {
  moving_.clear();
  chosen_.clear();
  for (std::size_t k = 0; k < tick_.moving.size(); ++k) {
    if (fates_[island_of_body(k)] == Fate::solved) moving_.push_back(tick_.moving[k]);
  }
  for (std::size_t k = 0; k < all_.size(); ++k) {
    if (fates_[islands_.of_constraint(k)] == Fate::solved) chosen_.push_back(all_[k]);
  }
}

void IslandStep::add(const ContactReport& soft) {
  const ContactReport own = report_;
  report_ = soft;
  report_.islands = own.islands;
  report_.islands_makeshift = own.islands_makeshift;
  report_.islands_at_rest = own.islands_at_rest;
  report_.islands_by_newton = own.islands_by_newton;
  report_.islands_taken_over = own.islands_taken_over;
  report_.residual.add(own.residual);
}

}  // namespace cradle
