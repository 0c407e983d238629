// Sub-stepped soft contact with relaxation.
//
// Sources: Catto (2024), "Solver2D" (soft step: one biased and one relaxing Gauss-Seidel sweep a
// sub-step, warm started); Macklin et al. (2019), "Small Steps in Physics Simulation" (sub-steps
// beat iterations).
// Where we differ: the contact frequency is tied to the sub-step (0.177 / h instead of a fixed
// cap), so that the sag under a load F, delta = F / (m omega^2), falls as h^2; the push-out limit
// bounds the excess over the carried load, not the load; positions move with the mean velocity of a
// sub-step, so that smooth motion (flight, sliding) is second order.
//
// Symbols, frame W: h sub-step, s separation, vn normal velocity, lambda normal impulse, K inverse
// effective mass, dp and theta displacement and rotation since the tick's start.
//   omega = 2 pi c / h, a1 = 2 zeta + h omega, a2 = h omega a1
//   mass scale ms = a2 / (1 + a2), impulse scale is = 1 / (1 + a2), bias rate br = omega / a1
//   soft:  lambda += -(ms vn + bias) / K - is lambda, bias = ms br s, lambda >= 0
//   relax: lambda += -vn / K, lambda >= 0; then friction, lambda_t += -vt / K_t with K_t the
//   largest in the tangent plane, projected onto |lambda_t| <= mu lambda (a true cone) speculative
//   points (s > 0): lambda += -(vn + s / h) / K in both.
// Order: 2 in the position of smooth motion, 1 in impacts. Cost: about 100 ns a point and sub-step.
#include "server/dynamics/contact/soft_batch.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/dynamics/contact/contact_kernels.h"
#include "server/dynamics/contact/single_contacts.h"

namespace cradle {
namespace {

/// Each with unit, reason, and the test that pins it.
struct SoftTolerances {
  double frequency = 0.177;    ///< c, of 1/h: at 0.25 stacks rock on their corners ("stack of ten")
  double damping_ratio = 5;    ///< zeta: overlaps close without bouncing ("half overlapped")
  double push_speed = 0.3;     ///< m/s: floor of the push-out limit ("half overlapped")
  double push_rate = 4;        ///< 1/s: lets deep overlaps part within a second ("half overlapped")
  double smooth_factor = 3;    ///< a velocity change below 3 h |a| is no impact ("sliding stop")
  double bounce_speed = 1e-3;  ///< m/s: floor of the restitution threshold ("comes to rest")
};
constexpr SoftTolerances kTolerances;

/// Sweeps of restitution over all contacts. A body that hits two others in a tick needs more than
/// one: of 10 000 elastic spheres' energy, 1 / 2 / 4 / 8 / 16 lose 13 / 3.9 / 0.4 / 0.24 / 0.23 %
/// in 6 s.
constexpr int kRestitutionPasses = 8;

SubStep sub_step_of(double h) {
  const double omega = 2 * std::numbers::pi * kTolerances.frequency / h;
  const double a1 = 2 * kTolerances.damping_ratio + h * omega;
  const double a2 = h * omega * a1;
  return {h,          a2 / (1 + a2),          1 / (1 + a2),
          omega / a1, kTolerances.push_speed, kTolerances.push_rate};
}

}  // namespace

double contact_angle() { return 2 * std::numbers::pi * kTolerances.frequency; }

void SoftBatch::advance(const ContactTick& tick, const BodyArrays& arrays,
                        std::span<const Matrix> inverse_inertia_W,
                        std::span<ContactConstraint* const> constraints) {
  kernels_ = &contact_kernels_of(tick.lanes);
  step_ = sub_step_of(tick.dt / tick.sub_steps);
  bodies_.begin(tick, arrays, inverse_inertia_W);
  for (ContactConstraint* c : constraints) {
    for (ConstraintPoint& p : c->used()) {
      p.lambda = step_.h * p.force;
      p.lambda_t = step_.h * p.force_t;
    }
  }
  sort(constraints);

  for (int sub_step = 0; sub_step < tick.sub_steps; ++sub_step) {
    bodies_.integrate_velocities(step_.h);
    if (sub_step == 0) warm_start();
    solve();
    bodies_.integrate_positions(step_.h, kTolerances.smooth_factor);
    relax();
  }
  blocks_.unpack();
  for (int pass = 0; pass < kRestitutionPasses && apply_restitution(arrays); ++pass) {
  }
  bodies_.finish();
  for (ContactConstraint* c : constraints) {
    for (ConstraintPoint& p : c->used()) {
      p.force = p.lambda / step_.h;
      p.force_t = p.lambda_t / step_.h;
    }
  }
}

/// Into blocks; single contacts, and those that bounce.
void SoftBatch::sort(std::span<ContactConstraint* const> constraints) {
  blocks_.pack(constraints, bodies_);
  for (const BlockRun& run : blocks_.runs()) kernels_->prepare(run, step_);
  singles_.clear();
  bouncing_.clear();
  for (ContactConstraint* c : constraints) {
    if (c->is_ahead || c->restitution > 0) find_effective_masses(*c);
    if (c->is_ahead) singles_.push_back(c);
    if (c->restitution > 0) bouncing_.push_back(c);
  }
}

void SoftBatch::warm_start() {
  for (const BlockRun& run : blocks_.runs()) kernels_->warm_start(run, bodies_.velocities());
  for (ContactConstraint* c : singles_) SingleContact(*c, bodies_).warm_start();
}

void SoftBatch::solve() {
  for (const BlockRun& run : blocks_.runs()) kernels_->solve(run, step_, bodies_.velocities());
  for (ContactConstraint* c : singles_) SingleContact(*c, bodies_).solve(step_);
}

void SoftBatch::relax() {
  for (const BlockRun& run : blocks_.runs()) {
    kernels_->relax(run, step_, bodies_.velocities(), bodies_.motions());
  }
  for (ContactConstraint* c : singles_) SingleContact(*c, bodies_).relax(step_);
}

/// Newton's law, after the sub-steps, with the speed of the impact: v_i^2 = v^2 - 2 a s from the
/// tick's start, and the outgoing speed as it is where the tick ends, v_o^2 = e^2 v_i^2 + 2 a s
/// (energy in the acceleration a along the normal; negative: towards the surface). True if an
/// impulse has changed: then others may have to.
bool SoftBatch::apply_restitution(const BodyArrays& arrays) {
  bool has_changed = false;
  for (ContactConstraint* constraint : bouncing_) {
    ContactConstraint& c = *constraint;
    const double a = c.n.dot(arrays.acceleration[static_cast<std::size_t>(c.b)] -
                             arrays.acceleration[static_cast<std::size_t>(c.a)]);
    // What the acceleration alone gives in two sub-steps is a contact at rest.
    const double threshold = std::max(2 * std::abs(a) * step_.h, kTolerances.bounce_speed);
    SingleContact contact(c, bodies_);
    for (ConstraintPoint& p : c.used()) {
      if (p.approach > -threshold || p.lambda_max == 0) continue;
      const double impact = std::max(p.approach * p.approach - 2 * a * p.s0, 0.0);
      const double leaving = c.restitution * c.restitution * impact + 2 * a * contact.separation(p);
      const double speed = std::sqrt(std::max(leaving, 0.0));
      const double lambda = p.lambda;
      contact.add_normal(p, (speed - contact.normal_velocity(p)) / p.K_normal);
      has_changed = has_changed || p.lambda != lambda;
    }
  }
  return has_changed;
}

}  // namespace cradle
