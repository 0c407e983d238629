// The contact solver "soft": bodies in contact by islands, each with the sub-steps that its loads
// and the tolerance ask for (demands.h).
//
// Loads are those of the tick before, as far as they last: see `press_after` (soft_batch.cpp). In
// an island that moves, nobody sees what contacts sink in if it is less than the way of its bodies
// in the tick: that much is allowed there, too, and a large heap in turmoil takes fewer sub-steps
// than its contacts are as stiff as. Islands with equal numbers go through the tick
// side by side, apart from those that relax by more than one sweep, because what they carry is not
// known (find_pasts), and those that rest (settling.h).
#include "server/dynamics/contact/soft_step.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <utility>

#include "server/collision/index.h"
#include "server/dynamics/contact/batch_step.h"
#include "server/dynamics/contact/demands.h"
#include "server/dynamics/contact/island_facts.h"
#include "server/dynamics/contact/settling.h"
#include "server/dynamics/contact/softness.h"

namespace cradle {
namespace {

/// An island may come to rest while its bodies go no farther in a tick, in the mean, than the speed
/// of one tick's fall takes them. Half of that, what they fall from rest, is no way of an island
/// that moves.
constexpr double kSlowTicks = 1, kSinkTicks = 0.5;
/// While they go farther than that part of it, many points may be preloaded, and large heaps are
/// solved in single precision (demands.h): what is nearly at rest is not to be kept in motion by
/// that (T2 of the benchmark after 10 s, T5 after 25 s).
constexpr double kPreloadTicks = 0.1;

/// Constraints that are worth a thread, of some tens of nanoseconds each.
constexpr int kSoftChunk = 64;

/// Contacts of a batch that one thread is to step alone: its passes take a microsecond or two.
constexpr std::size_t kSmallBatch = 64;

class SoftStep final : public SoftSolver {
 public:
  ContactReport advance(const ContactTick& tick, const BodyArrays& arrays,
                        std::span<const Matrix> inverse_inertia_W,
                        std::span<ContactConstraint* const> constraints) override {
    own_islands_.find(tick, arrays.x.size(), constraints);
    return advance_some(tick, arrays, inverse_inertia_W, constraints, own_islands_, {});
  }

  ContactReport advance_some(const ContactTick& tick, const BodyArrays& arrays,
                             std::span<const Matrix> inverse_inertia_W,
                             std::span<ContactConstraint* const> constraints,
                             const TickIslands& islands,
                             std::span<const std::uint8_t> which) override {
    report_ = {};
    if (constraints.empty()) return report_;
    islands_ = &islands;
    which_ = which;
    look_at_bodies(tick, arrays);
    look_at_contacts(*tick.executor, constraints, arrays, tick.dt);
    find_ways(tick.dt);
    find_pasts(tick, arrays, constraints);
    choose_sub_steps(tick, constraints);
    find_resting(tick, arrays, inverse_inertia_W, constraints);
    sort_by_batch(tick, arrays, constraints);
    step_batches(tick, arrays, inverse_inertia_W);
    PointResidual& most = report_.residual.most;
    most.natural_mps = std::max(most.natural_mps, settling_.unbalanced_mps());
    settling_.damp(tick, arrays, grouping(), is_calm_, report_.balance);
    return report_;
  }

 private:
  bool is_stepped(std::size_t island) const { return which_.empty() || which_[island] != 0; }
  std::size_t island_of_body(std::size_t k) const {
    return islands_->of(static_cast<std::int32_t>(k));
  }
  int size(std::size_t island) const { return islands_->sizes()[island]; }
  /// Calls `f(island, begin, end)` for runs of contacts, and of bodies, of those that are stepped.
  template <class F>
  void for_contacts(const F& f) const {
    for_runs(islands_->by_constraint(), of_stepped(f));
  }
  template <class F>
  void for_bodies(const F& f) const {
    for_runs(islands_->by_body(), of_stepped(f));
  }
  template <class F>
  auto of_stepped(const F& f) const {
    return [this, &f](std::size_t island, std::size_t begin, std::size_t end) {
      if (is_stepped(island)) f(island, begin, end);
    };
  }

  void look_at_bodies(const ContactTick& tick, const BodyArrays& arrays) {
    motions_.resize(tick.moving.size());
    for_each_index(*tick.executor, tick.moving.size(), kSoftChunk, [&](std::size_t k) {
      const std::size_t island = island_of_body(k);
      if (!is_stepped(island)) return;
      motions_[k] = motion_of(index(tick.moving[k]), arrays, tick.dt, size(island));
    });
  }

