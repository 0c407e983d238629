#include "server/dynamics/contact/single_contacts.h"

#include <algorithm>
#include <cmath>

#include "server/dynamics/contact/softness.h"

namespace cradle {
namespace {

constexpr int kContactSweeps = 64;     // at most; four corners of a cube take about 20
constexpr double kSweepEnough = 1e-9;  // of the largest change of velocity

}  // namespace

SingleContact::SingleContact(ContactConstraint& c, BodyLines& bodies)
    : c_(c),
      t2_(c.t2()),
      bodies_(bodies),
      A_(side(c.a, c.turn_A)),
      B_(side(c.b, c.turn_B)),
      haste_(c.restitution > 0 ? kImpactHaste : 1) {}

SingleContact::Side SingleContact::side(std::int32_t slot, const Rotation& turn) const {
  const std::int32_t line = bodies_.line(slot);
  const bool is_turned = c_.is_ahead && bodies_.tumbles(line);
  return {line, bodies_.yields(line), is_turned,
          is_turned ? Matrix(turn.toRotationMatrix()) : Matrix::Identity()};
}

/// At the attitude for which the arms hold.
Vector SingleContact::w(const Side& side) const {
  return side.is_turned ? Vector(side.turn * bodies_.w(side.line)) : Vector(bodies_.w(side.line));
}

Vector SingleContact::relative_velocity(const ConstraintPoint& p) const {
  return bodies_.v(B_.line) + w(B_).cross(c_.rB(p)) - bodies_.v(A_.line) - w(A_).cross(p.rA);
}

double SingleContact::separation(const ConstraintPoint& p) const {
  return p.s0 + c_.n.dot(bodies_.dp(B_.line) + Vector(bodies_.theta(B_.line)).cross(c_.rB(p)) -
                         bodies_.dp(A_.line) - Vector(bodies_.theta(A_.line)).cross(p.rA));
}

void SingleContact::push(const Side& side, double inverse_mass, const Matrix& inverse_inertia,
                         const Vector& r, const Vector& impulse) {
  if (!side.yields) return;
  bodies_.v(side.line) += inverse_mass * impulse;
  const Vector dw = inverse_inertia * r.cross(impulse);
  bodies_.w(side.line) += side.is_turned ? Vector(side.turn.transpose() * dw) : dw;
}

void SingleContact::push(const ConstraintPoint& p, const Vector& impulse) {
  push(A_, c_.inverse_mass_A, *c_.inverse_inertia_A, p.rA, -impulse);
  push(B_, c_.inverse_mass_B, *c_.inverse_inertia_B, c_.rB(p), impulse);
}

double SingleContact::add_normal(const ConstraintPoint& p, double change) {
  PointImpulse& own = c_.impulse(p);
  const double lambda = std::max(own.lambda + change, 0.0);
  const double added = lambda - own.lambda;
  push(p, added * c_.n);
  own.lambda = lambda;
  return added;
}

/// One point after another; ahead of time, where a blow comes, again until all agree: what one
/// sweep leaves of it would turn the bodies.
template <class F>
void SingleContact::sweep(F&& change_of) {
  const int sweeps = c_.is_ahead && c_.count > 2 ? kContactSweeps : 1;
  double first = 0;
  for (int k = 0; k < sweeps; ++k) {
    double most = 0;
    for (const ConstraintPoint& p : c_.used()) {
      most = std::max(most, std::abs(add_normal(p, change_of(p)) * c_.K_normal(p)));
    }
    first = std::max(first, most);
    if (most <= kSweepEnough * first) return;
  }
}

void SingleContact::add_friction(const ConstraintPoint& p) {
  const Vector v = relative_velocity(p);
  PointImpulse& own = c_.impulse(p);
  Eigen::Vector2d lambda_t =
      own.lambda_t - Eigen::Vector2d(c_.t1.dot(v), t2_.dot(v)) / c_.K_tangent(p);
  const double limit = c_.friction * own.lambda;
  const double size = lambda_t.norm();
  if (size > limit) lambda_t *= limit / size;
  const Eigen::Vector2d change = lambda_t - own.lambda_t;
  push(p, change.x() * c_.t1 + change.y() * t2_);
  own.lambda_t = lambda_t;
}

Vector SingleContact::rub(const ConstraintPoint& p, double impulse) {
  const Vector v = relative_velocity(p);
  const Eigen::Vector2d vt(c_.t1.dot(v), t2_.dot(v));
  const double speed = vt.norm();
  if (speed == 0) return Vector::Zero();
  const Eigen::Vector2d lambda_t =
      -std::min(c_.friction * impulse, speed / c_.K_tangent(p)) / speed * vt;
  const Vector given = lambda_t.x() * c_.t1 + lambda_t.y() * t2_;
  push(p, given);
  return given;
}

void SingleContact::judge(const SubStep& step, ContactResidual& residual) const {
  for (const ConstraintPoint& p : c_.used()) {
    const Vector v = relative_velocity(p);
    const PointImpulse& own = c_.impulse(p);
    const double gap_speed = std::max(own.s, 0.0) * haste_ / step.h;
    residual.add(c_.K_normal(p), c_.friction, {own.lambda, own.lambda_t.x(), own.lambda_t.y()},
                 {c_.n.dot(v) + gap_speed, c_.t1.dot(v), t2_.dot(v)});
  }
}

Vector SingleContact::mean_velocity(const Side& side, const Vector& r) const {
  const BodyLine& mean = bodies_.means()[side.line];
  const Vector w = angular(mean);
  return linear(mean) + (side.is_turned ? Vector(side.turn * w) : w).cross(r);
}

void SingleContact::add_work(ContactBalance& balance) const {
  for (const ConstraintPoint& p : c_.used()) {
    const Vector vA = mean_velocity(A_, p.rA), vB = mean_velocity(B_, c_.rB(p));
    const auto& [lambda_t, lambda, s] = c_.impulse(p);
    const Vector along = lambda * c_.n;
    const Vector across = lambda_t.x() * c_.t1 + lambda_t.y() * t2_;
    balance.impacts_J += along.dot(vB - vA);
    balance.friction_J += across.dot(vB - vA);
    const Vector given = along + across;
    if (!A_.yields) {
      balance.driven_J += given.dot(vA);
      balance.contacts_Ns += given;
    }
    if (!B_.yields) {
      balance.driven_J -= given.dot(vB);
      balance.contacts_Ns -= given;
    }
  }
}

void SingleContact::warm_start() {
  for (const ConstraintPoint& p : c_.used()) {
    const auto& [lambda_t, lambda, s] = c_.impulse(p);
    push(p, lambda * c_.n + lambda_t.x() * c_.t1 + lambda_t.y() * t2_);
  }
}

void SingleContact::repeat_struck() {
  if (bodies_.is_struck(A_.line, B_.line)) warm_start();
}

void SingleContact::scale_struck(std::span<const double> shares) {
  if (!bodies_.is_struck(A_.line, B_.line)) return;
  const double share = shares[bodies_.island_of(A_.line, B_.line)];
  for (const ConstraintPoint& p : c_.used()) {
    c_.impulse(p).lambda *= share;
    c_.impulse(p).lambda_t *= share;
  }
}

void SingleContact::solve(const SubStep& step) {
  for (const ConstraintPoint& p : c_.used()) c_.impulse(p).s = separation(p);
  const Softness& soft = step.soft;
  sweep([&](const ConstraintPoint& p) {
    const double s = c_.impulse(p).s, K = c_.K_normal(p);
    const double decay = soft.impulse_scale * c_.impulse(p).lambda;
    if (s > 0) return -(normal_velocity(p) + s * haste_ / step.h) / K - decay;
    const double limit = std::max(step.push_speed, -step.push_rate * s) + decay * K;
    const double bias = std::max(soft.mass_scale * soft.bias_rate * s, -limit);
    return -(soft.mass_scale * normal_velocity(p) + bias) / K - decay;
  });
}

void SingleContact::relax(const SubStep& step) {
  for (const ConstraintPoint& p : c_.used()) c_.impulse(p).s = separation(p);
  sweep([&](const ConstraintPoint& p) {
    const double allowed = std::max(c_.impulse(p).s, 0.0) * haste_ / step.h;
    return -(normal_velocity(p) + allowed) / c_.K_normal(p);
  });
  for (const ConstraintPoint& p : c_.used()) add_friction(p);
}

}  // namespace cradle
