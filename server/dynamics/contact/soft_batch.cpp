// Sub-stepped soft contact with relaxation.
//
// Sources: Catto (2024), "Solver2D" (soft step: one biased and one relaxing Gauss-Seidel sweep a
// sub-step, warm started); Macklin et al. (2019), "Small Steps in Physics Simulation" (sub-steps
// beat iterations).
// Where we differ: the contact frequency is tied to the sub-step that the sag asks for, h_c (0.177
// / h_c instead of a fixed cap), so that the sag under a load F, delta = F / (m omega^2), falls as
// h_c^2; a large heap that moves takes longer sub-steps than that (demands.h); the push-out limit
// bounds the excess over the carried load, not the load; positions move with the mean velocity of a
// sub-step, so that smooth motion (flight, sliding) is second order. Not those of bodies that rest
// on each other: what sways with omega grows by omega^2 h / 4 a second by that (a wall of 465 cubes
// rocked by 0.04 m/s for good), with the velocity at the end it neither grows nor shrinks.
//
// Symbols, frame W: h sub-step, s separation, vn normal velocity, lambda normal impulse, K inverse
// effective mass, dp and theta displacement and rotation since the tick's start.
//   mass scale ms, impulse scale is, bias rate br: softness.h
//   soft:  lambda += -(ms vn + bias) / K - is lambda, bias = ms br s, lambda >= 0
//   relax: lambda += -vn / K, lambda >= 0; then friction, lambda_t += -vt / K_t with K_t the
//   largest in the tangent plane, projected onto |lambda_t| <= mu lambda (a true cone)
//   speculative points (s > 0): lambda += -(vn + s / h) / K, soft: - is lambda, too; or else what
//   is carried at s = +0 would not sink in at all
//   rolling and torsional friction come last, where there are any: turning_contact.cpp
// Order: 2 in the position of smooth motion, 1 in impacts. Cost: about 100 ns a point and sub-step.
#include "server/dynamics/contact/soft_batch.h"

#include <algorithm>
#include <cmath>

#include "server/dynamics/contact/contact_kernels.h"
#include "server/dynamics/contact/single_contacts.h"
#include "server/dynamics/contact/softness.h"

