// The contact solver "soft": bodies in contact by islands, each with the sub-steps that its loads
// and the tolerance ask for (demands.h).
//
// Loads are those of the tick before, as far as they last: see `press_after` (soft_batch.cpp). In
// an island that moves, nobody sees what contacts sink in if it is less than the way of its bodies
// in the tick: that much is allowed there, too. Islands with equal numbers go through the tick side
// by side, apart from those that relax by more than one sweep, because what they carry is not known
// (find_pasts), and those that rest (settling.h).
#include "server/dynamics/contact/soft_step.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "server/collision/index.h"
#include "server/dynamics/contact/batch_step.h"
#include "server/dynamics/contact/demands.h"
#include "server/dynamics/contact/settling.h"
#include "server/dynamics/contact/softness.h"

namespace cradle {
namespace {

/// An island is at rest, or nearly, while its bodies are no faster in the mean than so many ticks
/// of its acceleration make them: what sinks in at first is not faster (A8b of the benchmark).
constexpr double kRestTicks = 2;
/// It may come to rest while they go no farther in a tick, in the mean, than the speed of one
/// tick's fall takes them. Half of that, what they fall from rest, is no way of an island that
/// moves.
constexpr double kSlowTicks = 1, kSinkTicks = 0.5;

/// Of an island's contacts that carry, one in so many may do so on some of its points only: of two
/// blocks in three one then does, and all that was done for points together was in vain (T2 of the
/// benchmark).
constexpr int kCarryPerAskew = kBlockLanes;
/// But for so many of them: the points of a few bodies are solved together in any case.
constexpr int kFewAskew = 2 * kBlockLanes;

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
  /// What there is to know of each body by itself, when the tick begins.
  struct Motion {
    double speed_mps, acceleration;
    bool is_slow;  // no faster than kRestTicks make it
    bool is_free;  // as Poise has it
  };
  /// Likewise of a constraint.
  struct Look {
    double press, tolerance_m;  // of the constraint; m/s^2: or what it may be at first
    bool was_pressed, is_met, is_known, is_askew, is_deep, is_driven, has_rested, is_ahead;
    bool is_point;  // not an edge, nor a face
  };
  /// And of an island.
  struct Facts {
    int contacts = 0;
    int excess = 0;                           // of deep contacts over others
    int askew = -kFewAskew * kCarryPerAskew;  // contacts that are, over the rest
    int points = 0;                           // likewise
    bool has_past = false, lies_askew = false, is_slow = false, is_driven = false;
    bool is_free = false;  // a body of it is
    Past past = Past::none;
    double way = 0;  // m, in the tick, in the mean
    double acceleration = 0;
    Demands demands{};
    int least = 0;  // sub-steps
    int sub_steps = 0;
    double preload = 0;  // the most there is
    std::size_t batch = 0;
  };

  bool is_stepped(std::size_t island) const { return which_.empty() || which_[island] != 0; }
  Facts& facts_of(std::size_t constraint) { return facts_[islands_->of_constraint(constraint)]; }
  std::size_t island_of_body(std::size_t k) const {
    return islands_->of(static_cast<std::int32_t>(k));
  }

  void look_at_bodies(const ContactTick& tick, const BodyArrays& arrays) {
    motions_.resize(tick.moving.size());
    for_each_index(*tick.executor, tick.moving.size(), kSoftChunk, [&](std::size_t k) {
      if (!is_stepped(island_of_body(k))) return;
      const std::size_t slot = index(tick.moving[k]);
      const double acceleration = arrays.acceleration[slot].norm();
      const double slow = kRestTicks * tick.dt * acceleration;
      motions_[k] = {arrays.v[slot].norm(), acceleration,
                     arrays.v[slot].squaredNorm() <= slow * slow,
                     !arrays.poise.empty() && arrays.poise[slot].free > 0};
    });
    sizes_.assign(islands_->count(), 0);
    for (std::size_t k = 0; k < motions_.size(); ++k) ++sizes_[island_of_body(k)];
  }

