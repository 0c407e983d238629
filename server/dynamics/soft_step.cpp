// Sub-stepped soft contact with relaxation.
//
// Sources: Catto (2024), "Solver2D" (soft step: one biased and one relaxing Gauss-Seidel sweep a
// sub-step, warm started); Macklin et al. (2019), "Small Steps in Physics Simulation" (sub-steps
// beat iterations).
// Where we differ: the contact frequency is tied to the sub-step (0.177 / h instead of a fixed
// cap), so that the sag under a load F, delta = F / (m omega^2), falls as h^2; the push-out limit
// bounds the excess over the carried load, not the load; positions move with the mean velocity of a
// sub-step, so that smooth motion (flight, sliding) is second order.
//
// Symbols, frame W: h sub-step, s separation, vn normal velocity, lambda normal impulse, K inverse
// effective mass, dp and theta displacement and rotation since the tick's start.
//   omega = 2 pi c / h, a1 = 2 zeta + h omega, a2 = h omega a1
//   mass scale ms = a2 / (1 + a2), impulse scale is = 1 / (1 + a2), bias rate br = omega / a1
//   soft:  lambda += -(ms vn + bias) / K - is lambda, bias = ms br s, lambda >= 0
//   relax: lambda += -vn / K, lambda >= 0; then friction, lambda_t += -vt / K_t with K_t the
//   largest in the tangent plane, projected onto |lambda_t| <= mu lambda (a true cone) speculative
//   points (s > 0): lambda += -(vn + s / h) / K in both.
// Order: 2 in the position of smooth motion, 1 in impacts. Cost: about 100 ns a point and sub-step.
#include "server/dynamics/soft_step.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/dynamics/gyroscopic.h"
#include "server/dynamics/rotation.h"

namespace cradle {
namespace {

/// Each with unit, reason, and the test that pins it.
struct SoftTolerances {
  double frequency = 0.177;    ///< c, of 1/h: at 0.25 stacks rock on their corners ("stack of ten")
  double damping_ratio = 5;    ///< zeta: overlaps close without bouncing ("half overlapped")
  double push_speed = 0.3;     ///< m/s: floor of the push-out limit ("half overlapped")
  double push_rate = 4;        ///< 1/s: lets deep overlaps part within a second ("half overlapped")
  double smooth_factor = 3;    ///< a velocity change below 3 h |a| is no impact ("sliding stop")
  double far_turn = 0.02;      ///< rad: what a body turns before arms feel it ("rods that tumble")
  double bounce_speed = 1e-3;  ///< m/s: floor of the restitution threshold ("comes to rest")
};
constexpr SoftTolerances kTolerances;

/// Sweeps of restitution over all contacts. A body that hits two others in a tick needs more than
/// one: of 10 000 elastic spheres' energy, 1 / 2 / 4 / 8 / 16 lose 13 / 3.9 / 0.4 / 0.24 / 0.23 %
/// in 6 s.
constexpr int kRestitutionPasses = 8;

struct Softness {
  double mass_scale = 1;
  double impulse_scale = 0;
  double bias_rate = 0;
};

Softness softness(double h) {
  const double omega = 2 * std::numbers::pi * kTolerances.frequency / h;
  const double a1 = 2 * kTolerances.damping_ratio + h * omega;
  const double a2 = h * omega * a1;
  return {a2 / (1 + a2), 1 / (1 + a2), omega / a1};
}

class SoftStep final : public ContactSolver {
 public:
  void advance(const ContactTick& tick, const BodyArrays& bodies,
               std::span<const Matrix> inverse_inertia_W,
               std::span<ContactConstraint> constraints) override {
    bodies_ = bodies;
    h_ = tick.dt / tick.sub_steps;
    softness_ = softness(h_);
    begin(inverse_inertia_W, constraints);
    look_at_turns(constraints);

    for (int sub_step = 0; sub_step < tick.sub_steps; ++sub_step) {
      integrate_velocities(tick.moving);
      warm_start(constraints);
      solve_soft(constraints);
      integrate_positions(tick);
      look_at_turns(constraints);
      relax(constraints);
    }
    for (int pass = 0; pass < kRestitutionPasses && apply_restitution(constraints); ++pass) {
    }
  }

