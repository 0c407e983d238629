// A force F at the point P acts on the centre of mass as F and turns the body by the torque
// (p_WP - p_WBcm) x F: the arm points from the centre to the point (the seed paper prints the
// opposite sign).
#include "server/world/wrenches.h"

#include <algorithm>

namespace cradle {
namespace {

/// What moves a body, as long as no wrench and no contact acts on it.
Course course_of(const BodyTable& bodies, std::size_t i) {
  if (bodies.quarantined[i] != 0 || bodies.is_asleep(i)) return Course::still;
  if (bodies.kind[i] == BodyKind::dynamic) return Course::falls;
  return bodies.kind[i] == BodyKind::kinematic ? Course::driven : Course::still;
}

/// An impulse to the velocities, a force to the loads.
void add(const Resultant& load, BodyTable& bodies, std::size_t i, Loads& loads) {
  if (!load.is_impulse) {
    loads.acceleration[i] += bodies.inverse_mass[i] * load.linear;
    (load.angular_in_P ? loads.torque_P : loads.torque_W)[i] += load.angular;
    return;
  }
  const Rotation& q = bodies.q[i];
  const Vector angular_P = load.angular_in_P ? load.angular : q.conjugate() * load.angular;
  const Vector dv = bodies.inverse_mass[i] * load.linear;
  const Vector dw_P = angular_P.cwiseProduct(bodies.inverse_inertia[i]);
  const Vector w_P = q.conjugate() * bodies.w[i];
  loads.impulses_J += load.linear.dot(bodies.v[i] + 0.5 * dv) + angular_P.dot(w_P + 0.5 * dw_P);
  bodies.v[i] += dv;
  bodies.w[i] += q * dw_P;
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
  Resultant load;
  load.is_impulse = is_impulse;
  load.linear_turns = wrench.frame == WrenchFrame::body && !is_couple;
  if (wrench.frame == WrenchFrame::body) {
    // What has direction and point in B turns the body by a torque that is constant in B, and in P.
    const Rotation q_PB = bodies.q_BP[i].conjugate();
    const bool has_point_in_B = wrench.point_kind == WrenchPoint::body_point;
    load.angular_in_P = is_couple || has_point_in_B;
    if (is_couple) {
      load.angular = q_PB * value;
      return load;
    }
    load.linear = q_WB * value;
    if (has_point_in_B) load.angular = q_PB * arm_B.cross(value);
    if (load.angular_in_P) return load;
    value = load.linear;
  }
  if (is_couple) {
    load.angular = value;
    return load;
  }
  load.linear = value;
  if (wrench.point_kind == WrenchPoint::world_point) {
    load.arm_W = to_eigen(wrench.point) - bodies.x[i];
  }
  if (wrench.point_kind == WrenchPoint::body_point) load.arm_W = q_WB * arm_B;
  load.arm_turns = wrench.point_kind == WrenchPoint::body_point;
  load.angular = load.arm_W.cross(value);
  return load;
}

void gather_loads(std::span<const ActiveWrench> wrenches, bool is_first, const Vector& gravity_W,
                  BodyTable& bodies, Loads& loads) {
  loads.course.resize(bodies.size());
  loads.acceleration.resize(bodies.size());
  loads.torque_W.resize(bodies.size());
  loads.torque_P.resize(bodies.size());
  loads.impulses_J = 0;
  loads.pushed.clear();
  loads.resultants.clear();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    loads.course[i] = course_of(bodies, i);
    if (loads.course[i] == Course::driven) loads.set_to_gravity(i, Vector::Zero());
  }
  for (const ActiveWrench& active : wrenches) {
    const std::size_t i = *bodies.slot(active.wrench.body);
    if (loads.course[i] != Course::pushed) {
      loads.course[i] = Course::pushed;
      loads.pushed.push_back(static_cast<std::int32_t>(i));
      loads.set_to_gravity(i, gravity_W);
    }
    const Resultant load = resultant(active.wrench, bodies, i);
    if (loads.keeps_resultants) loads.resultants.push_back({static_cast<std::int32_t>(i), load});
    if (is_first || !load.is_impulse) add(load, bodies, i, loads);
  }
  std::sort(loads.pushed.begin(), loads.pushed.end());
}

void count_down(std::vector<ActiveWrench>& wrenches) {
  for (ActiveWrench& active : wrenches) {
    if (active.ticks_left != kUntilCleared) --active.ticks_left;
  }
  std::erase_if(wrenches, [](const ActiveWrench& active) { return active.ticks_left == 0; });
}

}  // namespace cradle