  void look_at_contacts(Executor& executor, std::span<ContactConstraint* const> constraints,
                        const BodyArrays& arrays, double dt) {
    const double deep_m = push_speed() * dt;
    const auto is_driven = [&](std::int32_t slot) {
      return islands_->numbers()[index(slot)] < 0 &&
             !(arrays.v[index(slot)].isZero(0) && arrays.w[index(slot)].isZero(0));
    };
    looks_.resize(constraints.size());
    for_each_index(executor, constraints.size(), kSoftChunk, [&](std::size_t k) {
      if (!is_stepped(islands_->of_constraint(k))) return;
      expect_next(constraints, k);
      const ContactConstraint& c = *constraints[k];
      looks_[k] = {c.press > 0 ? c.press : first_press(c, arrays),
                   c.tolerance_m,
                   c.press > 0,
                   c.is_met,
                   c.is_known,
                   c.carrying > 0 && c.carrying<c.count, c.deepest_m> deep_m,
                   is_driven(c.a) || is_driven(c.b),
                   c.has_rested,
                   c.is_ahead,
                   c.count == 1};
    });
    facts_.assign(islands_->count(), {});
    has_rested_ = false;
    for (std::size_t k = 0; k < looks_.size(); ++k) {
      const std::size_t island = islands_->of_constraint(k);
      if (!is_stepped(island)) continue;
      add(looks_[k], facts_[island]);
      has_rested_ |= looks_[k].has_rested;
    }
    is_heap_.resize(facts_.size());
    std::ranges::transform(facts_, is_heap_.begin(),
                           [](const Facts& facts) { return std::uint8_t{facts.askew > 0}; });
  }

  static void add(const Look& look, Facts& facts) {
    ++facts.contacts;
    facts.has_past |= look.was_pressed;
    if (look.is_known) facts.past = Past::lasts;
    facts.lies_askew |= look.is_askew;
    facts.is_driven |= look.is_driven;
    facts.askew += (look.is_askew ? kCarryPerAskew : 0) - (look.was_pressed ? 1 : 0);
    facts.points += look.was_pressed ? (look.is_point ? 1 : -1) : 0;
    facts.excess += look.is_deep ? 3 : -1;
  }

  /// How far an island's bodies go in the tick, in the mean, beyond what a start from rest gives.
  void find_ways(double dt) {
    for (std::size_t k = 0; k < motions_.size(); ++k) {
      const std::size_t island = island_of_body(k);
      if (!is_stepped(island)) continue;
      Facts& facts = facts_[island];
      facts.way += dt * motions_[k].speed_mps / sizes_[island];
      facts.acceleration = std::max(facts.acceleration, motions_[k].acceleration);
      facts.is_free |= motions_[k].is_free;
    }
    for (Facts& facts : facts_) {
      const double fall = dt * dt * facts.acceleration;
      facts.is_slow = facts.way <= kSlowTicks * fall;
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
      Facts& facts = facts_[i];
      if (sizes_[i] == 1 && facts.lies_askew) facts.past = Past::none;
      // Many that are pushed apart at once, a quarter of all contacts.
      if (facts.excess > 0 && sizes_[i] > 2) facts.past = Past::parts;
      all_last &= facts.past == Past::lasts;
    }
    if (all_last) return;
    for (std::size_t k = 0; k < constraints.size(); ++k) {
      const std::size_t island = islands_->of_constraint(k);
      Facts& facts = facts_[island];
      if (facts.past == Past::lasts || !is_stepped(island)) continue;
      const double slow = kRestTicks * tick.dt * facts.acceleration;
      if (closing_speed(*constraints[k], arrays) > slow) facts.past = Past::lasts;
    }
  }

  Grouping grouping() const { return {*islands_, islands_->numbers(), gives_, which_}; }