 private:
  static std::size_t slot(std::int32_t body) { return static_cast<std::size_t>(body); }

  /// The state of the bodies in contact at the tick's start; others cost nothing.
  void begin(std::span<const Matrix> inverse_inertia_W,
             std::span<const ContactConstraint> constraints) {
    if (constraints.empty()) return;
    const std::size_t slots = bodies_.x.size();
    dp_.resize(slots);
    theta_.resize(slots);
    v_begin_.resize(slots);
    inverse_inertia_.resize(slots);
    q_start_.resize(slots);
    for (const ContactConstraint& c : constraints) {
      for (const std::int32_t body : {c.a, c.b}) {
        dp_[slot(body)] = theta_[slot(body)] = Vector::Zero();
        inverse_inertia_[slot(body)] = inverse_inertia_W[slot(body)];
        q_start_[slot(body)] = bodies_.q[slot(body)];
      }
    }
  }

  void integrate_velocities(std::span<const std::int32_t> moving) {
    for (const std::int32_t body : moving) {
      const std::size_t i = slot(body);
      v_begin_[i] = bodies_.v[i];
      bodies_.v[i] += h_ * bodies_.acceleration[i];
      if (bodies_.inverse_inertia[i].isZero(0)) continue;
      if (!has_equal_moments(bodies_.inertia[i])) {
        const Rotation& q = bodies_.q[i];
        bodies_.w[i] = q * gyroscopic_step(q.conjugate() * bodies_.w[i], bodies_.inertia[i], h_);
      }
      bodies_.w[i] += h_ * (inverse_inertia_[i] * bodies_.torque[i]);
    }
  }

  /// Arms hold for one attitude. A body that has turned far from it is taken as it was there, with
  /// the angular velocity it has in its own frame: so an impulse changes its energy as it would
  /// have there. With its present inertia and the old arms, a rod would be spun about its axis,
  /// where it has next to no inertia.
  void look_at_turns(std::span<ContactConstraint> constraints) {
    turned_.clear();
    for (ContactConstraint& c : constraints) {
      const double turn2 =
          std::max(theta_[slot(c.a)].squaredNorm(), theta_[slot(c.b)].squaredNorm());
      c.turned = -1;
      if (!c.is_ahead && turn2 < kTolerances.far_turn * kTolerances.far_turn) continue;
      c.turned = static_cast<std::int32_t>(turned_.size());
      turned_.push_back({turned(c.a, c.turn_A), turned(c.b, c.turn_B)});
    }
  }

  /// From where the arms hold to the present attitude.
  Matrix turned(std::int32_t body, const Rotation& to_arms) const {
    const std::size_t i = slot(body);
    if (bodies_.inverse_inertia[i].isZero(0)) return Matrix::Identity();
    return normalised(bodies_.q[i] * (to_arms * q_start_[i]).conjugate()).toRotationMatrix();
  }

  void warm_start(std::span<ContactConstraint> constraints) {
    for (ContactConstraint& c : constraints) {
      for (const ConstraintPoint& p : c.used()) {
        apply(c, p, p.lambda * c.n + p.lambda_t.x() * c.t1 + p.lambda_t.y() * c.t2);
      }
    }
  }

  void solve_soft(std::span<ContactConstraint> constraints) {
    for (ContactConstraint& c : constraints) {
      for (ConstraintPoint& p : c.used()) {
        p.s = separation(c, p);
        if (p.s > 0) {
          add_normal(c, p, -(normal_velocity(c, p) + p.s / h_) / p.K_normal);
          continue;
        }
        const auto [ms, is, br] = softness_;
        const double push_limit = std::max(kTolerances.push_speed, -kTolerances.push_rate * p.s) +
                                  is * p.K_normal * p.lambda;
        const double bias = std::max(ms * br * p.s, -push_limit);
        add_normal(c, p, -(ms * normal_velocity(c, p) + bias) / p.K_normal - is * p.lambda);
      }
    }
  }

