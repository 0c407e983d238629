#include "server/dynamics/contact/contact_sweeps.h"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>

namespace cradle {
namespace {

using SweptPoint = ContactSystem::Point;

Vector own_velocity(const SweptPoint& point, const BodyLine* lines) {
  return ContactSystem::velocity(point, lines) + Vector(point.bias, 0, 0);
}

/// The impulse with which the point would stick, if its cone allows for that.
bool sticks(const SweptPoint& point, const Vector& impulse, const Vector& u, Vector& stuck) {
  stuck = impulse - point.inverse_K * u;
  return stuck.x() >= 0 && stuck.tail<2>().norm() <= point.c->friction * stuck.x();
}

Vector pressed(const SweptPoint& point, Vector impulse, const Vector& u) {
  impulse.x() = std::max(impulse.x() - u.x() / point.K.x(), 0.0);
  return impulse;
}

/// Towards where it would not slide; `impulse` has its new normal part already.
Vector rubbed(const SweptPoint& point, Vector impulse, const Vector& u) {
  Eigen::Vector2d t = impulse.tail<2>() - u.tail<2>() / (point.K.y() + point.K.z());
  const double most = point.c->friction * impulse.x(), size = t.norm();
  if (size > most) t *= most / size;
  impulse.tail<2>() = t;
  return impulse;
}

/// m/s, the largest change of what a point's impulse does to itself.
double take(const SweptPoint& point, Vector& impulse, const Vector& now, BodyLine* lines) {
  const Vector change = now - impulse;
  if (change.isZero(0)) return 0;
  ContactSystem::push(point, change, lines);
  impulse = now;
  return point.K.cwiseProduct(change).cwiseAbs().maxCoeff();
}

}  // namespace

bool sweep(ContactSystem::Points points, std::span<Vector> impulses, BodyLine* lines,
           const SweepSettings& settings) {
  assert(points.size() == impulses.size());
  double first = 0;
  for (int k = 0; k < settings.sweeps_max; ++k) {
    double most = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const SweptPoint& point = points[i];
      if (!point.acts) continue;
      const Vector u = own_velocity(point, lines);
      Vector stuck;
      if (settings.has_friction && sticks(point, impulses[i], u, stuck)) {
        most = std::max(most, take(point, impulses[i], stuck, lines));
        continue;
      }
      most = std::max(most, take(point, impulses[i], pressed(point, impulses[i], u), lines));
      if (!settings.has_friction) continue;
      const Vector now = rubbed(point, impulses[i], own_velocity(point, lines));
      most = std::max(most, take(point, impulses[i], now, lines));
    }
    first = std::max(first, most);
    if (most <= std::max(settings.enough * first, settings.still)) return true;
  }
  return false;
}

}  // namespace cradle