  void look_at_contacts(Executor& executor, std::span<ContactConstraint* const> constraints,
                        const BodyArrays& arrays, double dt) {
    looks_.resize(constraints.size());
    for_each_index(executor, constraints.size(), kSoftChunk, [&](std::size_t k) {
      if (!is_stepped(islands_->of_constraint(k))) return;
      expect_next(constraints, k);
      looks_[k] = look_of(*constraints[k], arrays, dt);
    });
    facts_.assign(islands_->count(), {});
    for_contacts([this](std::size_t island, std::size_t begin, std::size_t end) {
      facts_[island].add(std::span(looks_).subspan(begin, end - begin));
    });
  }

  /// How far an island's bodies go in the tick, in the mean, beyond what a start from rest gives.
  void find_ways(double dt) {
    for_bodies([this](std::size_t island, std::size_t begin, std::size_t end) {
      IslandFacts facts = facts_[island];
      for (std::size_t k = begin; k < end; ++k) facts.add(motions_[k]);
      facts_[island] = facts;
    });
    for (IslandFacts& facts : facts_) {
      const double fall = dt * dt * facts.acceleration;
      facts.is_slow = facts.way <= kSlowTicks * fall;
      facts.moves = facts.way > kPreloadTicks * fall;
      facts.relative_way /= std::max(facts.contacts, 1);
      const bool is_large = facts.contacts > kLargeHeap;
      facts.is_in_turmoil = is_large && facts.relative_way > kTurmoilTicks * fall;
      facts.in_floats = is_large && facts.moves && (facts.is_heap() || facts.points > kLargeHeap);
      facts.way = std::max(facts.way - kSinkTicks * fall, 0.0);
    }
  }

  /// Sweeps over blows with the arms of the tick's start would add energy ("small fast boxes"):
  /// where something closes, what contacts carry is taken to last.
  void find_pasts(const ContactTick& tick, const BodyArrays& arrays,
                  std::span<ContactConstraint* const> constraints) {
    for (const std::int32_t slot : tick.shaken) {
      const std::int32_t k = islands_->numbers()[index(slot)];
      if (k < 0) continue;
      Past& past = facts_[islands_->of(k)].past;
      if (past == Past::lasts) past = Past::changes;
    }
    bool all_last = true;
    for (std::size_t i = 0; i < facts_.size(); ++i) {
      if (!is_stepped(i)) continue;
      IslandFacts& facts = facts_[i];
      if (size(i) == 1 && facts.lies_askew) facts.past = Past::none;
      // Many that are pushed apart at once, a quarter of all contacts.
      if (facts.excess > 0 && size(i) > 2) facts.past = Past::parts;
      all_last &= facts.past == Past::lasts;
    }
    if (all_last) return;
    for_contacts([&](std::size_t island, std::size_t begin, std::size_t end) {
      IslandFacts& facts = facts_[island];
      const double slow = kRestTicks * tick.dt * facts.acceleration;
      for (std::size_t k = begin; k < end && facts.past != Past::lasts; ++k) {
        if (closing_speed(*constraints[k], arrays) > slow) facts.past = Past::lasts;
      }
    });
  }

  Grouping grouping() const { return {*islands_, islands_->numbers(), gives_, which_}; }

  /// Groups that stay as they are; and those that may come to rest, because nobody drives them.
  void find_resting(const ContactTick& tick, const BodyArrays& arrays,
                    std::span<const Matrix> inverse_inertia_W,
                    std::span<ContactConstraint* const> constraints) {
    settling_.find(tick, arrays, inverse_inertia_W, grouping(), constraints);
    is_calm_.resize(facts_.size());
    for (std::size_t i = 0; i < facts_.size(); ++i) {
      IslandFacts& facts = facts_[i];
      if (settling_.rests(i)) facts.past = Past::rests;
      const bool is_calm = facts.is_slow && facts.past != Past::changes;
      is_calm_[i] = is_calm && !facts.is_free && !facts.is_driven && is_stepped(i) ? 1 : 0;
    }
  }

  /// Of its two bodies: contacts of the same two are neighbours.
  bool is_only_one(std::size_t k) const {
    const auto is_as = [this](const ColouredPair& one, std::size_t other) {
      const ColouredPair& pair = islands_->bodies_of_constraint(other);
      return pair.a == one.a && pair.b == one.b;
    };
    const ColouredPair pair = islands_->bodies_of_constraint(k);
    return (k == 0 || !is_as(pair, k - 1)) && (k + 1 == looks_.size() || !is_as(pair, k + 1));
  }

