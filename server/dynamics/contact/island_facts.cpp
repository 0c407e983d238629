#include "server/dynamics/contact/island_facts.h"

#include "server/collision/index.h"

namespace cradle {
namespace {

/// m/s^2, as if the heavier body lay on the lighter one.
double first_press(const ContactConstraint& c, const BodyArrays& arrays) {
  const double a = arrays.acceleration[index(c.a)].norm(),
               b = arrays.acceleration[index(c.b)].norm();
  const double lighter = std::max(c.inverse_mass_A, c.inverse_mass_B);
  const double heavier = std::min(c.inverse_mass_A, c.inverse_mass_B);
  return std::max(a, b) * (heavier > 0 ? 1 + lighter / heavier : 1);
}

}  // namespace

BodyMotion motion_of(std::size_t slot, const BodyArrays& arrays, double dt, int bodies) {
  const double acceleration = arrays.acceleration[slot].norm();
  const double slow = kRestTicks * dt * acceleration;
  return {dt * arrays.v[slot].norm() / bodies, acceleration,
          arrays.v[slot].squaredNorm() <= slow * slow,
          !arrays.poise.empty() && arrays.poise[slot].free > 0};
}

ContactLook look_of(const ContactConstraint& c, const BodyArrays& arrays, double dt) {
  ContactLook look;
  look.press = c.press > 0 ? c.press : c.is_met ? first_press(c, arrays) : 0;
  look.tolerance_m = c.tolerance_m;
  look.relative_way = dt * (arrays.v[index(c.b)] - arrays.v[index(c.a)]).norm();
  look.was_pressed = c.press > 0;
  look.is_met = c.is_met;
  look.is_known = c.is_known;
  look.is_deep = c.deepest_m > push_speed() * dt;
  look.is_ahead = c.is_ahead;
  look.is_special = c.is_ahead || c.bounces || c.has_rested;
  look.is_single = c.count == 1;
  look.is_askew = c.carrying > 0 && c.carrying < c.count;
  look.is_driven = arrays.is_driven(index(c.a)) || arrays.is_driven(index(c.b));
  return look;
}

}  // namespace cradle
