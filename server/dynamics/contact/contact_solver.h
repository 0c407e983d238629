/// Methods that move bodies in contact through a tick, behind one interface; one file a method.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/collision/executor.h"
#include "server/dynamics/contact/contact_balance.h"
#include "server/dynamics/contact/contact_constraint.h"

namespace cradle {

struct ContactTick {
  double dt = 0;           ///< s
  int sub_steps = 0;       ///< of each island; 0: as many as the tolerance asks for
  double tolerance_m = 0;  ///< above 0, unless sub_steps are
  int lanes = 0;           ///< manifolds side by side: one of machine_lanes(), or 0 for the most
  std::span<const std::int32_t> moving;       ///< slots of the dynamic bodies to move, ascending
  std::span<const std::int32_t> driven;       ///< slots of kinematic bodies they touch, ascending
  bool is_balanced = false;                   ///< the report is to have a balance
  std::span<const std::int32_t> shaken = {};  ///< slots of bodies whose loads have changed by much
  /// Of `moving`, in their order: who goes with whom, by numbers below `islands_count`. Empty: all
  /// together.
  std::span<const std::int32_t> islands = {};
  std::size_t islands_count = 1;
  /// By island: 1 if points are to be solved by themselves, as hardly a block of contacts carries
  /// on all of its points. Empty: none is.
  std::span<const std::uint8_t> heaps = {};
  /// Of `moving`, in their order: 1 if it lies among others and none moves much. Empty: none does.
  std::span<const std::uint8_t> resting = {};
  /// Likewise: its domain (domains.h), ascending. Empty: there is one.
  std::span<const std::int32_t> domains = {};
  std::size_t domains_count = 1;
  /// Where in `moving` its bodies are, by ascending slots. Empty: it ascends.
  std::span<const std::int32_t> places = {};
  int stiff_as = 0;  ///< of a batch of soft steps: its contacts are as stiff as with so many
  std::span<const std::int32_t> stirred = {};  ///< slots of bodies whose loads have just changed
  Executor* executor = &serial_executor;       ///< where work goes that may be done side by side
};

/// Islands that took the same number of sub-steps.
struct SubStepChoice {
  int sub_steps = 0;
  int islands = 0;
  int bodies = 0;    ///< in them, that move
  double sag_m = 0;  ///< expected of their most loaded contact, of loads that last
};
inline constexpr std::size_t kSubStepChoices = 36;

/// What the solver chose, and what that is worth.
struct ContactReport {
  int islands = 0;
  int sub_steps_max = 0;            ///< of an island
  std::int64_t body_sub_steps = 0;  ///< bodies, each times its sub-steps
  int impacts_ordered = 0;          ///< sets too large to be solved at once: in their order
  /// That a method beside "soft" solved by a makeshift: "newton" by soft steps or to less
  /// than it asks for, and "accurate", too; "hybrid" by soft steps after a vain attempt; "lcp" by
  /// sweeps, as too large for pivots or because they found nothing; "impulse" by sweeps that ran
  /// out; "penalty" with softer springs than asked for.
  int islands_makeshift = 0;
  int islands_at_rest = 0;     ///< of "hybrid": nothing was to be solved
  int islands_by_newton = 0;   ///< likewise: with iterations
  int islands_taken_over = 0;  ///< of both: from the soft step, in this tick
  double paid_J = 0;           ///< by what bounces, for overlaps that were pushed out
  double sag_max_m = 0;        ///< expected of loads that last, as stiff as contacts are
  std::array<SubStepChoice, kSubStepChoices> choices;  ///< the first `choices_used`
  std::size_t choices_used = 0;
  ContactResidual residual;  ///< after the last sub-step
  ContactBalance balance;    ///< if asked for
};

class ContactSolver {
 public:
  virtual ~ContactSolver() = default;

  /// Moves the bodies of `tick.moving` through the tick: their x, q, v, w. Kinematic and static
  /// ones are read only. Forces in `constraints` are last tick's on entry, this tick's on return.
  virtual ContactReport advance(const ContactTick& tick, const BodyArrays& bodies,
                                std::span<const Matrix> inverse_inertia_W,
                                std::span<ContactConstraint* const> constraints) = 0;
};

/// By name, e.g. "soft"; null for an unknown one.
std::unique_ptr<ContactSolver> make_contact_solver(std::string_view name);

/// All names, the default first.
std::vector<std::string> contact_solver_names();

}  // namespace cradle
