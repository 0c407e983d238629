/// Planar worlds for tests, and bodies for them.
#pragma once

#include <random>

#include "server/dynamics/rotation.h"
#include "tests/physics/flock.h"
#include "tests/physics/worlds.h"

namespace cradle {

inline WorldSettings planar_settings(const Vec3& gravity_W, double rate_hz = 60) {
  WorldSettings s = settings(rate_hz, gravity_W);
  s.is_planar = true;
  return s;
}

inline Quat about_z(double angle_rad) {
  return {std::cos(angle_rad / 2), 0, 0, std::sin(angle_rad / 2)};
}

/// Solid below y = height, tilted by `slope_rad` upwards to the right.
inline BodySpec level(double height_m, double slope_rad = 0, double friction = 0.5) {
  BodySpec spec = ground(friction);
  spec.p_WBo = {0, height_m, 0};
  const double h = std::sqrt(0.5);
  spec.q_WB = {h, -h * std::cos(slope_rad), -h * std::sin(slope_rad), 0};
  return spec;
}

/// A ball that turns as a disc about every axis: alike in the plane and in space.
inline BodySpec disc(double radius_m, const Vec3& p_WBo, const Vec3& v_WBcm = {}) {
  BodySpec spec = ball(radius_m, p_WBo, v_WBcm);
  const double J = 0.5 * spec.mass_kg * radius_m * radius_m;
  spec.inertia_kgm2 = {J, J, J};
  return spec;
}

/// Angle between two attitudes about z, rad, exact for small ones.
inline double turn_between(const Quat& a, const Quat& b) {
  const Rotation d = to_eigen(a).conjugate() * to_eigen(b);
  return 2 * std::atan2(d.vec().norm(), std::abs(d.w()));
}
inline double norm_of(const Quat& q) { return to_eigen(q).norm(); }

/// By bits: not even -0.
inline bool is_in_plane(const BodyState& s) {
  for (const double zero : {s.p_WBo.z, s.v_WBcm.z, s.w_WB.x, s.w_WB.y, s.q_WB.x, s.q_WB.y}) {
    if (zero != 0 || std::signbit(zero)) return false;
  }
  return true;
}

/// A sphere or box of about half a metre, or a body without shape, anywhere, with any velocities.
inline BodySpec random_planar_body(std::mt19937_64& random) {
  const auto any = [&](double size) {
    return Vec3{uniform(random, -size, size), uniform(random, -size, size), 0};
  };
  BodySpec spec;
  spec.mass_kg = uniform(random, 0.5, 5);
  const std::uint64_t shape = random() % 4;
  if (shape == 0) {
    const double mass_kg = spec.mass_kg;
    spec = disc(uniform(random, 0.2, 0.5), {});
    spec.mass_kg = mass_kg;
  }
  if (shape == 1) {
    spec.shape = Shape::box({uniform(random, 0.2, 0.5), uniform(random, 0.2, 0.5), 0.3});
  }
  if (shape == 2) {
    spec.inertia_kgm2 = {0.3, 0.4, uniform(random, 0.2, 0.6)};
    spec.inertia_products_kgm2 = {uniform(random, -0.02, 0.02), 0, 0};
  }
  if (shape == 3) {
    spec.shape = Shape::box({0.2, 0.3, 0.4});
    spec.sets_centre_of_mass = true;
    spec.p_BoBcm = any(0.1);
  }
  // Far from each other: nothing touches.
  spec.p_WBo = {uniform(random, -1e4, 1e4), uniform(random, -1e4, 1e4), 0};
  spec.q_WB = about_z(uniform(random, -3, 3));
  spec.v_WBcm = any(10);
  if (random() % 4 != 0) spec.w_WB.z = 60 * std::pow(10, uniform(random, -3, 0.3));
  return spec;
}

/// Any quantity, frame, point and duration.
inline Wrench random_planar_wrench(std::mt19937_64& random, BodyId body) {
  Wrench wrench;
  wrench.body = body;
  constexpr WrenchQuantity quantities[] = {WrenchQuantity::force, WrenchQuantity::torque,
                                           WrenchQuantity::impulse, WrenchQuantity::angular_impulse,
                                           WrenchQuantity::acceleration};
  wrench.quantity = quantities[random() % 5];
  wrench.frame = random() % 2 == 0 ? WrenchFrame::world : WrenchFrame::body;
  const bool is_couple = wrench.quantity == WrenchQuantity::torque ||
                         wrench.quantity == WrenchQuantity::angular_impulse;
  if (is_couple) {
    wrench.value = {0, 0, uniform(random, -0.5, 0.5)};
  } else {
    wrench.value = {uniform(random, -5, 5), uniform(random, -5, 5), 0};
    if (random() % 2 == 0) {
      wrench.point_kind = WrenchPoint::body_point;
      wrench.point = {uniform(random, -0.3, 0.3), uniform(random, -0.3, 0.3), 0};
    }
  }
  const bool is_impulse = wrench.quantity == WrenchQuantity::impulse ||
                          wrench.quantity == WrenchQuantity::angular_impulse;
  if (!is_impulse && random() % 2 == 0) {
    wrench.duration = WrenchDuration::ticks;
    wrench.ticks = 1 + static_cast<std::int64_t>(random() % 200);
  }
  return wrench;
}

}  // namespace cradle
