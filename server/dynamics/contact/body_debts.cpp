// What bounces pays for what is pushed out.
//
// A corner that a tick swings down is not among the points found at its start: it sinks in, and
// what it falls by is motion then. Soft contacts push it out again, which lifts the body, and takes
// nothing from its motion: boxes with restitution 1 gained up to 1e-3 of their energy in 10 s.
//
// So in islands whose contacts all return everything, with restitution 1, the tick's account is
// looked at,
//   D = change of kinetic energy - work of the loads on the ways that the bodies went,
// which their contacts leave at 0 or below. What is above is a debt, and is taken from the motion:
// of islands that touch what does not yield from that along the loads, if it can pay, so that
// momentum across them is kept; else from all of it. Of other islands from the motion about the
// centre of mass, which keeps all their momentum. Larger debts are left: an overlap that
// was there before must be pushed out by somebody. So are islands with torques and with kinematic
// bodies, whose work is not known here; and islands that lose energy anyway, which keep their
// momentum instead.
#include <algorithm>
#include <cmath>

#include "server/dynamics/contact/body_lines.h"

namespace cradle {
namespace {

constexpr double kGrain = 1e-12;       // of the kinetic energy: rounding is no debt
constexpr double kPayable = 1.0 / 16;  // of what pays: larger debts are not of what bounces

}  // namespace

void BodyLines::begin_debts(std::span<ContactConstraint* const> constraints) {
  debts_.assign(islands_count_, {});
  for (const ContactConstraint* c : constraints) {
    const std::int32_t a = line(c->a), b = line(c->b);
    Debt& debt = debts_[island_of(a, b)];
    debt.bounces &= c->restitution == 1;
    debt.is_held |= !yields(a) || !yields(b);
    debt.is_driven |= is_driven(a) || is_driven(b);
  }
  for (std::int32_t line = 0; line < moving_; ++line) {
    Debt& debt = debts_[island_of(line)];
    debt.is_driven |= at(states_, line).is_twisted;
    if (debt.bounces) debt.sum_J -= kinetic_energy(line, v(line), w(line));
  }
}

Vector BodyLines::along_loads(std::int32_t line) const {
  const Vector a = acceleration(line);
  const double size = a.norm();
  return size > 0 ? Vector(a / size) : Vector(Vector::Zero());
}

double BodyLines::pay_debts() {
  for (std::int32_t line = 0; line < moving_; ++line) {
    Debt& debt = debts_[island_of(line)];
    if (!debt.bounces) continue;
    const double kinetic_J = kinetic_energy(line, v(line), w(line));
    debt.kinetic_J += kinetic_J;
    debt.sum_J += kinetic_J - mass(line) * acceleration(line).dot(dp(line));
    debt.mass += mass(line);
    debt.momentum += mass(line) * v(line);
    const double along = along_loads(line).dot(v(line));
    debt.along_J += 0.5 * mass(line) * along * along;
  }
  double paid_J = 0;
  for (Debt& debt : debts_) {
    debt.share = 1;
    if (!debt.bounces || debt.is_driven || debt.sum_J <= kGrain * debt.kinetic_J) continue;
    if (!debt.is_held) debt.v = debt.momentum / debt.mass;
    debt.is_along = debt.is_held && debt.sum_J <= kPayable * debt.along_J;
    const double payer_J =
        debt.is_along ? debt.along_J : debt.kinetic_J - 0.5 * debt.mass * debt.v.squaredNorm();
    if (debt.sum_J > kPayable * payer_J) continue;
    debt.share = std::sqrt(1 - debt.sum_J / payer_J);
    paid_J += debt.sum_J;
  }
  if (paid_J == 0) return 0;
  for (std::int32_t line = 0; line < moving_; ++line) {
    const Debt& debt = debts_[island_of(line)];
    if (debt.share == 1) continue;
    if (debt.is_along) {
      const Vector along = along_loads(line);
      v(line) += (debt.share - 1) * along.dot(v(line)) * along;
      continue;
    }
    v(line) = debt.v + debt.share * (v(line) - debt.v);
    w(line) *= debt.share;
  }
  return paid_J;
}

}  // namespace cradle
