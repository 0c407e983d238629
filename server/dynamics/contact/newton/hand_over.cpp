// The choice of a method by island and tick, and how a load goes from one to the other.
//
// A contact of the soft step sinks in under its load by as much as its spring asks for, one of
// Newton's method by a ten thousandth of that. So a point remembers at which gap it rests, rest_m,
// and under which load, rest_load (PointRest; m/s^2, of a force F on its effective mass, K F). Both
// methods see the gap
//   s - rest_m - give rest_load,  give: what a load of 1 m/s^2 sinks in by; s^2
//   soft step: give = (h_c / 2 pi c)^2 (softness.h);  Newton: give = dt^2 R / K (contact_island.h)
// At s = rest_m either answers with that load, whatever h_c is. On a hand-over, in
// both directions, rest_m = s and rest_load = K F; then nothing changes until a point is without a
// load, or slides fast. But soft steps push out what has come to be deeper than the contact
// tolerance, by loads that came one after the other. So it is where Newton's method finds no motion
// any more: from there on the rounding of places, 1e-15 m, makes no load.
//
// An island is given to Newton's method
//   first: if its bodies are new and something touches already: what falls does not rest; and
//     nothing is to be pushed out;
//   keeps: if it was so in the tick before;
//   takes over: if nothing in it moves, since the soft step has ended its sway at the peak
//     (settling.h), and nothing is still being pushed out; what slides or rolls on slowly is hardly
//     slower from tick to tick, and is not stopped;
// and if nothing is struck, and nothing slides away.
// Attempts in vain make it wait, for 10, 20, 40... 320 ticks. So does what is large, is held and
// moves nevertheless, for 15 ticks: each of them is a solution, dearer than soft steps. How often
// is forgotten once it rests. What is large and far out of balance is not tried.
// What was stopped at its peak, but is not in balance and begins to move as it is taken over, is
// not stopped for as long as it waits: so a ball in a heap gets the time to roll.
// Where we differ from the prototype that this is after: that took over what was slower than 1 cm/s
// for ten ticks, and took away its velocities.
//
// Order: exact. Cost: 15 ns a body, and a contact of what may rest or has rested.
#include "server/dynamics/contact/newton/hand_over.h"

#include <algorithm>
#include <cmath>

#include "server/collision/index.h"
#include "server/dynamics/contact/softness.h"

