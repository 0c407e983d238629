// A force F at the point P acts on the centre of mass as F and turns the body by the torque
// (p_WP - p_WBcm) x F: the arm points from the centre to the point (the seed paper prints the
// opposite sign).
#include "server/world/wrenches.h"

#include <algorithm>

namespace cradle {
namespace {

/// What moves a body, as long as no wrench and no contact acts on it.
Course course_of(const BodyTable& bodies, std::size_t i) {
  if (bodies.quarantined[i] != 0) return Course::still;
  if (bodies.kind[i] == BodyKind::dynamic) return Course::falls;
  return bodies.kind[i] == BodyKind::kinematic ? Course::driven : Course::still;
}

/// An impulse to the velocities, a force to the loads.
void add(const Wrench& wrench, BodyTable& bodies, std::size_t i, Loads& loads) {
  const Resultant load = resultant(wrench, bodies, i);
  if (!load.is_impulse) {
    loads.acceleration[i] += bodies.inverse_mass[i] * load.linear;
    (load.turns_with_body ? loads.torque_P : loads.torque_W)[i] += load.angular;
    return;
  }
  const Rotation& q = bodies.q[i];
  const Vector angular_P = load.turns_with_body ? load.angular : q.conjugate() * load.angular;
  bodies.v[i] += bodies.inverse_mass[i] * load.linear;
  bodies.w[i] += q * angular_P.cwiseProduct(bodies.inverse_inertia[i]);
}

}  // namespace

Resultant resultant(const Wrench& wrench, const BodyTable& bodies, std::size_t i) {
  const Rotation q_WB = bodies.frame(i).q_WB;
  Vector value = to_eigen(wrench.value);
  if (wrench.quantity == WrenchQuantity::acceleration) value *= bodies.mass[i];
  const bool is_impulse = wrench.quantity == WrenchQuantity::impulse ||
                          wrench.quantity == WrenchQuantity::angular_impulse;
  const bool is_couple = wrench.quantity == WrenchQuantity::torque ||
                         wrench.quantity == WrenchQuantity::angular_impulse;
  const Vector arm_B = to_eigen(wrench.point) - bodies.p_BoBcm[i];  // of a body point
  if (wrench.frame == WrenchFrame::body) {
    // What has direction and point in B turns the body by a torque that is constant in B, and in P.
    const Rotation q_PB = bodies.q_BP[i].conjugate();
    if (is_couple) return {Vector::Zero(), q_PB * value, is_impulse, true};
    if (wrench.point_kind == WrenchPoint::body_point) {
      return {q_WB * value, q_PB * arm_B.cross(value), is_impulse, true};
    }
    value = q_WB * value;
  }
  if (is_couple) return {Vector::Zero(), value, is_impulse, false};

  Vector arm = Vector::Zero();
  if (wrench.point_kind == WrenchPoint::world_point) arm = to_eigen(wrench.point) - bodies.x[i];
  if (wrench.point_kind == WrenchPoint::body_point) arm = q_WB * arm_B;
  return {value, arm.cross(value), is_impulse, false};
}

void begin_tick(std::vector<ActiveWrench>& wrenches, const Vector& gravity_W, BodyTable& bodies,
                Loads& loads) {
  loads.course.resize(bodies.size());
  loads.acceleration.resize(bodies.size());
  loads.torque_W.resize(bodies.size());
  loads.torque_P.resize(bodies.size());
  loads.pushed.clear();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    loads.course[i] = course_of(bodies, i);
    if (loads.course[i] == Course::driven) loads.set_to_gravity(i, Vector::Zero());
  }
  for (ActiveWrench& active : wrenches) {
    const std::size_t i = *bodies.slot(active.wrench.body);
    if (loads.course[i] != Course::pushed) {
      loads.course[i] = Course::pushed;
      loads.pushed.push_back(static_cast<std::int32_t>(i));
      loads.set_to_gravity(i, gravity_W);
    }
    add(active.wrench, bodies, i, loads);
    if (active.ticks_left != kUntilCleared) --active.ticks_left;
  }
  std::sort(loads.pushed.begin(), loads.pushed.end());
  std::erase_if(wrenches, [](const ActiveWrench& active) { return active.ticks_left == 0; });
}

}  // namespace cradle
