/// Torque-free rotation in closed form, as an oracle: angular velocity by Jacobi's elliptic
/// functions at any time straight from the start, attitude by an integral that is computed to
/// rounding. In long double, and with nothing of the server's.
///
/// Sources: Landau, Lifshitz, Mechanics, section 37 (w in sn, cn, dn); Abramowitz, Stegun 16.4 (sn,
/// cn, dn by the arithmetic-geometric mean) and 16.17 (addition theorem). Attitude: the body turns
/// by psi about L, psi' = (2E + w . m0) / (|m| + m . m0 / |m|), after the least rotation that takes
/// m to m0, where m = J w in B (from L = R m being constant). Not for three equal moments, nor for
/// a spin exactly about the axis of the least or largest one.
#pragma once

#include <array>
#include <cmath>
#include <utility>

namespace cradle::oracle {

using Real = long double;
using V3 = std::array<Real, 3>;
using Q4 = std::array<Real, 4>;  // w x y z

inline Real dot(const V3& a, const V3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline V3 cross(const V3& a, const V3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Q4 product(const Q4& a, const Q4& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
          a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1]};
}
inline Q4 unit(const Q4& q) {
  const Real n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return {q[0] / n, q[1] / n, q[2] / n, q[3] / n};
}

/// sn, cn, dn of one modulus k^2 in [0, 1).
class Elliptic {
 public:
  struct Value {
    Real sn, cn, dn;
  };

  explicit Elliptic(Real k2) : k2_(k2) {
    a_[0] = 1;
    Real b = std::sqrt(1 - k2);
    c_[0] = std::sqrt(k2);
    for (n_ = 0; n_ + 1 < kMax && c_[n_] > 1e-20L; ++n_) {
      a_[n_ + 1] = (a_[n_] + b) / 2;
      c_[n_ + 1] = (a_[n_] - b) / 2;
      b = std::sqrt(a_[n_] * b);
    }
  }

  Value at(Real u) const {
    Real phi = std::ldexp(a_[n_] * u, static_cast<int>(n_));
    for (std::size_t n = n_; n > 0; --n) {
      phi = (phi + std::asin(c_[n] / a_[n] * std::sin(phi))) / 2;
    }
    const Real sn = std::sin(phi);
    return {sn, std::cos(phi), std::sqrt(1 - k2_ * sn * sn)};
  }

  Value sum(const Value& u, const Value& v) const {
    const Real d = 1 - k2_ * u.sn * u.sn * v.sn * v.sn;
    return {(u.sn * v.cn * v.dn + v.sn * u.cn * u.dn) / d,
            (u.cn * v.cn - u.sn * u.dn * v.sn * v.dn) / d,
            (u.dn * v.dn - k2_ * u.sn * u.cn * v.sn * v.cn) / d};
  }

