/// Which islands of a tick the solver "hybrid" gives to Newton's method: see hand_over.cpp.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/dynamics/contact/demands.h"
#include "server/dynamics/contact/newton/island_solver.h"
#include "server/dynamics/contact/tick_islands.h"

namespace cradle {

/// Bodies remember (Poise), and points (PointRest); this only looks at them.
class HandOver {
 public:
  /// Not at all; bodies that have never been in contact; as in the tick before; from the soft step.
  enum class Choice : std::uint8_t { soft, first, keeps, takes_over };
  using Budget = IslandSolver::Budget;

  /// Looks at the islands, and forgets where points rested that have let go.
  void begin(const ContactTick& tick, const BodyArrays& arrays, const TickIslands& islands,
             std::span<ContactConstraint* const> constraints);
  Choice choice(std::size_t island) const { return facts_[island].choice; }
  /// At the peak of its sway (settling.h), as long as it is held: a small one costs little.
  bool may_be_stopped(std::size_t island) const {
    return choice(island) == Choice::keeps && facts_[island].free == 0 && is_large(island);
  }
  /// What an attempt may take, and where it is not begun.
  Budget budget(std::size_t island) const;
  /// As Newton's method moves it; what is taken over is to lie still.
  bool is_slow(const Island& island, const IslandSolver& solver, bool is_taken_over) const;

  /// What the soft step carries now is what rests there; and not, if that came to nothing.
  void freeze(const Island& island);
  void thaw(const Island& island);
  /// Likewise, what Newton's method carried, before the soft step: of an island, and of all that
  /// were given to the soft step at once.
  void let_go(const Island& island);
  void let_go_of_soft(std::span<ContactConstraint* const> constraints);

  /// What became of it: it rests; is held, without an iteration or by some; or is not, as what was
  /// found would move off.
  enum class Attempt { none, rests, held, solved, in_vain, moves };
  void note(std::size_t island, Attempt attempt);
  /// It was stopped at the peak of its sway.
  void note_stop(std::size_t island) { facts_[island].busy = 0; }
  void end(Executor& executor);

 private:
  struct Facts {
    double speed_mps = 0;
    double nearest_m = 0;
    bool is_new = false, was_soft = false, is_barred = false, is_deep = false;
    bool may_have_rested = false;  // a body of it
    std::int32_t stiff_as = 1;
    int contacts = 0;
    std::int32_t cool = 0, free = 0, fails = 0, busy = 0;
    Choice choice = Choice::soft;
    Poise::Method method = Poise::soft;
  };
  void look_at_bodies(Executor& executor);
  void look_at_contacts(std::span<ContactConstraint* const> constraints);
  void look_at_contact(ContactConstraint& c, Facts& facts);
  bool may_have_rested(std::size_t constraint) const;
  void let_go(ContactConstraint& c);
  void mark(const ContactConstraint& c, std::vector<std::uint8_t>& bodies) const;
  bool is_carried(std::int32_t slot) const;
  double tolerance_m(const ContactConstraint& c) const {
    return c.tolerance_m > 0 ? c.tolerance_m : tolerance_m_;
  }
  bool was_held(const ContactConstraint& c) const;
  static bool may_rest(const Facts& facts);
  void look_at_rest(ContactConstraint& c) const;
  static void freeze(ContactConstraint& c);
  static Choice choose(const Facts& facts);
  static void back_off(Facts& facts);
  bool is_large(std::size_t island) const { return facts_[island].contacts > kLargeHeap; }

  /// Of a body.
  struct Look {
    double speed_mps;  // of its fastest point
    Poise poise;
  };

  BodyArrays arrays_;
  std::span<const std::int32_t> moving_;
  const TickIslands* islands_ = nullptr;
  std::span<Poise> poises_;
  std::vector<Poise> own_;   // if nobody else keeps them
  std::vector<Look> looks_;  // of `moving_`
  std::vector<Facts> facts_;
  std::vector<std::uint8_t> carries_;  // of `moving_`
  /// Likewise: some contact rests elsewhere than it touches; before, it may have.
  std::vector<std::uint8_t> has_rested_, may_have_rested_;
  double tolerance_m_ = 0, dt_ = 0;  // the tick's
  std::vector<PointRest> before_;    // of the points of the island that was frozen last
};

}  // namespace cradle
