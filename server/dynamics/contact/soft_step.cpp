// The contact solver "soft": bodies in contact by islands, each with the sub-steps that its loads
// and the tolerance ask for.
//
// A contact at rest sinks in until its spring carries its load: s = a / omega^2, with a the
// acceleration that the load would give to the contact's effective mass, and omega = 2 pi c / h
// (soft_batch.cpp). For s <= tolerance:  n = dt / (2 pi c) sqrt(a / tolerance).
// Loads are those of the tick before, as far as they last: see `press_after`. In an island that
// moves, nobody sees what contacts sink in if it is less than the way of its bodies in the tick:
// that much is allowed there, too. Two contacts in a thousand of an island are not asked: on
// terrain with 3000 bodies the most loaded one would have 27 sub-steps taken in the mean where 15
// do for the others. Islands with equal numbers go through the tick side by side. Source: measured
// sag, within 1 % of the law for stacks and heavy bodies on light ones; the numbers are rounded up
// to a few, so that lanes are filled.
#include "server/dynamics/contact/soft_step.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "server/dynamics/contact/islands.h"
#include "server/dynamics/contact/soft_batch.h"

namespace cradle {
namespace {

constexpr std::array kSubSteps{4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56, 64};
static_assert(kSubSteps.size() <= kSubStepChoices);

/// Contacts of an island that ask for so many sub-steps each.
using Demands = std::array<int, kSubSteps.size()>;

/// In a large heap a few contacts carry many times what the others do; one in so many of an
/// island's contacts may sink in deeper than the tolerance.
constexpr int kContactsPerExcused = 500;

/// A load that lasts grows by this factor a tick at most: a blow is none. Weights are felt in full
/// after a few ticks.
constexpr double kPressGrowth = 1.5;
/// And falls by this one, but not to less than kPressExcess times what it is: sub-steps that change
/// move what rests, which changes loads ("in the plane a stack of ten boxes").
constexpr double kPressDecay = 0.99;
constexpr double kPressExcess = 1.1;

/// An island is at rest, or nearly, while its bodies are no faster in the mean than so many ticks
/// of its acceleration make them: what sinks in at first is not faster ("a tonne on ten cubes").
constexpr double kRestTicks = 2;

std::size_t index(std::int32_t i) { return static_cast<std::size_t>(i); }

class SoftStep final : public ContactSolver {
 public:
  ContactReport advance(const ContactTick& tick, const BodyArrays& arrays,
                        std::span<const Matrix> inverse_inertia_W,
                        std::span<ContactConstraint> constraints) override {
    report_ = {};
    if (constraints.empty()) return report_;
    find_islands(tick, arrays.x.size(), constraints);
    choose_sub_steps(tick, arrays, constraints);
    if (tick.sub_steps > 0) {
      advance_islands_with(tick.sub_steps, tick, arrays, inverse_inertia_W, constraints);
      return report_;
    }
    for (const int n : kSubSteps) {
      advance_islands_with(n, tick, arrays, inverse_inertia_W, constraints);
    }
    return report_;
  }

 private:
  void find_islands(const ContactTick& tick, std::size_t slots,
                    std::span<const ContactConstraint> constraints) {
    number_.assign(slots, -1);
    for (std::size_t k = 0; k < tick.moving.size(); ++k) {
      number_[index(tick.moving[k])] = static_cast<std::int32_t>(k);
    }
    pairs_.clear();
    for (const ContactConstraint& c : constraints) {
      pairs_.push_back({number_[index(c.a)], number_[index(c.b)]});
    }
    number_of_bodies_ = tick.moving.size();
    islands_.find(pairs_, number_of_bodies_);
    report_.islands = static_cast<int>(islands_.count());
  }

  std::size_t island_of(const ColouredPair& pair) const {
    return islands_.of(pair.a >= 0 ? pair.a : pair.b);
  }

  /// Sizes of islands, and whether they have been pressed before.
  void look_at_islands(std::span<const ContactConstraint> constraints) {
    has_past_.assign(islands_.count(), 0);
    sizes_.assign(islands_.count(), 0);
    for (std::size_t k = 0; k < number_of_bodies_; ++k) {
      ++sizes_[islands_.of(static_cast<std::int32_t>(k))];
    }
    for (std::size_t k = 0; k < constraints.size(); ++k) {
      has_past_[island_of(pairs_[k])] |= constraints[k].press > 0;
    }
  }

  /// How far an island's bodies go in the tick, in the mean, beyond what a start from rest gives.
  void find_ways(const ContactTick& tick, const BodyArrays& arrays) {
    ways_.assign(islands_.count(), 0);
    accelerations_.assign(islands_.count(), 0);
    for (std::size_t k = 0; k < number_of_bodies_; ++k) {
      const std::size_t island = islands_.of(static_cast<std::int32_t>(k));
      const std::size_t slot = index(tick.moving[k]);
      ways_[island] += tick.dt * arrays.v[slot].norm() / sizes_[island];
      accelerations_[island] = std::max(accelerations_[island], arrays.acceleration[slot].norm());
    }
    for (std::size_t i = 0; i < ways_.size(); ++i) {
      ways_[i] = std::max(ways_[i] - kRestTicks * tick.dt * tick.dt * accelerations_[i], 0.0);
    }
  }

  /// As if the heavier body lay on the lighter one.
  static double first_press(const ContactConstraint& c, const BodyArrays& arrays) {
    const double a = arrays.acceleration[index(c.a)].norm(),
                 b = arrays.acceleration[index(c.b)].norm();
    const double lighter = std::max(c.inverse_mass_A, c.inverse_mass_B);
    const double heavier = std::min(c.inverse_mass_A, c.inverse_mass_B);
    return std::max(a, b) * (heavier > 0 ? 1 + lighter / heavier : 1);
  }