  /// How many contacts of each island ask for each number of sub-steps. Of an island without a past
  /// loads are not known yet: then as if all its bodies lay on one of them.
  void count_demands(const ContactTick& tick) {
    asked_.resize(looks_.size());
    choices_.resize(looks_.size());
    are_points_.resize(looks_.size());
    const double whole = tick.dt / contact_angle();
    for_each_index(*tick.executor, looks_.size(), kSoftChunk, [&](std::size_t k) {
      const std::size_t island = islands_->of_constraint(k);
      const ContactLook& look = looks_[k];
      asked_[k] = 0;
      choices_[k] = kAsksForNone;
      are_points_[k] = 0;
      if (!is_stepped(island) || (!look.was_pressed && !look.is_met)) return;
      const IslandFacts& facts = facts_[island];
      const double tolerance_m = look.tolerance_m > 0 ? look.tolerance_m : tick.tolerance_m;
      const double square = whole * whole / std::max(tolerance_m, facts.way);
      double press = look.press;
      if (!facts.has_past) press *= size(island);
      asked_[k] = std::sqrt(square * press);
      choices_[k] = first_of_at_least(asked_[k]);
      are_points_[k] = facts.moves && look.is_single && is_only_one(k) ? 1 : 0;
    });
    for_contacts([this](std::size_t island, std::size_t begin, std::size_t end) {
      IslandFacts& facts = facts_[island];
      for (std::size_t k = begin; k < end; ++k) {
        ++facts.demands[choices_[k]];
        facts.of_points[choices_[k]] += are_points_[k];
        // What somebody asked for this very contact is not excused.
        if (looks_[k].tolerance_m > 0 && choices_[k] != kAsksForNone) {
          facts.least = std::max(facts.least, kSubSteps[choices_[k]]);
        }
      }
    });
  }

  void choose_sub_steps(const ContactTick& tick, std::span<ContactConstraint* const> constraints) {
    if (tick.sub_steps == 0) {
      count_demands(tick);
      for (std::size_t i = 0; i < facts_.size(); ++i) {
        if (!is_stepped(i)) continue;
        IslandFacts& facts = facts_[i];
        const Answer answer = answer_to(facts.demands, facts.of_points, facts.least);
        const bool takes_fewer = facts.is_in_turmoil && facts.past == Past::lasts;
        facts.stiff_as = answer.stiff_as;
        facts.sub_steps = takes_fewer ? sub_steps_in_turmoil(answer.stiff_as) : answer.stiff_as;
        facts.preload = answer.preload;
      }
      for_each_index(*tick.executor, constraints.size(), kSoftChunk, [&](std::size_t k) {
        const IslandFacts& facts = facts_[islands_->of_constraint(k)];
        if (asked_[k] <= facts.stiff_as || looks_[k].is_ahead) return;
        const double share = facts.stiff_as / asked_[k];
        constraints[k]->preload = std::min(1 - share * share, facts.preload);  // of few
      });
    } else {
      for (IslandFacts& facts : facts_) facts.stiff_as = facts.sub_steps = tick.sub_steps;
    }
    gives_.resize(facts_.size());
    for (std::size_t i = 0; i < facts_.size(); ++i) {
      if (!is_stepped(i)) continue;
      gives_[i] = give_of(facts_[i].stiff_as, tick.dt);
      report_.sub_steps_max = std::max(report_.sub_steps_max, facts_[i].sub_steps);
    }
  }

  /// Islands that go through the tick side by side, and where their bodies and constraints are in
  /// the lists that are sorted by batches.
  struct Batch {
    int sub_steps, stiff_as;
    Past past;
    bool in_floats;
    int islands;
    std::size_t moving, moving_end, chosen, chosen_end, special, special_end;
  };
  /// By choice, in either precision: one of each past, and one of what is in turmoil.
  static constexpr std::size_t kBatches = 2 * (kPasts.size() + 1);
  static std::size_t number(std::size_t choice, const IslandFacts& facts) {
    const bool takes_fewer = facts.sub_steps < facts.stiff_as;
    const auto kind = takes_fewer ? kPasts.size() : static_cast<std::size_t>(facts.past);
    return choice * kBatches + 2 * kind + (facts.in_floats ? 1 : 0);
  }

