/// Vectors, poses and boxes inside the physics: Eigen types, SI units, world frame unless named.
#pragma once

#include <cradle/types.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

namespace cradle {

using Vector = Eigen::Vector3d;
using Vector2 = Eigen::Vector2d;
using Matrix = Eigen::Matrix3d;
using Rotation = Eigen::Quaterniond;

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline Vector to_eigen(const Vec3& v) { return {v.x, v.y, v.z}; }
inline Rotation to_eigen(const Quat& q) { return {q.w, q.x, q.y, q.z}; }
inline Vec3 to_plain(const Vector& v) { return {v.x(), v.y(), v.z()}; }
inline Quat to_plain(const Rotation& q) { return {q.w(), q.x(), q.y(), q.z()}; }

/// `size`, or -size where d is below 0. Where that is chance it takes no branch.
inline double toward(double d, double size) {
  constexpr int kSign = 63;
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(size) ^ std::uint64_t{d < 0} << kSign);
}

/// `x`, but no less than `low` and no more than `high`; NaN gives `low`. GCC 12 branches for
/// std::clamp, and for std::max and std::min with a constant behind.
inline double within(double low, double x, double high) { return std::min(high, std::max(low, x)); }

/// Where a shape is: a point of B is `x + R * r_B` in W.
struct Pose {
  Vector x = Vector::Zero();
  Matrix R = Matrix::Identity();
};

/// Axis-aligned box in W; empty unless lower <= upper.
struct Aabb {
  Vector lower = Vector::Constant(kInfinity);
  Vector upper = Vector::Constant(-kInfinity);

  bool is_empty() const { return !(lower.array() <= upper.array()).all(); }
  bool holds(const Aabb& other) const {
    return (lower.array() <= other.lower.array()).all() &&
           (other.upper.array() <= upper.array()).all();
  }
  bool overlaps(const Aabb& other) const {
    return (lower.array() <= other.upper.array()).all() &&
           (other.lower.array() <= upper.array()).all();
  }
};

/// A frame whose third axis is the unit vector z; its axes are the rows.
inline Matrix frame_along(const Vector& z) {
  const Vector helper = std::abs(z.x()) < 0.57 ? Vector::UnitX() : Vector::UnitY();
  const Vector x = helper.cross(z).normalized();
  Matrix T;
  T.row(0) = x.transpose();
  T.row(1) = z.cross(x).transpose();
  T.row(2) = z.transpose();
  return T;
}

}  // namespace cradle