  /// Groups that stay as they are; and those that may come to rest, because nobody drives them.
  void find_resting(const ContactTick& tick, const BodyArrays& arrays,
                    std::span<const Matrix> inverse_inertia_W,
                    std::span<ContactConstraint* const> constraints) {
    settling_.find(tick, arrays, inverse_inertia_W, grouping(), constraints);
    is_calm_.resize(facts_.size());
    for (std::size_t i = 0; i < facts_.size(); ++i) {
      Facts& facts = facts_[i];
      if (settling_.rests(i)) facts.past = Past::rests;
      const bool is_calm = facts.is_slow && facts.past != Past::changes;
      is_calm_[i] = is_calm && !facts.is_free && !facts.is_driven && is_stepped(i) ? 1 : 0;
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
  void count_demands(const ContactTick& tick) {
    asked_.resize(looks_.size());
    choices_.resize(looks_.size());
    const double whole = tick.dt / contact_angle();
    for_each_index(*tick.executor, looks_.size(), kSoftChunk, [&](std::size_t k) {
      const std::size_t island = islands_->of_constraint(k);
      const Look& look = looks_[k];
      asked_[k] = 0;
      choices_[k] = kNoChoice;
      if (!is_stepped(island) || (!look.was_pressed && !look.is_met)) return;
      const Facts& facts = facts_[island];
      const double tolerance_m = look.tolerance_m > 0 ? look.tolerance_m : tick.tolerance_m;
      const double square = whole * whole / std::max(tolerance_m, facts.way);
      double press = look.press;
      if (!facts.has_past) press *= sizes_[island];
      asked_[k] = std::sqrt(square * press);
      choices_[k] = first_of_at_least(asked_[k]);
    });
    for (std::size_t k = 0; k < looks_.size(); ++k) {
      if (choices_[k] == kNoChoice) continue;
      Facts& facts = facts_of(k);
      ++facts.demands[choices_[k]];
      // What somebody asked for this very contact is not excused.
      if (looks_[k].tolerance_m > 0) {
        facts.least = std::max(facts.least, kSubSteps[choices_[k]]);
      }
    }
  }

  void choose_sub_steps(const ContactTick& tick, std::span<ContactConstraint* const> constraints) {
    if (tick.sub_steps == 0) {
      count_demands(tick);
      for (Facts& facts : facts_) {
        const Answer answer = answer_to(facts.demands, facts.least, facts.points > 0);
        facts.sub_steps = answer.sub_steps;
        facts.preload = answer.preload;
      }
      for_each_index(*tick.executor, constraints.size(), kSoftChunk, [&](std::size_t k) {
        const Facts& facts = facts_of(k);
        if (asked_[k] <= facts.sub_steps || looks_[k].is_ahead) return;
        const double share = facts.sub_steps / asked_[k];
        constraints[k]->preload = std::min(1 - share * share, facts.preload);  // of few
      });
    } else {
      for (Facts& facts : facts_) facts.sub_steps = tick.sub_steps;
    }
    gives_.resize(facts_.size());
    for (std::size_t i = 0; i < facts_.size(); ++i) {
      gives_[i] = give_of(facts_[i].sub_steps, tick.dt);
      if (!is_stepped(i)) continue;
      report_.sub_steps_max = std::max(report_.sub_steps_max, facts_[i].sub_steps);
    }
  }

  /// Islands that go through the tick side by side, and where their bodies and constraints are in
  /// the lists that are sorted by batches.
  struct Batch {
    int sub_steps;
    Past past;
    int islands;
    std::size_t moving, moving_end, chosen, chosen_end;
  };
  static std::size_t number(std::size_t choice, Past past) {
    return choice * kPasts.size() + static_cast<std::size_t>(past);
  }

  void list_batches(const ContactTick& tick) {
    const std::span<const int> choices =
        tick.sub_steps > 0 ? std::span(&tick.sub_steps, 1) : std::span<const int>(kSubSteps);
    batches_.clear();
    for (const int n : choices) {
      for (const Past past : kPasts) batches_.push_back({n, past, 0, 0, 0, 0, 0});
    }
    for (std::size_t i = 0; i < facts_.size(); ++i) {
      if (!is_stepped(i)) continue;
      Facts& facts = facts_[i];
      const auto choice = std::ranges::lower_bound(choices, facts.sub_steps) - choices.begin();
      facts.batch = number(static_cast<std::size_t>(choice), facts.past);
      Batch& batch = batches_[facts.batch];
      ++batch.islands;
      batch.moving_end += static_cast<std::size_t>(sizes_[i]);
      batch.chosen_end += static_cast<std::size_t>(facts.contacts);
    }
    report_.islands = 0;
    std::size_t moving = 0, chosen = 0;
    for (Batch& batch : batches_) {  // until now `_end` has a number, from here on the next place
      report_.islands += batch.islands;
      batch.moving = std::exchange(batch.moving_end, moving);
      moving += batch.moving;
      batch.moving = batch.moving_end;
      batch.chosen = std::exchange(batch.chosen_end, chosen);
      chosen += batch.chosen;
      batch.chosen = batch.chosen_end;
    }
    moving_.resize(moving);
    island_of_moving_.resize(moving);
    resting_.resize(moving);
    chosen_.resize(chosen);
  }

  void sort_by_batch(const ContactTick& tick, const BodyArrays& arrays,
                     std::span<ContactConstraint* const> constraints) {
    list_batches(tick);
    for (std::size_t k = 0; k < motions_.size(); ++k) {
      const std::size_t island = island_of_body(k);
      if (!is_stepped(island)) continue;
      const Facts& facts = facts_[island];
      const std::size_t at = batches_[facts.batch].moving_end++;
      moving_[at] = tick.moving[k];
      island_of_moving_[at] = static_cast<std::int32_t>(island);
      resting_[at] = sizes_[island] > 1 && facts.is_slow && motions_[k].is_slow ? 1 : 0;
    }
    if (!arrays.poise.empty()) {
      for_each_index(*tick.executor, motions_.size(), kSoftChunk, [&](std::size_t k) {
        const std::size_t island = island_of_body(k);
        if (!is_stepped(island)) return;
        arrays.poise[index(tick.moving[k])].sub_steps = facts_[island].sub_steps;
      });
    }
    for (std::size_t k = 0; k < constraints.size(); ++k) {
      const std::size_t island = islands_->of_constraint(k);
      if (!is_stepped(island)) continue;
      chosen_[batches_[facts_[island].batch].chosen_end++] = constraints[k];
    }
  }

  /// Those with many contacts one after the other, each by all threads; those with few, of which a
  /// falling heap has several, side by side.
  void step_batches(ContactTick tick, const BodyArrays& arrays,
                    std::span<const Matrix> inverse_inertia_W) {
    tick.islands_count = islands_->count();
    tick.heaps = is_heap_;
    const auto step = [&](BatchStep& by, std::size_t k, Executor& executor) {
      ContactTick own = tick;
      own.executor = &executor;
      results_[k] =
          by.advance(stepped(batches_[k]), own, arrays, inverse_inertia_W, sizes_, has_rested_);
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
    const std::size_t hands = std::min(index(tick.executor->threads()), small_.size());
    if (steps_.size() < hands) steps_.resize(hands);
    for_each_index(*tick.executor, hands, 1, [&](std::size_t hand) {
      SerialExecutor here;
      for (std::size_t n = hand; n < small_.size(); n += hands) step(steps_[hand], small_[n], here);
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
            batch.past,
            part(moving_, batch.moving, batch.moving_end),
            part(island_of_moving_, batch.moving, batch.moving_end),
            part(resting_, batch.moving, batch.moving_end),
            part(chosen_, batch.chosen, batch.chosen_end)};
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

  SubStepChoice& choice_of(int n) {
    const std::size_t used = report_.choices_used;
    if (used > 0 && report_.choices[used - 1].sub_steps == n) return report_.choices[used - 1];
    SubStepChoice& choice = report_.choices[report_.choices_used++];
    choice = {n, 0, 0, 0};
    return choice;
  }

  static constexpr std::uint8_t kNoChoice = 255;

  ContactReport report_;
  TickIslands own_islands_;
  const TickIslands* islands_ = nullptr;
  std::span<const std::uint8_t> which_;                       // islands
  std::vector<BatchStep> steps_ = std::vector<BatchStep>(1);  // one a thread
  Settling settling_;
  bool has_rested_ = false;      // a constraint has, anywhere
  std::vector<Motion> motions_;  // by body, in the order of the tick's
  // By constraint:
  std::vector<Look> looks_;
  std::vector<double> asked_;          // sub-steps
  std::vector<std::uint8_t> choices_;  // of kSubSteps
  // By island:
  std::vector<Facts> facts_;
  std::vector<int> sizes_;  // bodies
  std::vector<std::uint8_t> is_heap_, is_calm_;
  std::vector<double> gives_;  // s^2
  // By batch:
  std::vector<Batch> batches_;
  std::vector<BatchResult> results_;
  std::vector<std::size_t> small_;  // which of them are
  // Sorted by batch; bodies, in it, by domain.
  std::vector<std::int32_t> moving_;
  std::vector<std::int32_t> island_of_moving_;
  std::vector<std::uint8_t> resting_;
  std::vector<ContactConstraint*> chosen_;
};

}  // namespace

std::unique_ptr<ContactSolver> make_soft_step() { return std::make_unique<SoftStep>(); }
std::unique_ptr<SoftSolver> make_soft_solver() { return std::make_unique<SoftStep>(); }

}  // namespace cradle