  void list_batches(const ContactTick& tick) {
    const std::span<const int> choices =
        tick.sub_steps > 0 ? std::span(&tick.sub_steps, 1) : std::span<const int>(kSubSteps);
    batches_.clear();
    for (const int n : choices) {
      const auto add = [&](int sub_steps, Past past) {
        for (const bool in_floats : {false, true})
          batches_.push_back({sub_steps, n, past, in_floats, 0, 0, 0, 0, 0, 0, 0});
      };
      for (const Past past : kPasts) add(n, past);
      add(sub_steps_in_turmoil(n), Past::lasts);
    }
    sizes_.clear();
    is_heap_.clear();
    for (std::size_t i = 0; i < facts_.size(); ++i) {
      if (!is_stepped(i)) continue;
      IslandFacts& facts = facts_[i];
      facts.number = sizes_.size();
      sizes_.push_back(size(i));
      is_heap_.push_back(facts.is_heap() ? 1 : 0);
      const auto choice = std::ranges::lower_bound(choices, facts.stiff_as) - choices.begin();
      facts.batch = number(static_cast<std::size_t>(choice), facts);
      Batch& batch = batches_[facts.batch];
      ++batch.islands;
      batch.moving_end += static_cast<std::size_t>(size(i));
      batch.chosen_end += static_cast<std::size_t>(facts.contacts);
      batch.special_end += static_cast<std::size_t>(facts.special);
    }
    std::size_t moving = 0, chosen = 0, special = 0;
    for (Batch& batch : batches_) {  // until now `_end` has a number, from here on the next place
      const auto take_place = [](std::size_t& begin, std::size_t& end, std::size_t& next) {
        begin = next;
        next += std::exchange(end, next);
      };
      take_place(batch.moving, batch.moving_end, moving);
      take_place(batch.chosen, batch.chosen_end, chosen);
      take_place(batch.special, batch.special_end, special);
    }
    report_.islands = static_cast<int>(sizes_.size());
    moving_.resize(moving);
    island_of_moving_.resize(moving);
    resting_.resize(moving);
    chosen_.resize(chosen);
    special_.resize(special);
  }

  void sort_by_batch(const ContactTick& tick, const BodyArrays& arrays,
                     std::span<ContactConstraint* const> constraints) {
    list_batches(tick);
    for_bodies([&](std::size_t island, std::size_t begin, std::size_t end) {
      const IslandFacts& facts = facts_[island];
      const bool may_rest = size(island) > 1 && facts.is_slow;
      std::size_t at = batches_[facts.batch].moving_end;
      for (std::size_t k = begin; k < end; ++k, ++at) {
        moving_[at] = tick.moving[k];
        island_of_moving_[at] = static_cast<std::int32_t>(facts.number);
        resting_[at] = may_rest && motions_[k].is_slow ? 1 : 0;
      }
      batches_[facts.batch].moving_end = at;
    });
    if (!arrays.poise.empty()) {
      for_each_index(*tick.executor, motions_.size(), kSoftChunk, [&](std::size_t k) {
        const std::size_t island = island_of_body(k);
        if (!is_stepped(island)) return;
        arrays.poise[index(tick.moving[k])].stiff_as = facts_[island].stiff_as;
      });
    }
    for_contacts([&](std::size_t island, std::size_t begin, std::size_t end) {
      Batch& batch = batches_[facts_[island].batch];
      std::size_t& to = batch.chosen_end;
      std::copy(constraints.begin() + static_cast<std::ptrdiff_t>(begin),
                constraints.begin() + static_cast<std::ptrdiff_t>(end),
                chosen_.begin() + static_cast<std::ptrdiff_t>(to));
      to += end - begin;
      if (facts_[island].special == 0) return;
      for (std::size_t k = begin; k < end; ++k) {
        if (looks_[k].is_special) special_[batch.special_end++] = constraints[k];
      }
    });
  }

