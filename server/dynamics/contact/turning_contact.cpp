// Rolling and torsional friction.
//
// Symbols, frame W: W = wB - wA, V velocity of B against A at the middle of the points, t in the
// tangent plane; n normal; L sum of the points' normal impulses; mu_s, mu_r torsional and rolling
// coefficient (m); T angular impulse on B, on A -T; P impulse likewise.
//   G, response of (Vt, Wt) to (Pt, Tt): G_VV, G_VT, G_WT;  K = IA^-1 + IB^-1
//   torsion: Tn' = Tn - n W / (n K n), clamped to |Tn'| <= mu_s L
//   rolling: Tt' = Tt - Wt / K_t, projected onto |Tt'| <= mu_r L (a round cone)
// where points stick, friction reacts at once, P = -G_VV^-1 G_VT T, so that they go on sticking:
// K_t is the largest of G_WT - G_VT^T G_VV^-1 G_VT (for a ball 1 / (J + m r^2)); else, or where a
// point would leave its cone by that, the largest of G_WT, and points answer in the next sub-step.
// In planar worlds z alone turns: torsion is none, rolling is about z.
// Source: rows as in MuJoCo (condim 4 and 6) and Box3D. Where we differ: the reaction; without it
// what is kept from rolling creeps and rings, by 0.71 a sub-step for balls. An impact with the
// normal impulse L gives up to mu L, too.
// Order: 1, as friction. Cost: about 50 ns a contact and sub-step.
#include "server/dynamics/contact/turning_contact.h"

#include <algorithm>
#include <cmath>

#include "server/dynamics/gyroscopic.h"

