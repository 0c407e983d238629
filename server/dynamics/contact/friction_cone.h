/// The nearest point of the cone |t| <= mu n, along n, t1, t2, and how it moves with what it is
/// nearest to.
///   |yt| <= mu yn: y itself (sticks);  gn = (yn + mu |yt|) / (1 + mu^2) <= 0: 0 (open);
///   else g = gn (1, mu t), t = yt / |yt| (slides)
#pragma once

#include <cmath>
#include <cstdint>

#include "server/collision/geometry.h"

namespace cradle {

enum class ConeState : std::uint8_t { open, sticks, slides };

struct OnCone {
  Vector g;
  ConeState state;
};

inline OnCone on_cone(const Vector& y, double mu) {
  const double yt = std::sqrt(y.y() * y.y() + y.z() * y.z());
  if (mu > 0 && yt <= mu * y.x()) return {y, ConeState::sticks};
  const double n = (y.x() + mu * yt) / (1 + mu * mu);
  if (!(n > 0)) return {Vector::Zero(), ConeState::open};
  const double pull = yt > 0 ? mu * n / yt : 0;
  return {{n, pull * y.y(), pull * y.z()}, ConeState::slides};
}

/// dg / dy: symmetric, between 0 and 1.
inline Matrix cone_derivative(const Vector& y, double mu) {
  const OnCone at = on_cone(y, mu);
  if (at.state == ConeState::open) return Matrix::Zero();
  if (at.state == ConeState::sticks) return Matrix::Identity();
  const double yt = std::sqrt(y.y() * y.y() + y.z() * y.z());
  const Vector t = yt > 0 ? Vector(0, y.y() / yt, y.z() / yt) : Vector(Vector::Zero());
  const Vector edge = Vector::UnitX() + mu * t;
  Matrix across = -t * t.transpose();
  across(1, 1) += 1;
  across(2, 2) += 1;
  const double turns = yt > 0 ? mu * at.g.x() / yt : 0;
  return edge * edge.transpose() / (1 + mu * mu) + turns * across;
}

}  // namespace cradle