  /// Those with many contacts one after the other, each by all threads; those with few, of which a
  /// falling heap has several, side by side, the longest first.
  void step_batches(ContactTick tick, const BodyArrays& arrays,
                    std::span<const Matrix> inverse_inertia_W) {
    tick.islands_count = sizes_.size();
    tick.heaps = is_heap_;
    const auto step = [&](BatchStep& by, std::size_t k, Executor& executor) {
      ContactTick own = tick;
      own.executor = &executor;
      results_[k] = by.advance(stepped(batches_[k]), own, arrays, inverse_inertia_W, sizes_);
    };
    results_.resize(batches_.size());
    small_.clear();
    for (std::size_t k = 0; k < batches_.size(); ++k) {
      const Batch& batch = batches_[k];
      if (batch.islands == 0) continue;
      if (batch.chosen_end - batch.chosen <= kSmallBatch) {
        small_.push_back(k);
      } else {
        step(steps_[0], k, *tick.executor);
      }
    }
    std::ranges::sort(small_, std::greater(), [this](std::size_t k) {
      return sweeps_of(batches_[k].past, batches_[k].sub_steps);
    });
    const auto small = static_cast<int>(small_.size());
    const std::size_t hands = tick.executor->threads() > 1 ? small_.size() : 1;
    if (steps_.size() < hands) steps_.resize(hands);
    tick.executor->for_ranges(small, 1, [&](int begin, int end) {
      SerialExecutor here;
      for (int n = begin; n < end; ++n) step(steps_[index(begin)], small_[index(n)], here);
    });
    for (std::size_t k = 0; k < batches_.size(); ++k) {
      if (batches_[k].islands > 0) add(batches_[k], results_[k]);
    }
  }

  BatchStep::Batch stepped(const Batch& batch) {
    const auto part = [](auto& all, std::size_t begin, std::size_t end) {
      return std::span(all).subspan(begin, end - begin);
    };
    return {batch.sub_steps,
            batch.stiff_as,
            batch.in_floats,
            batch.past,
            part(moving_, batch.moving, batch.moving_end),
            part(island_of_moving_, batch.moving, batch.moving_end),
            part(resting_, batch.moving, batch.moving_end),
            part(chosen_, batch.chosen, batch.chosen_end),
            part(special_, batch.special, batch.special_end)};
  }

  void add(const Batch& batch, const BatchResult& result) {
    const auto bodies = static_cast<int>(batch.moving_end - batch.moving);
    SubStepChoice& choice = choice_of(batch.sub_steps);
    choice.islands += batch.islands;
    choice.bodies += bodies;
    choice.sag_m = std::max(choice.sag_m, result.sag_m);
    report_.sag_max_m = std::max(report_.sag_max_m, choice.sag_m);
    if (batch.past == Past::rests) return;
    report_.impacts_ordered += result.impacts_ordered;
    report_.paid_J += result.paid_J;
    report_.residual.add(result.residual);
    report_.balance.add(result.balance);
    report_.body_sub_steps += std::int64_t{batch.sub_steps} * bodies;
  }

  /// In the report, where they ascend.
  SubStepChoice& choice_of(int n) {
    const auto begin = report_.choices.begin(), end = begin + report_.choices_used;
    const auto place = std::ranges::lower_bound(begin, end, n, {}, &SubStepChoice::sub_steps);
    if (place != end && place->sub_steps == n) return *place;
    assert(report_.choices_used < kSubStepChoices);
    ++report_.choices_used;
    std::move_backward(place, end, end + 1);
    return *place = {n, 0, 0, 0};
  }

  ContactReport report_;
  TickIslands own_islands_;
  const TickIslands* islands_ = nullptr;
  std::span<const std::uint8_t> which_;                       // islands
  std::vector<BatchStep> steps_ = std::vector<BatchStep>(1);  // of those side by side
  Settling settling_;
  std::vector<BodyMotion> motions_;  // by body, in the order of the tick's
  // By constraint:
  std::vector<ContactLook> looks_;
  std::vector<double> asked_;             // sub-steps
  std::vector<std::uint8_t> choices_;     // of kSubSteps, or none
  std::vector<std::uint8_t> are_points_;  // single, and their bodies', in an island that moves
  // By island:
  std::vector<IslandFacts> facts_;
  std::vector<std::uint8_t> is_calm_;
  std::vector<double> gives_;  // s^2
  // By number of those that are stepped:
  std::vector<int> sizes_;  // bodies
  std::vector<std::uint8_t> is_heap_;
  // By batch:
  std::vector<Batch> batches_;
  std::vector<BatchResult> results_;
  std::vector<std::size_t> small_;  // which of them are
  // Sorted by batch; bodies, in it, by domain.
  std::vector<std::int32_t> moving_;
  std::vector<std::int32_t> island_of_moving_;
  std::vector<std::uint8_t> resting_;
  std::vector<ContactConstraint*> chosen_, special_;
};

}  // namespace

std::unique_ptr<ContactSolver> make_soft_step() { return std::make_unique<SoftStep>(); }
std::unique_ptr<SoftSolver> make_soft_solver() { return std::make_unique<SoftStep>(); }

}  // namespace cradle
