#include "server/dynamics/contact/batch_step.h"

#include <algorithm>

#include "server/dynamics/contact/softness.h"

namespace cradle {
namespace {

/// Constraints that are worth a thread, of some tens of nanoseconds each.
constexpr int kSoftChunk = 64;

/// The largest sag, m, of what stays as it is.
double sag_at_rest(std::span<ContactConstraint* const> constraints, double give) {
  double sag = 0;
  for (const ContactConstraint* c : constraints) {
    for (const ConstraintPoint& p : c->used()) {
      sag = std::max(sag, (1 - c->preload) * give * p.press);
    }
  }
  return sag;
}

}  // namespace

BatchResult BatchStep::advance(const Batch& batch, ContactTick tick, const BodyArrays& arrays,
                               std::span<const Matrix> inverse_inertia_W,
                               std::span<const int> sizes) {
  const double give = give_of(batch.stiff_as, tick.dt);
  BatchResult result;
  if (batch.past == Past::rests) {
    result.sag_m = sag_at_rest(batch.constraints, give);
    return result;
  }
  tick.sub_steps = batch.sub_steps;
  tick.stiff_as = batch.stiff_as;
  tick.moving = batch.moving;
  tick.islands = batch.islands;
  tick.resting = batch.resting;
  divide(batch, tick, arrays, sizes);
  set_gaps(*tick.executor, batch.special, give);
  const auto advance = [&](auto& soft) -> BatchResult {
    soft.advance(tick, arrays, inverse_inertia_W, batch.constraints, batch.special, batch.past);
    return {soft.impacts_ordered(), soft.paid_J(), soft.sag_m(), soft.residual(), soft.balance()};
  };
  result = batch.in_floats ? advance(batch_in_floats_) : advance(batch_);
  reset_gaps(*tick.executor, batch.special);
  return result;
}

/// Into domains, in whose order its bodies are from here on.
void BatchStep::divide(const Batch& batch, ContactTick& tick, const BodyArrays& arrays,
                       std::span<const int> sizes) {
  domains_.find(tick.moving, tick.islands, sizes, arrays.x);
  domains_.sort(batch.moving, numbers_);
  domains_.sort(batch.islands, numbers_);
  domains_.sort(batch.resting, flags_);
  tick.domains = domains_.by_place();
  tick.domains_count = domains_.count();
  tick.places = domains_.places();
}

/// What has been at rest elsewhere than the surfaces touch is so for the sub-steps, too.
void BatchStep::set_gaps(Executor& executor, std::span<ContactConstraint* const> constraints,
                         double give) {
  if (gaps_.size() < constraints.size()) gaps_.resize(constraints.size());
  for_each_index(executor, constraints.size(), kSoftChunk, [&](std::size_t k) {
    ContactConstraint& c = *constraints[k];
    if (!c.has_rested) return;
    for (std::size_t i = 0; i < c.used().size(); ++i) {
      ConstraintPoint& p = c.points[i];
      gaps_[k][i] = p.s0;
      if (!c.rest(p).is_none()) p.s0 = c.gap(p, give);
    }
  });
}

void BatchStep::reset_gaps(Executor& executor, std::span<ContactConstraint* const> constraints) {
  for_each_index(executor, constraints.size(), kSoftChunk, [&](std::size_t k) {
    ContactConstraint& c = *constraints[k];
    if (!c.has_rested) return;
    for (std::size_t i = 0; i < c.used().size(); ++i) c.points[i].s0 = gaps_[k][i];
  });
}

}  // namespace cradle