  /// How many contacts of each island ask for each number of sub-steps. Of an island without a past
  /// loads are not known yet: then as if all its bodies lay on one of them.
  void count_demands(const ContactTick& tick, const BodyArrays& arrays,
                     std::span<const ContactConstraint> constraints) {
    demands_.assign(islands_.count(), {});
    least_.assign(islands_.count(), 0);
    const double whole = tick.dt / contact_angle();
    for (std::size_t k = 0; k < constraints.size(); ++k) {
      const std::size_t island = island_of(pairs_[k]);
      const ContactConstraint& c = constraints[k];
      const double tolerance_m = c.tolerance_m > 0 ? c.tolerance_m : tick.tolerance_m;
      const double square = whole * whole / std::max(tolerance_m, ways_[island]);
      if (c.press == 0 && !c.is_met) continue;
      double press = c.press > 0 ? c.press : first_press(c, arrays);
      if (has_past_[island] == 0) press *= sizes_[island];
      std::size_t choice = 0;
      while (choice + 1 < kSubSteps.size() &&
             kSubSteps[choice] * kSubSteps[choice] < square * press) {
        ++choice;
      }
      ++demands_[island][choice];
      // What somebody asked for this very contact is not excused.
      if (c.tolerance_m > 0) least_[island] = std::max(least_[island], kSubSteps[choice]);
    }
  }

  /// What all contacts of an island ask for but the few that are excused.
  static int enough_for(const Demands& demands) {
    int excused = std::accumulate(demands.begin(), demands.end(), 0) / kContactsPerExcused;
    std::size_t choice = kSubSteps.size() - 1;
    while (choice > 0 && demands[choice] <= excused) excused -= demands[choice--];
    return kSubSteps[choice];
  }

  void choose_sub_steps(const ContactTick& tick, const BodyArrays& arrays,
                        std::span<const ContactConstraint> constraints) {
    sub_steps_.assign(islands_.count(), tick.sub_steps);
    if (tick.sub_steps == 0) {
      look_at_islands(constraints);
      find_ways(tick, arrays);
      count_demands(tick, arrays, constraints);
      for (std::size_t i = 0; i < demands_.size(); ++i) {
        sub_steps_[i] = std::max(enough_for(demands_[i]), least_[i]);
      }
    }
    report_.sub_steps_max = std::ranges::max(sub_steps_);
  }

  void advance_islands_with(int n, ContactTick tick, const BodyArrays& arrays,
                            std::span<const Matrix> inverse_inertia_W,
                            std::span<ContactConstraint> constraints) {
    if (std::ranges::find(sub_steps_, n) == sub_steps_.end()) return;
    moving_.clear();
    for (std::size_t k = 0; k < tick.moving.size(); ++k) {
      if (sub_steps_[islands_.of(static_cast<std::int32_t>(k))] == n) {
        moving_.push_back(tick.moving[k]);
      }
    }
    chosen_.clear();
    for (std::size_t k = 0; k < constraints.size(); ++k) {
      if (sub_steps_[island_of(pairs_[k])] == n) chosen_.push_back(&constraints[k]);
    }
    tick.sub_steps = n;
    tick.moving = moving_;
    batch_.advance(tick, arrays, inverse_inertia_W, chosen_);
    report_.impacts_ordered += batch_.impacts_ordered();
    report_.residual.add(batch_.residual());
    report_.balance.add(batch_.balance());
    report_.body_sub_steps += n * static_cast<std::int64_t>(moving_.size());
    const double h = tick.dt / (n * contact_angle());
    SubStepChoice& choice = report_.choices[report_.choices_used++];
    choice = {n, 0, static_cast<int>(moving_.size()), 0};
    choice.islands = static_cast<int>(std::ranges::count(sub_steps_, n));
    for (ContactConstraint* c : chosen_) {
      for (ConstraintPoint& p : c->used()) {
        p.press = press_after(p);
        choice.sag_m = std::max(choice.sag_m, h * h * std::min(p.press, p.force * p.K_normal));
      }
    }
    report_.sag_max_m = std::max(report_.sag_max_m, choice.sag_m);
  }

  static double press_after(const ConstraintPoint& p) {
    const double now = p.force * p.K_normal;
    if (p.press == 0) return now;
    const double low = std::min(p.press, std::max(kPressDecay * p.press, kPressExcess * now));
    return std::clamp(now, low, kPressGrowth * p.press);
  }

  ContactReport report_;
  Islands islands_;
  SoftBatch batch_;
  std::vector<std::int32_t> number_;  // by slot: among the moving bodies, or -1
  std::vector<ColouredPair> pairs_;   // of constraints, by numbers
  std::size_t number_of_bodies_ = 0;
  std::vector<double> ways_, accelerations_;  // m, m/s^2, by island
  std::vector<Demands> demands_;              // by island
  std::vector<int> least_;                    // sub-steps, by island
  std::vector<std::uint8_t> has_past_;
  std::vector<int> sizes_;      // bodies, by island
  std::vector<int> sub_steps_;  // by island
  std::vector<std::int32_t> moving_;
  std::vector<ContactConstraint*> chosen_;
};

}  // namespace

std::unique_ptr<ContactSolver> make_soft_step() { return std::make_unique<SoftStep>(); }

}  // namespace cradle
