/// Islands that take the same number of sub-steps: see soft_batch.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/dynamics/contact/body_lines.h"
#include "server/dynamics/contact/contact_blocks.h"
#include "server/dynamics/contact/contact_solver.h"
#include "server/dynamics/contact/impacts.h"
#include "server/dynamics/contact/turning_contact.h"

namespace cradle {

/// m/s: overlaps that take more than a tick of this to part are deep.
double push_speed();

/// What contacts carried in the tick before is what they will carry; or it pushes many apart; or
/// the loads of a body have just changed; or there is no such contact; or it holds all as it is.
enum class Past : std::uint8_t { lasts, parts, changes, none, rests };
inline constexpr std::array kPasts{Past::lasts, Past::parts, Past::changes, Past::none,
                                   Past::rests};

/// Over contacts, in a tick of so many sub-steps.
int sweeps_of(Past past, int sub_steps);

/// Its contacts are solved in double or in single precision; bodies stay in doubles, and of these
/// what nothing changes keeps every bit. Owns no bodies; keeps its memory from batch to batch.
template <class Real>
class SoftBatch {
 public:
  /// As ContactSolver::advance; `tick.sub_steps` and `tick.stiff_as` hold. `special`: those of the
  /// constraints that are, as ContactLook has it.
  void advance(const ContactTick& tick, const BodyArrays& arrays,
               std::span<const Matrix> inverse_inertia_W,
               std::span<ContactConstraint* const> constraints,
               std::span<ContactConstraint* const> special, Past past);
  /// Of the last call: sets of impacts at once that were too large to be solved together.
  int impacts_ordered() const { return impacts_.ordered(); }
  /// Of the last call: energy that what bounces paid for overlaps that were pushed out.
  double paid_J() const { return paid_J_; }
  /// Of the last call: the largest that is expected of loads that last, m.
  double sag_m() const { return sag_m_; }
  /// Of the last call, too.
  const ContactResidual& residual() const { return residual_; }
  const ContactBalance& balance() const { return balance_; }

 private:
  void sort(std::span<ContactConstraint* const> constraints,
            std::span<ContactConstraint* const> special);
  void warm_start();
  void limit_repeats();
  void solve();
  void relax();
  void add_work();
  void take_results();

  using Run = BlockRun<Real>;
  const BlockPasses<Real>* passes_ = nullptr;
  Executor* executor_ = nullptr;
  SubStep step_{};
  double give_ = 0;  // s^2: softness.h
  BodyLines bodies_;
  ContactBlocks<Real> blocks_;
  std::vector<ContactConstraint*> singles_, bouncing_;
  std::vector<TurningContact> turning_;
  Impacts impacts_;
  std::vector<ContactWork<Real>> works_;  // by part of the blocks
  std::vector<ContactTally<Real>> tallies_;
  double paid_J_ = 0, sag_m_ = 0;
  ContactResidual residual_;
  ContactBalance balance_;
};

extern template class SoftBatch<double>;
extern template class SoftBatch<float>;

}  // namespace cradle