namespace cradle {
namespace {

double largest_of(const Eigen::Matrix2d& K) {
  const double half = (K(0, 0) - K(1, 1)) / 2;
  return (K(0, 0) + K(1, 1)) / 2 + std::sqrt(half * half + K(0, 1) * K(0, 1));
}

double inverse_or_0(double K) { return K > 0 ? 1 / K : 0; }

}  // namespace

TurningContact::TurningContact(ContactConstraint& c, const BodyLines& bodies, Block block, int lane)
    : c_(&c),
      block_(block),
      lane_(lane),
      A_(side(bodies, c.a, c.turn_A, -1)),
      B_(side(bodies, c.b, c.turn_B, 1)) {
  t_ << c.t1, c.t2();
  const Matrix none = Matrix::Zero();
  find_masses(A_.sign != 0 ? *c.inverse_inertia_A : none,
              B_.sign != 0 ? *c.inverse_inertia_B : none);
}

TurningContact::Side TurningContact::side(const BodyLines& bodies, std::int32_t slot,
                                          const Rotation& turn, double sign) const {
  Side side;
  side.line = bodies.line(slot);
  side.sign = bodies.yields(side.line) ? sign : 0;
  side.is_turned = c_->is_ahead && bodies.tumbles(side.line);
  if (side.is_turned) side.turn = turn.toRotationMatrix();
  return side;
}

void TurningContact::find_masses(const Matrix& IA, const Matrix& IB) {
  A_.inverse_mass = A_.sign != 0 ? c_->inverse_mass_A : 0;
  B_.inverse_mass = B_.sign != 0 ? c_->inverse_mass_B : 0;
  Vector arm_A = Vector::Zero();
  for (const ConstraintPoint& p : c_->used()) arm_A += p.rA;
  arm_A /= static_cast<double>(c_->count);
  const Matrix XA = cross_matrix(arm_A), XB = cross_matrix(arm_A + c_->from_B);
  const Matrix VT = -XA * IA - XB * IB;
  const Matrix VV = -XA * IA * XA - XB * IB * XB;
  const Square G_VV =
      (A_.inverse_mass + B_.inverse_mass) * Square::Identity() + t_.transpose() * VV * t_;
  const Square G_VT = t_.transpose() * VT * t_, G_WT = t_.transpose() * (IA + IB) * t_;
  reaction_ = -G_VV.inverse() * G_VT;
  yields_n_ = inverse_or_0(c_->n.dot((IA + IB) * c_->n));
  yields_sliding_ = inverse_or_0(largest_of(G_WT));
  yields_stuck_ = inverse_or_0(largest_of(G_WT + G_VT.transpose() * reaction_));

  const auto respond = [&](Side& side, const Matrix& inverse_inertia, const Matrix& X) {
    Matrix response = side.sign * inverse_inertia;
    if (side.is_turned) response = side.turn.transpose() * response;
    side.about_n = response * c_->n;
    side.sliding = response * t_;
    side.stuck = response * (t_ + X * t_ * reaction_);
  };
  respond(A_, IA, XA);
  respond(B_, IB, XB);
}

Vector TurningContact::w(const BodyLines& bodies, const Side& side) const {
  return side.is_turned ? Vector(side.turn * bodies.w(side.line)) : Vector(bodies.w(side.line));
}

TurningContact::Impulses TurningContact::at(std::size_t i) const {
  return std::visit(
      [&](const auto& block) -> Impulses {
        if constexpr (std::is_pointer_v<std::decay_t<decltype(block)>>) {
          const auto& p = block->points[i];
          return {p.lambda[lane_], p.lambda_1[lane_], p.lambda_2[lane_]};
        } else {
          const PointImpulse& own = c_->impulses[i];
          return {own.lambda, own.lambda_t.x(), own.lambda_t.y()};
        }
      },
      block_);
}

void TurningContact::add_friction(std::size_t i, double along_1, double along_2) {
  std::visit(
      [&](const auto& block) {
        if constexpr (std::is_pointer_v<std::decay_t<decltype(block)>>) {
          auto& p = block->points[i];
          using Real = std::decay_t<decltype(p.lambda_1[lane_])>;
          p.lambda_1[lane_] += static_cast<Real>(along_1);
          p.lambda_2[lane_] += static_cast<Real>(along_2);
        } else {
          c_->impulses[i].lambda_t += Eigen::Vector2d(along_1, along_2);
        }
      },
      block_);
}

double TurningContact::pressing() const {
  double sum = 0;
  for (std::size_t i = 0; i < points(); ++i) sum += at(i).normal;
  return sum;
}

void TurningContact::warm_start(BodyLines& bodies, double h) {
  T_n_ = h * c_->n.dot(c_->torque);
  T_t_ = h * (t_.transpose() * c_->torque);
  push(bodies);
}

void TurningContact::push(BodyLines& bodies) const {
  for (const Side* side : {&A_, &B_}) {
    if (side->sign != 0) bodies.w(side->line) += T_n_ * side->about_n + side->sliding * T_t_;
  }
}

void TurningContact::repeat_struck(BodyLines& bodies) const {
  if (bodies.is_struck(A_.line, B_.line)) push(bodies);
}

void TurningContact::scale_struck(std::span<const double> shares, const BodyLines& bodies) {
  if (!bodies.is_struck(A_.line, B_.line)) return;
  T_n_ *= shares[bodies.island_of(A_.line, B_.line)];
  T_t_ *= shares[bodies.island_of(A_.line, B_.line)];
}

void TurningContact::finish(double h) { c_->torque = (T_n_ * c_->n + t_ * T_t_) / h; }

void TurningContact::rub(BodyLines& bodies) {
  const double L = pressing();
  if (c_->torsional_m > 0) twist(bodies, c_->torsional_m * L);
  if (c_->rolling_m > 0) roll(bodies, c_->rolling_m * L);
}

void TurningContact::add_work(const BodyLines& bodies, ContactBalance& balance) const {
  const auto mean = [&](const Side& side) {
    const Vector w = angular(bodies.means()[side.line]);
    return side.is_turned ? Vector(side.turn * w) : w;
  };
  const Vector T = T_n_ * c_->n + t_ * T_t_, wA = mean(A_), wB = mean(B_);
  balance.friction_J += T.dot(wB - wA);
  if (A_.sign == 0) balance.driven_J += T.dot(wA);
  if (B_.sign == 0) balance.driven_J -= T.dot(wB);
}

void TurningContact::rub_at_impact(BodyLines& bodies, double impulse) {
  yields_stuck_ = 0;  // its points' impulses are others
  twist(bodies, c_->torsional_m * impulse);
  roll(bodies, c_->rolling_m * impulse);
}

void TurningContact::twist(BodyLines& bodies, double limit) {
  const double old = T_n_;
  T_n_ = std::clamp(old - yields_n_ * c_->n.dot(turning(bodies)), -limit, limit);
  for (const Side* side : {&A_, &B_}) {
    if (side->sign != 0) bodies.w(side->line) += (T_n_ - old) * side->about_n;
  }
}

void TurningContact::roll(BodyLines& bodies, double limit) {
  const Vector W = turning(bodies);
  const double W1 = t_.col(0).dot(W), W2 = t_.col(1).dot(W);
  const auto find = [&](double yields) {
    const double x = T_t_.x() - yields * W1, y = T_t_.y() - yields * W2;
    const double size2 = x * x + y * y;
    const double scale = size2 > limit * limit ? limit / std::sqrt(size2) : 1;
    return Pair(scale * x - T_t_.x(), scale * y - T_t_.y());
  };
  Pair T = find(yields_stuck_);
  const double P1 = reaction_(0, 0) * T.x() + reaction_(0, 1) * T.y();
  const double P2 = reaction_(1, 0) * T.x() + reaction_(1, 1) * T.y();
  const bool sticks = can_stick(P1 / c_->count, P2 / c_->count);
  if (!sticks) T = find(yields_sliding_);
  T_t_ += T;
  const Vector push = P1 * t_.col(0) + P2 * t_.col(1);
  for (const Side* side : {&A_, &B_}) {
    if (side->sign == 0) continue;
    bodies.w(side->line) += (sticks ? side->stuck : side->sliding) * T;
    if (sticks) bodies.v(side->line) += side->sign * side->inverse_mass * push;
  }
  for (std::size_t i = 0; sticks && i < points(); ++i) {
    add_friction(i, P1 / c_->count, P2 / c_->count);
  }
}

/// All points stick, and go on sticking with this friction more.
bool TurningContact::can_stick(double more_1, double more_2) const {
  if (yields_stuck_ == 0) return false;
  for (std::size_t i = 0; i < points(); ++i) {
    const Impulses p = at(i);
    const double limit = c_->friction * p.normal, limit2 = limit * limit;
    const double x = p.along_1 + more_1, y = p.along_2 + more_2;
    const double now2 = p.along_1 * p.along_1 + p.along_2 * p.along_2;
    if (!(now2 < limit2) || !(x * x + y * y <= limit2)) return false;
  }
  return true;
}

}  // namespace cradle
