// A force F at the point P acts on the centre of mass as F and turns the body by the torque
// (p_WP - p_WBcm) x F: the arm points from the centre to the point (the seed paper prints the
// opposite sign).
#include "server/world/wrenches.h"

#include "server/dynamics/rotation.h"

namespace cradle {

Resultant resultant(const Wrench& wrench, const BodyTable& bodies, std::size_t i) {
  const Rotation q_WB = bodies.frame(i).q_WB;
  Vector value = to_eigen(wrench.value);
  if (wrench.frame == WrenchFrame::body) value = q_WB * value;
  if (wrench.quantity == WrenchQuantity::acceleration) value *= bodies.mass[i];

  Vector arm = Vector::Zero();
  if (wrench.point_kind == WrenchPoint::world_point) arm = to_eigen(wrench.point) - bodies.x[i];
  if (wrench.point_kind == WrenchPoint::body_point) {
    arm = q_WB * (to_eigen(wrench.point) - bodies.p_BoBcm[i]);
  }

  switch (wrench.quantity) {
    case WrenchQuantity::torque:
      return {Vector::Zero(), value, false};
    case WrenchQuantity::angular_impulse:
      return {Vector::Zero(), value, true};
    case WrenchQuantity::impulse:
      return {value, arm.cross(value), true};
    case WrenchQuantity::force:
    case WrenchQuantity::acceleration:
      break;
  }
  return {value, arm.cross(value), false};
}

void begin_tick(std::vector<ActiveWrench>& wrenches, const Vector& gravity_W, BodyTable& bodies,
                Loads& loads) {
  loads.acceleration.assign(bodies.size(), Vector::Zero());
  loads.torque.assign(bodies.size(), Vector::Zero());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies.is_moving(i)) loads.acceleration[i] = gravity_W;
  }
  for (ActiveWrench& active : wrenches) {
    const std::size_t i = *bodies.slot(active.wrench.body);
    const Resultant load = resultant(active.wrench, bodies, i);
    if (load.is_impulse) {
      const Matrix inverse_inertia_W =
          rotated_diagonal(bodies.q[i].toRotationMatrix(), bodies.inverse_inertia[i]);
      bodies.v[i] += bodies.inverse_mass[i] * load.linear;
      bodies.w[i] += inverse_inertia_W * load.angular;
    } else {
      loads.acceleration[i] += bodies.inverse_mass[i] * load.linear;
      loads.torque[i] += load.angular;
    }
    if (active.ticks_left != kUntilCleared) --active.ticks_left;
  }
  std::erase_if(wrenches, [](const ActiveWrench& active) { return active.ticks_left == 0; });
}

}  // namespace cradle
