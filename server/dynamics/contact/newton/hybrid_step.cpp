// The contact solver "hybrid": soft steps for what moves, Newton's method for what rests, by island
// and tick.
//
// What is chosen, and how loads go from one to the other: hand_over.cpp. In a tick, of an island
// that is given to Newton's method:
//   1. rests: nothing moves and the impulses of the tick before still balance all loads
//      (settling.h): it stays as it is, to the bit;
//   2. else Newton's method, from the velocities as they are, within a few iterations, of which it
//      takes none where the gradient is small at once;
//   3. else, or where overlaps are to be pushed out, or it begins to move: the soft step in the
//      same tick, from where bodies were. What was not found is counted, as
//      ContactReport::islands_makeshift.
// A large island that is held and creeps is stopped at the peak of its sway (settling.h); if none
// comes within 15 ticks, it goes back to soft steps (hand_over.cpp).
//
// Cost: at rest 60 ns a manifold; what moves, as the soft step and 15 ns a body.
#include <algorithm>

#include "server/collision/index.h"
#include "server/dynamics/contact/newton/hand_over.h"
#include "server/dynamics/contact/newton/island_step.h"
#include "server/dynamics/contact/newton/newton_step.h"
#include "server/dynamics/contact/settling.h"

namespace cradle {
namespace {

class HybridStep final : public IslandStep {
 public:
  HybridStep() : IslandStep(kHybrid) {}

 private:
  using Choice = HandOver::Choice;
  using Attempt = HandOver::Attempt;

  void choose(std::span<const Matrix> inverse_inertia_W,
              std::span<ContactConstraint* const> constraints) override {
    hand_over_.begin(tick(), arrays(), islands(), constraints);
    gives_.assign(islands().count(), give());
    settling_.find(tick(), arrays(), inverse_inertia_W, {islands(), islands().numbers(), gives_},
                   constraints);
    for (std::size_t i = 0; i < islands().count(); ++i) {
      const Choice choice = hand_over_.choice(i);
      const bool rests = choice == Choice::keeps && settling_.rests(i);
      fates()[i] = rests ? Fate::rests : choice == Choice::soft ? Fate::soft : Fate::solved;
      if (rests) ++report().islands_at_rest;
      if (rests) hand_over_.note(i, Attempt::rests);
      if (choice == Choice::soft) hand_over_.note(i, Attempt::none);
    }
    hand_over_.let_go_of_soft(constraints);
    PointResidual& most = report().residual.most;
    most.natural_mps = std::max(most.natural_mps, settling_.unbalanced_mps());
  }

  bool solve(std::size_t i) override {
    Island& island = islands_in()[i];
    const bool takes_over = hand_over_.choice(i) == Choice::takes_over;
    if (takes_over) hand_over_.freeze(island);
    const bool is_found =
        solver().solve_at_rest(bodies(), arrays(), island, tick().dt, hand_over_.budget(i));
    if (!is_found || !hand_over_.is_slow(island, solver(), takes_over)) {
      if (takes_over) hand_over_.thaw(island);
      hand_over_.let_go(island);
      const Attempt moves = takes_over ? Attempt::moves : Attempt::none;
      hand_over_.note(i, is_found ? moves : Attempt::in_vain);
      report().islands_makeshift += is_found ? 0 : 1;
      return false;
    }
    const bool costs_nothing = solver().iterations() == 0;
    hand_over_.note(i, costs_nothing ? Attempt::held : Attempt::solved);
    ++(costs_nothing ? report().islands_at_rest : report().islands_by_newton);
    report().islands_taken_over += takes_over ? 1 : 0;
    return true;
  }

  /// From there on rounding of places makes no load.
  void keep(std::size_t i) override {
    if (solver().is_still()) hand_over_.freeze(islands_in()[i]);
  }

  void end() override {
    end_sways();
    hand_over_.end(*tick().executor);
  }

  /// Of what is held and large: or it would be solved for as long as it sways.
  void end_sways() {
    are_solved_.assign(islands().count(), 0);
    is_calm_.assign(islands().count(), 0);
    for (std::size_t i = 0; i < islands().count(); ++i) {
      if (fates()[i] != Fate::solved) continue;
      are_solved_[i] = 1;
      is_calm_[i] = hand_over_.may_be_stopped(i) && !is_driven(islands_in()[i]) ? 1 : 0;
    }
    if (std::ranges::find(are_solved_, 1) == are_solved_.end()) return;
    settling_.damp(tick(), arrays(), {islands(), islands().numbers(), gives_, are_solved_},
                   is_calm_, report().balance);
    for (std::size_t i = 0; i < islands().count(); ++i) {
      if (are_solved_[i] != 0 && settling_.has_ended(i)) hand_over_.note_stop(i);
    }
  }

  /// By a kinematic body.
  bool is_driven(const Island& island) const {
    return std::ranges::any_of(island.constraints, [this](const ContactConstraint* c) {
      return arrays().is_driven(index(c->a)) || arrays().is_driven(index(c->b));
    });
  }

  HandOver hand_over_;
  Settling settling_;
  std::vector<double> gives_;                       // s^2, by island
  std::vector<std::uint8_t> are_solved_, is_calm_;  // by island: solved at once; and may be stopped
};

}  // namespace

std::unique_ptr<ContactSolver> make_hybrid_step() { return std::make_unique<HybridStep>(); }

}  // namespace cradle
