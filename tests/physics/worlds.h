/// Small worlds for tests, and what one wants to know of them.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "server/world/world.h"

namespace cradle {

inline constexpr double kGravity = 9.81;  // m/s^2

inline WorldSettings settings(double rate_hz = 60, const Vec3& gravity_W = {0, 0, -kGravity}) {
  WorldSettings s;
  s.rate_hz = rate_hz;
  s.gravity_W = gravity_W;
  s.is_sleeping = false;  // all is computed in every tick, unless a test is about sleep
  return s;
}
inline WorldSettings weightless(double rate_hz = 60) { return settings(rate_hz, {}); }

inline BodySpec ball(double radius_m, const Vec3& p_WBo, const Vec3& v_WBcm = {}) {
  BodySpec spec;
  spec.shape = Shape::sphere(radius_m);
  spec.mass_kg = 1;
  spec.p_WBo = p_WBo;
  spec.v_WBcm = v_WBcm;
  return spec;
}

inline BodySpec brick(const Vec3& half_extents_m, const Vec3& p_WBo, const Vec3& v_WBcm = {}) {
  BodySpec spec;
  spec.shape = Shape::box(half_extents_m);
  spec.mass_kg = 1;
  spec.p_WBo = p_WBo;
  spec.v_WBcm = v_WBcm;
  return spec;
}

/// Solid below z = 0.
inline BodySpec ground(double friction = 0.5) {
  BodySpec spec;
  spec.kind = BodyKind::fixed;
  spec.shape = Shape::half_space();
  spec.material.friction = friction;
  return spec;
}

inline BodyId add(World& world, const BodySpec& spec) { return world.spawn(std::array{spec}).body; }

inline BodyState state(const World& world, BodyId body) {
  BodyState s;
  world.find(body, s);
  return s;
}

/// Kinetic and potential, J.
inline double energy(const World& world) {
  const Totals totals = world.totals();
  return totals.kinetic_energy_J + totals.potential_energy_J;
}

inline void steps(World& world, int count) {
  for (int i = 0; i < count; ++i) world.step();
}

inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline double norm(const Vec3& v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }
inline double distance(const Vec3& a, const Vec3& b) { return norm(a - b); }

/// Angle between two attitudes, rad.
inline double angle(const Quat& a, const Quat& b) {
  const double dot = std::abs(a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z);
  return 2 * std::acos(std::fmin(dot, 1.0));
}

}  // namespace cradle