  void integrate_positions(const ContactTick& tick) {
    for (const std::int32_t body : tick.moving) {
      const std::size_t i = slot(body);
      const Vector change = bodies_.v[i] - v_begin_[i];
      const double smooth = kTolerances.smooth_factor * h_ * bodies_.acceleration[i].norm();
      const bool is_smooth = change.squaredNorm() <= smooth * smooth;
      const Vector step = h_ * (is_smooth ? Vector(v_begin_[i] + 0.5 * change) : bodies_.v[i]);
      const Vector turn = h_ * bodies_.w[i];
      dp_[i] += step;
      theta_[i] += turn;
      bodies_.x[i] += step;
      if (bodies_.inverse_inertia[i].isZero(0)) continue;
      bodies_.q[i] = normalised(rotation_exp(turn) * bodies_.q[i]);
      inverse_inertia_[i] =
          rotated_diagonal(bodies_.q[i].toRotationMatrix(), bodies_.inverse_inertia[i]);
    }
    for (const std::int32_t body : tick.driven) {
      const std::size_t i = slot(body);
      dp_[i] += h_ * bodies_.v[i];
      theta_[i] += h_ * bodies_.w[i];
    }
  }

  void relax(std::span<ContactConstraint> constraints) {
    for (ContactConstraint& c : constraints) {
      for (ConstraintPoint& p : c.used()) {
        p.s = separation(c, p);
        const double allowed = std::max(p.s, 0.0) / h_;
        add_normal(c, p, -(normal_velocity(c, p) + allowed) / p.K_normal);
      }
      for (ConstraintPoint& p : c.used()) add_friction(c, p);
    }
  }

  /// Newton's law, after the sub-steps, with the speed of the impact: v_i^2 = v^2 - 2 a s from the
  /// tick's start, and the outgoing speed as it is where the tick ends, v_o^2 = e^2 v_i^2 + 2 a s
  /// (energy in the acceleration a along the normal; negative: towards the surface). True if an
  /// impulse has changed: then others may have to.
  bool apply_restitution(std::span<ContactConstraint> constraints) {
    bool has_changed = false;
    for (ContactConstraint& c : constraints) {
      if (c.restitution == 0) continue;
      const double a = c.n.dot(bodies_.acceleration[slot(c.b)] - bodies_.acceleration[slot(c.a)]);
      // What the acceleration alone gives in two sub-steps is a contact at rest.
      const double threshold = std::max(2 * std::abs(a) * h_, kTolerances.bounce_speed);
      for (ConstraintPoint& p : c.used()) {
        if (p.approach > -threshold || p.lambda_max == 0) continue;
        const double impact = std::max(p.approach * p.approach - 2 * a * p.s0, 0.0);
        const double leaving = c.restitution * c.restitution * impact + 2 * a * separation(c, p);
        const double speed = std::sqrt(std::max(leaving, 0.0));
        const double lambda = p.lambda;
        add_normal(c, p, (speed - normal_velocity(c, p)) / p.K_normal);
        has_changed = has_changed || p.lambda != lambda;
      }
    }
    return has_changed;
  }

  Vector relative_velocity(const ContactConstraint& c, const ConstraintPoint& p) const {
    if (c.turned >= 0) [[unlikely]]
      return relative_velocity_of_turned(c, p);
    return bodies_.v[slot(c.b)] + bodies_.w[slot(c.b)].cross(p.rB) - bodies_.v[slot(c.a)] -
           bodies_.w[slot(c.a)].cross(p.rA);
  }