 private:
  static constexpr std::size_t kMax = 40;
  Real k2_;
  std::array<Real, kMax> a_{}, c_{};
  std::size_t n_ = 0;
};

class FreeRotation {
 public:
  /// Principal moments, and the angular velocity in B at t = 0, where the attitude is the identity.
  FreeRotation(const V3& J, const V3& w) : J_(J), E2_(0), elliptic_(0) {
    std::size_t& low = axis_[0];
    std::size_t& high = axis_[2];
    if (J[low] > J[axis_[1]]) std::swap(low, axis_[1]);
    if (J[axis_[1]] > J[high]) std::swap(axis_[1], high);
    if (J[low] > J[axis_[1]]) std::swap(low, axis_[1]);
    Real L2 = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      E2_ += J[i] * w[i] * w[i];
      L2 += J[i] * J[i] * w[i] * w[i];
    }
    // L^2 - 2 E I_2 without cancellation; its sign says about which axis w goes round.
    Real side = 0;
    for (std::size_t i = 0; i < 3; ++i) side += J[i] * w[i] * w[i] * (J[i] - J[axis_[1]]);
    if (side < 0) std::swap(low, high);  // dn now belongs to the last axis
    const Real I1 = J[axis_[0]], I2 = J[axis_[1]], I3 = J[axis_[2]];
    const Real w1 = w[axis_[0]], w2 = w[axis_[1]], w3 = w[axis_[2]];
    // With both sides divided by the sign of I3 - I1: 2 E I3 - L^2 and L^2 - 2 E I1.
    const Real A = I1 * w1 * w1 * (I3 - I1) + I2 * w2 * w2 * (I3 - I2);
    const Real B = I2 * w2 * w2 * (I2 - I1) + I3 * w3 * w3 * (I3 - I1);
    amplitude_ = {std::sqrt(A / (I1 * (I3 - I1))), std::sqrt(A / (I2 * (I3 - I2))),
                  std::sqrt(B / (I3 * (I3 - I1)))};
    rate_ = std::sqrt((I3 - I2) * B / (I1 * I2 * I3));
    elliptic_ = Elliptic((I2 - I1) * A / ((I3 - I2) * B));
    const bool is_even = (axis_[1] + 3 - axis_[0]) % 3 == 1;
    // Ascending or descending moments on a right- or left-handed triple of axes.
    const Real hand = (is_even ? 1 : -1) * (I3 > I1 ? 1 : -1);
    sign_[2] = w3 < 0 ? -1 : 1;
    sign_[1] = sign_[2] * hand;
    start_ = {sign_[1] * w2 / amplitude_[1], w1 / amplitude_[0], sign_[2] * w3 / amplitude_[2]};
    L_ = std::sqrt(L2);
  }

  /// Angular velocity in B.
  V3 w(Real t) const {
    const Elliptic::Value v = elliptic_.sum(start_, elliptic_.at(rate_ * t));
    V3 result;
    result[axis_[0]] = amplitude_[0] * v.cn;
    result[axis_[1]] = sign_[1] * amplitude_[1] * v.sn;
    result[axis_[2]] = sign_[2] * amplitude_[2] * v.dn;
    return result;
  }

  /// Attitude at `t`, in pieces over which the body turns by at most a quarter radian.
  Q4 attitude(Real t) const {
    Real speed = 0;
    for (std::size_t i = 0; i < 3; ++i) speed += amplitude_[i] * amplitude_[i];
    const int pieces = static_cast<int>(std::ceil(t * std::sqrt(speed) / 0.25L)) + 1;
    Q4 q{1, 0, 0, 0};
    for (int i = 0; i < pieces; ++i)
      q = unit(product(q, turn(t * i / pieces, t * (i + 1) / pieces)));
    return q;
  }

 private:
  V3 m(Real t) const {
    const V3 v = w(t);
    return {J_[0] * v[0], J_[1] * v[1], J_[2] * v[2]};
  }

  Q4 turn(Real from, Real to) const {
    // Gauss-Legendre, eight points.
    constexpr std::array<std::pair<Real, Real>, 4> gauss{
        {{0.18343464249564980494L, 0.36268378337836198297L},
         {0.52553240991632898582L, 0.31370664587788728734L},
         {0.79666647741362673959L, 0.22238103445337447054L},
         {0.96028985649753623168L, 0.10122853629037625915L}}};
    const V3 m0 = m(from);
    const Real half = (to - from) / 2;
    Real psi = 0;
    for (const auto& [place, weight] : gauss) {
      for (const Real s : {-place, place}) {
        const Real t = from + half * (1 + s);
        psi += half * weight * (E2_ + dot(w(t), m0)) / (L_ + dot(m(t), m0) / L_);
      }
    }
    const V3 m1 = m(to);
    const V3 axis = cross(m1, m0);
    const Q4 least = unit({L_ * L_ + dot(m0, m1), axis[0], axis[1], axis[2]});
    const Real s = std::sin(psi / 2) / L_;
    return product({std::cos(psi / 2), s * m0[0], s * m0[1], s * m0[2]}, least);
  }

  V3 J_;
  Real E2_;
  Real L_ = 0;
  std::array<std::size_t, 3> axis_{0, 1, 2};  // of cn, sn, dn
  V3 amplitude_{}, sign_{1, 1, 1};
  Real rate_ = 0;
  Elliptic elliptic_;
  Elliptic::Value start_{};
};

}  // namespace cradle::oracle
