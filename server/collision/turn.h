/// Rotation vectors (rad) and quaternions, without libm, so that no CPU changes their bits.
///
/// exp of a rotation vector r, |r| <= 0.4, by the series of sin and cos in p = |r|^2 / 4; larger
/// ones by halving r and squaring the quaternion. Error below 1e-16 for small r, and about one
/// rounding a squaring above. log goes the other way: square roots of the quaternion until its
/// angle is small, then the series of the inverse sine.
#pragma once

#include <cmath>

#include "server/collision/geometry.h"

namespace cradle {

/// exp(r/2) for |r| <= 0.4: (cos(|r|/2), sin(|r|/2) r/|r|), truncated below 1e-17 relative.
inline Rotation small_rotation_exp(const Vector& r) {
  const double p = r.squaredNorm() / 4;
  const double cosine =
      1 - p * (1.0 / 2 - p * (1.0 / 24 - p * (1.0 / 720 - p * (1.0 / 40320 - p / 3628800))));
  const double half_sinc =
      0.5 *
      (1 - p * (1.0 / 6 - p * (1.0 / 120 - p * (1.0 / 5040 - p * (1.0 / 362880 - p / 39916800)))));
  return {cosine, half_sinc * r.x(), half_sinc * r.y(), half_sinc * r.z()};
}

/// The rotation by |r| rad about r.
inline Rotation rotation_exp(Vector r) {
  int halvings = 0;
  while (r.squaredNorm() > 0.16 && halvings < 64) {
    r *= 0.5;
    ++halvings;
  }
  Rotation q = small_rotation_exp(r);
  while (halvings-- > 0) q = q * q;
  return q;
}

/// q to unit length; q must not be zero.
inline Rotation normalised(const Rotation& q) {
  const double norm = std::sqrt(q.coeffs().squaredNorm());
  return Rotation(q.coeffs() / norm);
}

/// The rotation vector of q, a unit quaternion, at most half a turn long. Error below 1e-15.
inline Vector rotation_log(Rotation q) {
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  double doublings = 2;
  while (q.w() < 0.998) {  // four times at most
    q.w() += 1;
    q = normalised(q);
    doublings *= 2;
  }
  const double p = q.vec().squaredNorm();  // below 0.004
  const double arc_sinc =
      1 +
      p * (1.0 / 6 + p * (3.0 / 40 + p * (15.0 / 336 + p * (105.0 / 3456 + p * 945.0 / 42240))));
  return doublings * arc_sinc * q.vec();
}

}  // namespace cradle
