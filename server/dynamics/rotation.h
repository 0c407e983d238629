/// Rotations without libm, so that no CPU changes their bits.
///
/// exp of a rotation vector r, |r| <= 0.4, by the series of sin and cos in p = |r|^2 / 4; larger
/// ones by halving r and squaring the quaternion. Error below 1e-16 for small r, and about one
/// rounding a squaring above.
#pragma once

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

/// J in W from the principal moments in B (or their inverses).
inline Matrix rotated_diagonal(const Matrix& R_WB, const Vector& diagonal) {
  return R_WB * diagonal.asDiagonal() * R_WB.transpose();
}

}  // namespace cradle