  [[gnu::noinline]] Vector relative_velocity_of_turned(const ContactConstraint& c,
                                                       const ConstraintPoint& p) const {
    const auto& [A, B] = turned_[slot(c.turned)];
    const Vector w_A = A.transpose() * bodies_.w[slot(c.a)];
    const Vector w_B = B.transpose() * bodies_.w[slot(c.b)];
    return bodies_.v[slot(c.b)] + w_B.cross(p.rB) - bodies_.v[slot(c.a)] - w_A.cross(p.rA);
  }

  double normal_velocity(const ContactConstraint& c, const ConstraintPoint& p) const {
    return c.n.dot(relative_velocity(c, p));
  }

  /// First order in the rotation since the tick's start.
  double separation(const ContactConstraint& c, const ConstraintPoint& p) const {
    const std::size_t A = slot(c.a);
    const std::size_t B = slot(c.b);
    return p.s0 + c.n.dot(dp_[B] + theta_[B].cross(p.rB) - dp_[A] - theta_[A].cross(p.rA));
  }

  void add_normal(const ContactConstraint& c, ConstraintPoint& p, double change) {
    const double lambda = std::max(p.lambda + change, 0.0);
    apply(c, p, (lambda - p.lambda) * c.n);
    p.lambda = lambda;
    p.lambda_max = std::max(p.lambda_max, lambda);
  }

  void add_friction(const ContactConstraint& c, ConstraintPoint& p) {
    const Vector v = relative_velocity(c, p);
    Eigen::Vector2d lambda_t = p.lambda_t - Eigen::Vector2d(c.t1.dot(v), c.t2.dot(v)) / p.K_tangent;
    const double limit = c.friction * p.lambda;
    const double size = lambda_t.norm();
    if (size > limit) lambda_t *= limit / size;
    const Eigen::Vector2d change = lambda_t - p.lambda_t;
    apply(c, p, change.x() * c.t1 + change.y() * c.t2);
    p.lambda_t = lambda_t;
  }

  void apply(const ContactConstraint& c, const ConstraintPoint& p, const Vector& impulse) {
    const std::size_t A = slot(c.a);
    const std::size_t B = slot(c.b);
    if (c.turned >= 0) [[unlikely]]
      return apply_to_turned(c, p, impulse);
    if (bodies_.inverse_mass[A] != 0) {
      bodies_.v[A] -= bodies_.inverse_mass[A] * impulse;
      bodies_.w[A] -= c.inverse_inertia_A * p.rA.cross(impulse);
    }
    if (bodies_.inverse_mass[B] != 0) {
      bodies_.v[B] += bodies_.inverse_mass[B] * impulse;
      bodies_.w[B] += c.inverse_inertia_B * p.rB.cross(impulse);
    }
  }

  [[gnu::noinline]] void apply_to_turned(const ContactConstraint& c, const ConstraintPoint& p,
                                         const Vector& impulse) {
    const auto& [turned_A, turned_B] = turned_[slot(c.turned)];
    const std::size_t A = slot(c.a);
    const std::size_t B = slot(c.b);
    bodies_.v[A] -= bodies_.inverse_mass[A] * impulse;
    bodies_.w[A] -= turned_A * (c.inverse_inertia_A * p.rA.cross(impulse));
    bodies_.v[B] += bodies_.inverse_mass[B] * impulse;
    bodies_.w[B] += turned_B * (c.inverse_inertia_B * p.rB.cross(impulse));
  }

  BodyArrays bodies_;
  double h_ = 0;
  Softness softness_;
  std::vector<Vector> dp_, theta_, v_begin_;
  std::vector<Matrix> inverse_inertia_;  // in W, at the present attitude: for torques
  std::vector<Rotation> q_start_;
  struct Turned {
    Matrix A, B;
  };
  std::vector<Turned> turned_;
};

}  // namespace

std::unique_ptr<ContactSolver> make_soft_step() { return std::make_unique<SoftStep>(); }

}  // namespace cradle