namespace cradle {
namespace {

/// Each with unit, reason, and the test that pins it.
struct SoftTolerances {
  double push_speed = 0.3;   ///< m/s: floor of the push-out limit ("half overlapped")
  double push_rate = 4;      ///< 1/s: lets deep overlaps part within a second ("half overlapped")
  double smooth_factor = 3;  ///< a velocity change below 3 h |a| is no impact ("sliding stop")
};
constexpr SoftTolerances kSoftTolerances;

/// Relaxing sweeps while what contacts carry is not known. A point's friction turns the body, which
/// moves loads among its points, and so on: one sweep finds a part of what holds a push that is
/// suddenly there, and lets the rest move the body ("a pushed box", "slides alike").
constexpr int kSweepsWithoutPast = 16;
/// While many are pushed apart: one leaves velocities that throw the last ("overlap by 5 cm").
constexpr int kSweepsToPart = 2;

/// A load that lasts grows by this factor a tick at most: a blow is none. Weights are felt in full
/// after a few ticks.
constexpr double kPressGrowth = 1.5;
/// And falls by this one: sub-steps that change move what rests, which changes loads ("in the plane
/// a stack of ten boxes").
constexpr double kPressDecay = 0.99;

constexpr int kConstraintsWorthAThread = 16;  // whose masses are found

int relaxing_sweeps(Past past, int sub_step) {
  if (past == Past::parts) return kSweepsToPart;
  if (past == Past::lasts || (past == Past::changes && sub_step > 0)) return 1;
  return kSweepsWithoutPast;
}

double press_after(const ConstraintPoint& p, double now) {
  if (p.press == 0) return now;
  return std::clamp(now, kPressDecay * p.press, kPressGrowth * p.press);
}

/// Takes note of what presses; `sag`: the largest so far, m. `give`: softness.h.
void press(ContactConstraint& c, double give, double& sag) {
  for (ConstraintPoint& p : c.used()) {
    const double now = c.load(p);
    p.press = press_after(p, now);
    sag = std::max(sag, give * std::min(p.press, now));
  }
}

SubStep sub_step_of(double h, double h_c) {
  return {h, 1 / h, kSoftTolerances.push_speed, kSoftTolerances.push_rate, softness_of(h, h_c)};
}

}  // namespace

double push_speed() { return kSoftTolerances.push_speed; }

int sweeps_of(Past past, int sub_steps) {
  if (past == Past::rests) return 0;
  int sweeps = sub_steps;
  for (int sub_step = 0; sub_step < sub_steps; ++sub_step) {
    sweeps += relaxing_sweeps(past, sub_step);
  }
  return sweeps;
}

template <class Real>
void SoftBatch<Real>::advance(const ContactTick& tick, const BodyArrays& arrays,
                              std::span<const Matrix> inverse_inertia_W,
                              std::span<ContactConstraint* const> constraints,
                              std::span<ContactConstraint* const> special, Past past) {
  passes_ = &contact_kernels_of(tick.lanes).of<Real>();
  executor_ = tick.executor;
  const double h_c = tick.dt / tick.stiff_as;
  give_ = give_of(1, h_c);
  step_ = sub_step_of(tick.dt / tick.sub_steps, h_c);
  bodies_.begin(tick, arrays, inverse_inertia_W);
  sort(constraints, special);
  balance_ = {};
  if (tick.is_balanced) bodies_.begin_balance(balance_);
  if (!impacts_.is_empty()) bodies_.begin_debts(constraints);
  impacts_.keep_balance(tick.is_balanced ? &balance_ : nullptr);

  for (int sub_step = 0; sub_step < tick.sub_steps; ++sub_step) {
    if (!impacts_.is_empty()) impacts_.strike(bodies_, step_.h);
    bodies_.integrate_velocities(step_.h, kSoftTolerances.smooth_factor);
    if (sub_step == 0) warm_start();
    limit_repeats();
    solve();
    bodies_.integrate_positions(step_.h, kSoftTolerances.smooth_factor);
    blocks_.follow_driven(bodies_);
    for (int k = relaxing_sweeps(past, sub_step); k > 0; --k) relax();
    if (tick.is_balanced) add_work();
  }
  paid_J_ = impacts_.is_empty() ? 0 : bodies_.pay_debts();
  if (tick.is_balanced) bodies_.end_balance(balance_, tick.dt);
  take_results();
  bodies_.finish();
  for (TurningContact& turning : turning_) turning.finish(step_.h);
}

/// And how well they do.
template <class Real>
void SoftBatch<Real>::take_results() {
  tallies_.assign(blocks_.parts(), {});
  const auto judge = [this](std::size_t part, const Run& run) {
    passes_->judge(run, step_, bodies_.velocities(), tallies_[part]);
  };
  sag_m_ = blocks_.unpack(*executor_, *passes_, {step_.h, kPressGrowth, kPressDecay, give_}, judge);
  residual_ = {};
  for (const auto& tally : tallies_) residual_.add(tally);
  for (ContactConstraint* c : singles_) {
    SingleContact(*c, bodies_).judge(step_, residual_);
    for (ConstraintPoint& p : c->used()) {
      p.force = c->impulse(p).lambda / step_.h;
      p.force_t = c->impulse(p).lambda_t / step_.h;
    }
    press(*c, give_, sag_m_);
  }
}

/// Into blocks; single contacts, and those with restitution.
template <class Real>
void SoftBatch<Real>::sort(std::span<ContactConstraint* const> constraints,
                           std::span<ContactConstraint* const> special) {
  const auto prepare = [this](const Run& run) {
    passes_->prepare(run, step_.soft, bodies_.velocities());
  };
  blocks_.pack(*executor_, *passes_, constraints, bodies_, step_.h, give_, prepare);
  for_each_index(*executor_, special.size(), kConstraintsWorthAThread, [&](std::size_t k) {
    ContactConstraint& c = *special[k];
    if (c.is_ahead || c.bounces) find_effective_masses(c);
  });
  singles_.clear();
  bouncing_.clear();
  for (ContactConstraint* const c : special) {
    if (c->bounces) bouncing_.push_back(c);
    if (!c->is_ahead) continue;
    singles_.push_back(c);
    for (const ConstraintPoint& p : c->used()) {
      c->impulse(p) = {step_.h * p.force_t, step_.h * p.force, p.s0};
    }
  }
  turning_.clear();
  for (const auto& [c, block, lane] : blocks_.turning()) {
    turning_.emplace_back(*c, bodies_, block, lane);
  }
  for (ContactConstraint* c : singles_) {
    if (c->turns_heavily()) turning_.emplace_back(*c, bodies_);
  }
  impacts_.begin(bouncing_, bodies_);
}

template <class Real>
void SoftBatch<Real>::warm_start() {
  blocks_.in_order(*executor_,
                   [this](const Run& run) { passes_->warm_start(run, bodies_.velocities()); });
  for (ContactConstraint* c : singles_) SingleContact(*c, bodies_).warm_start();
  for (TurningContact& turning : turning_) turning.warm_start(bodies_, step_.h);
  bodies_.find_struck(step_.h, kSoftTolerances.smooth_factor);
}

/// A blow does not come again: body_repeats.cpp.
template <class Real>
void SoftBatch<Real>::limit_repeats() {
  if (bodies_.has_struck()) bodies_.forgive_struck();
  if (!bodies_.has_struck()) return;
  bodies_.begin_repeats();
  blocks_.repeat_struck(*executor_, *passes_, bodies_);
  for (ContactConstraint* c : singles_) SingleContact(*c, bodies_).repeat_struck();
  for (const TurningContact& turning : turning_) turning.repeat_struck(bodies_);
  bodies_.end_repeats();
  const std::span<const double> shares = bodies_.limit_repeats();
  if (shares.empty()) return;
  blocks_.scale_struck(*executor_, *passes_, shares, bodies_);
  for (ContactConstraint* c : singles_) SingleContact(*c, bodies_).scale_struck(shares);
  for (TurningContact& turning : turning_) turning.scale_struck(shares, bodies_);
}

template <class Real>
void SoftBatch<Real>::solve() {
  blocks_.in_order(*executor_,
                   [this](const Run& run) { passes_->solve(run, step_, bodies_.velocities()); });
  for (ContactConstraint* c : singles_) SingleContact(*c, bodies_).solve(step_);
}

template <class Real>
void SoftBatch<Real>::relax() {
  blocks_.in_order(*executor_, [this](const Run& run) {
    passes_->relax(run, step_, bodies_.velocities(), bodies_.motions());
  });
  for (ContactConstraint* c : singles_) SingleContact(*c, bodies_).relax(step_);
  for (TurningContact& turning : turning_) turning.rub(bodies_);
}

/// Normal impulses take energy, all together: of two bodies between others, one may well get what
/// the other loses. Where they give, that is nobody's.
template <class Real>
void SoftBatch<Real>::add_work() {
  bodies_.take_means(step_.h);
  works_.assign(blocks_.parts(), {});
  blocks_.in_parts(*executor_, [this](std::size_t part, const Run& run) {
    passes_->work(run, bodies_.means(), works_[part]);
  });
  ContactBalance given;
  for (const auto& work : works_) given.add(work);
  for (ContactConstraint* c : singles_) SingleContact(*c, bodies_).add_work(given);
  for (const TurningContact& turning : turning_) turning.add_work(bodies_, given);
  given.impacts_J = std::min(given.impacts_J, 0.0);
  balance_.add(given);
}

template class SoftBatch<double>;
template class SoftBatch<float>;

}  // namespace cradle