namespace cradle {
namespace {

/// Each with unit, reason, and the test that pins it.
struct HandOverTolerances {
  /// m/s: what moves faster is left to soft steps, whose positions are of second order ("what
  /// begins to slide"), also where it is struck ("what strikes a stack").
  double slow_mps = 0.01;
  /// m, in a tick: what goes farther as it is taken over was stopped at the peak of its sway, but
  /// is not in balance ("rubble comes to rest").
  double jump_m = 1e-6;
  double hit_mps =
      0.1;  ///< likewise, before the tick: it may be set down in it ("loads that grow")
  /// A point that slides so fast is not where it rested, and nobody sees that it gives way;
  /// attempts in vain before that say nothing ("what strikes a stack").
  double fast_mps = 0.3;
  /// m: new bodies farther apart are to fall first ("what begins to slide or fall").
  double touch_m = 1e-6;
  /// Of the contact tolerance: deeper than its sag is what soft steps are still pushing out, with
  /// no velocity ("an overlap that is pushed out").
  double excess = 0.25;
  double excess_least = 0.01;  ///< and what is too deep in all, by more than this ("noisy corners")
  int wait_ticks = 10, wait_ticks_max = 320;  ///< after an attempt in vain
  int busy_ticks = 15;                        ///< of a large island ("what rolls on a large wall")
};
constexpr HandOverTolerances kHandOverTolerances;

/// Iterations: at rest none, or one; more than these, and the soft step is as fast. One of a large
/// island takes as long as five ticks of soft steps. Of heaps of 2000 cubes those that could be
/// taken over were out of balance by 1e-5 to 9e-3 of their loads, and took up to four; the others
/// by 5e-2 to 0.13, and 20 were not enough ("a large island is not tried").
constexpr int kKeeping = 5, kTakingOver = 20, kTakingOverLarge = 6;
constexpr double kUnbalanced = 0.02;

constexpr int kBodies = 64;  // worth a thread, at some nanoseconds each

bool has_rest(const ContactConstraint& c) {
  return c.has_rested && !std::ranges::all_of(c.rests, &PointRest::is_none);
}

}  // namespace

void HandOver::begin(const ContactTick& tick, const BodyArrays& arrays, const TickIslands& islands,
                     std::span<ContactConstraint* const> constraints) {
  arrays_ = arrays;
  moving_ = tick.moving;
  islands_ = &islands;
  poises_ = arrays.poise;
  if (poises_.empty()) {
    own_.resize(arrays.x.size());
    poises_ = own_;
  }
  facts_.assign(islands.count(), {});
  carries_.assign(moving_.size(), 0);
  has_rested_.assign(moving_.size(), 0);
  may_have_rested_.resize(moving_.size());
  tolerance_m_ = tick.tolerance_m;
  dt_ = tick.dt;
  look_at_bodies(*tick.executor);
  look_at_contacts(constraints);
  for (Facts& facts : facts_) facts.choice = choose(facts);
}

void HandOver::look_at_bodies(Executor& executor) {
  looks_.resize(moving_.size());
  for_each_index(executor, moving_.size(), kBodies, [this](std::size_t k) {
    const std::size_t i = index(moving_[k]);
    const double speed = arrays_.v[i].norm() + arrays_.gyration(i) * arrays_.w[i].norm();
    looks_[k] = {speed, poises_[i]};
  });
  for_runs(islands_->by_body(), [this](std::size_t island, std::size_t begin, std::size_t end) {
    Facts facts = facts_[island];
    for (std::size_t k = begin; k < end; ++k) {
      const auto& [speed, poise] = looks_[k];
      facts.speed_mps = std::max(facts.speed_mps, speed);
      facts.is_new |= poise.method == Poise::none;
      facts.was_soft |= poise.method == Poise::soft;
      const bool may_have_rested = poise.method == Poise::newton || poise.has_rested != 0;
      may_have_rested_[k] = may_have_rested ? 1 : 0;
      facts.may_have_rested |= may_have_rested;
      facts.cool = std::max(facts.cool, poise.cool);
      facts.free = std::max(facts.free, poise.free);
      facts.fails = std::max(facts.fails, poise.fails);
      facts.busy = std::max(facts.busy, poise.busy);
      facts.stiff_as = std::max(facts.stiff_as, poise.stiff_as);
    }
    facts_[island] = facts;
  });
  for (Facts& facts : facts_) facts.nearest_m = kHandOverTolerances.touch_m * 2;
}

void HandOver::look_at_contacts(std::span<ContactConstraint* const> constraints) {
  for_runs(islands_->by_constraint(), [&](std::size_t island, std::size_t begin, std::size_t end) {
    Facts& facts = facts_[island];
    facts.contacts += static_cast<int>(end - begin);
    if (!may_rest(facts) && !facts.may_have_rested) return;  // soft, as before
    for (std::size_t k = begin; k < end; ++k) {
      if (may_rest(facts) || may_have_rested(k)) look_at_contact(*constraints[k], facts);
    }
  });
}

void HandOver::look_at_contact(ContactConstraint& c, Facts& facts) {
  facts.is_barred |= c.turns_heavily() || c.is_ahead;
  double nearest_m = kHandOverTolerances.touch_m * 2;
  for (const ConstraintPoint& p : c.used()) nearest_m = std::min(nearest_m, p.s0);
  facts.nearest_m = std::min(facts.nearest_m, nearest_m);
  look_at_rest(c);
  if (has_rest(c)) mark(c, has_rested_);
  const double give = give_of(facts.stiff_as, dt_);
  if (c.carrying > 0 || nearest_m <= kHandOverTolerances.touch_m) mark(c, carries_);
  for (const ConstraintPoint& p : c.used()) {
    const double sag = give * c.load(p);
    const double spare =
        std::max(tolerance_m(c) - sag, kHandOverTolerances.excess_least * tolerance_m(c));
    facts.is_deep |=
        c.gap(p, give) + sag < -std::min(spare, kHandOverTolerances.excess * tolerance_m(c));
  }
}

void HandOver::mark(const ContactConstraint& c, std::vector<std::uint8_t>& bodies) const {
  for (const std::int32_t slot : {c.a, c.b}) {
    const std::int32_t k = islands_->numbers()[index(slot)];
    if (k >= 0) bodies[index(k)] = 1;
  }
}

/// By Newton's method, in the tick before.
bool HandOver::was_held(const ContactConstraint& c) const {
  const auto was = [&](std::int32_t slot) {
    return arrays_.inverse_mass[index(slot)] == 0 || poises_[index(slot)].method == Poise::newton;
  };
  return c.is_known && was(c.a) && was(c.b);
}

/// Points that have let go; and those that stand for others now, in a manifold that rests.
void HandOver::look_at_rest(ContactConstraint& c) const {
  const std::size_t a = index(c.a), b = index(c.b);
  const bool is_held = was_held(c);
  for (const ConstraintPoint& p : c.used()) {
    if (c.K_normal(p) == 0 && is_held) {
      freeze(c);
      return;
    }
    PointRest rest = c.rest(p);
    if (rest.is_none()) continue;
    const Vector u =
        arrays_.v[b] + arrays_.w[b].cross(c.rB(p)) - arrays_.v[a] - arrays_.w[a].cross(p.rA);
    if (p.force == 0) rest.load = 0;
    const bool has_left = p.force == 0 && p.s0 > 0;
    if (has_left || u.norm() > kHandOverTolerances.fast_mps) rest = {};
    c.set_rest(p, rest);
  }
}

/// As far as its bodies tell.
bool HandOver::may_rest(const Facts& facts) {
  return facts.cool == 0 && facts.speed_mps <= kHandOverTolerances.hit_mps &&
         (!facts.was_soft || facts.speed_mps == 0);
}

bool HandOver::may_have_rested(std::size_t constraint) const {
  const auto [a, b] = islands_->bodies_of_constraint(constraint);
  return (a >= 0 && may_have_rested_[index(a)] != 0) || (b >= 0 && may_have_rested_[index(b)] != 0);
}

HandOver::Choice HandOver::choose(const Facts& facts) {
  if (!may_rest(facts) || facts.is_barred) return Choice::soft;
  if (!facts.was_soft && !facts.is_new) return Choice::keeps;
  if (facts.is_deep) return Choice::soft;
  if (facts.was_soft) return Choice::takes_over;
  return facts.nearest_m <= kHandOverTolerances.touch_m ? Choice::first : Choice::soft;
}

bool HandOver::is_carried(std::int32_t slot) const {
  return carries_[index(islands_->numbers()[index(slot)])] != 0;
}

/// What is not carried may fall.
bool HandOver::is_slow(const Island& island, const IslandSolver& solver, bool is_taken_over) const {
  const double most_mps =
      is_taken_over ? kHandOverTolerances.jump_m / dt_ : kHandOverTolerances.slow_mps;
  for (std::size_t k = 0; k < island.slots.size(); ++k) {
    if (solver.speed_mps(k) > most_mps && is_carried(island.slots[k])) return false;
  }
  return true;
}

HandOver::Budget HandOver::budget(std::size_t island) const {
  if (choice(island) == Choice::keeps) return {kKeeping};
  if (is_large(island) && choice(island) == Choice::takes_over) {
    return {kTakingOverLarge, kUnbalanced};
  }
  return {kTakingOver};
}

void HandOver::freeze(ContactConstraint& c) {
  const bool knows_all = std::ranges::all_of(
      c.used(), [&](const ConstraintPoint& p) { return p.force == 0 || c.K_normal(p) > 0; });
  if (!knows_all) find_effective_masses(c);
  for (const ConstraintPoint& p : c.used()) {
    const bool lies = p.force > 0 && p.s0 <= kHandOverTolerances.touch_m;
    c.set_rest(p, {lies ? p.s0 : std::min(p.s0, 0.0), c.load(p)});
  }
  c.has_rested = true;
}

void HandOver::freeze(const Island& island) {
  before_.clear();
  for (ContactConstraint* c : island.constraints) {
    for (const ConstraintPoint& p : c->used()) before_.push_back(c->rest(p));
    freeze(*c);
  }
}

void HandOver::thaw(const Island& island) {
  auto rest = before_.begin();
  for (ContactConstraint* c : island.constraints) {
    for (const ConstraintPoint& p : c->used()) c->set_rest(p, *rest++);
  }
}

void HandOver::let_go(ContactConstraint& c) {
  if (!was_held(c)) return;
  freeze(c);
  mark(c, has_rested_);
  for (const ConstraintPoint& p : c.used()) {
    if (c.rest(p).m < -tolerance_m(c)) c.set_rest(p, {});
  }
}

void HandOver::let_go(const Island& island) {
  for (ContactConstraint* c : island.constraints) let_go(*c);
}

void HandOver::let_go_of_soft(std::span<ContactConstraint* const> constraints) {
  for_runs(islands_->by_constraint(), [&](std::size_t island, std::size_t begin, std::size_t end) {
    if (choice(island) != Choice::soft || !facts_[island].may_have_rested) return;
    for (std::size_t k = begin; k < end; ++k) {
      if (may_have_rested(k)) let_go(*constraints[k]);
    }
  });
}

void HandOver::back_off(Facts& facts) {
  const int doubled = kHandOverTolerances.wait_ticks << std::min(facts.fails, 10);
  facts.cool = std::min(doubled, kHandOverTolerances.wait_ticks_max);
  ++facts.fails;
}

void HandOver::note(std::size_t island, Attempt attempt) {
  Facts& facts = facts_[island];
  const bool is_held =
      attempt == Attempt::rests || attempt == Attempt::held || attempt == Attempt::solved;
  facts.method = is_held ? Poise::newton : Poise::soft;
  facts.cool = std::max(facts.cool - 1, 0);
  facts.free = std::max(facts.free - 1, 0);
  if (attempt == Attempt::in_vain || attempt == Attempt::moves) {
    back_off(facts);
    facts.free = attempt == Attempt::moves ? facts.cool : 0;
  }
  if (facts.speed_mps > kHandOverTolerances.fast_mps || attempt == Attempt::rests) facts.fails = 0;
  const bool is_dear = attempt == Attempt::solved && is_large(island);
  facts.busy = is_dear ? facts.busy + 1 : is_held ? std::max(facts.busy - 1, 0) : 0;
}

void HandOver::end(Executor& executor) {
  for (Facts& facts : facts_) {
    if (facts.busy < kHandOverTolerances.busy_ticks) continue;
    back_off(facts);
    facts.busy = 0;
  }
  for_each_index(executor, moving_.size(), kBodies, [this](std::size_t k) {
    const Facts& facts = facts_[islands_->of(static_cast<std::int32_t>(k))];
    Poise& poise = poises_[index(moving_[k])];
    poise = {facts.method,   facts.cool,     facts.free, facts.fails,
             poise.stiff_as, has_rested_[k], facts.busy};
  });
}

}  // namespace cradle
