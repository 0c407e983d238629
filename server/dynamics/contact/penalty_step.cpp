// The contact solver "penalty": each point that overlaps is a spring with a damper, explicit.
//
// Source: the force field of the seed paper's section III.B, with a finite stiffness and along the
// contact's normal; Cundall and Strack (1979); friction as Coulomb's, regularised.
//   s < 0:  fn = -k s - c un,  ft = -mu max(fn, 0) ut / max(|ut|, vs)
//   k = m omega^2, c = 2 zeta m omega, m = 1 / K of the point, omega^2 = a / tolerance
// a is the largest acceleration by loads, at least 9.81 m/s^2, so that a body by itself sinks in by
// the tolerance; what carries R others sinks in R times that. An impact is half a period of the
// damped spring, exp(-pi zeta / sqrt(1 - zeta^2)) = e:
//   zeta = L / sqrt(pi^2 + L^2), L = -ln e; 1 for e = 0
// Stability: semi-implicit Euler needs h w < 2 (sqrt(1 + z^2) - z) of every mode w, which has
// z = zeta w / omega. The largest: w^2 <= max over points i of sum over its bodies X and their
// points j of sqrt(K_iX K_jX) k_j, K_iX the part of X in K_i (Gershgorin, Cauchy and Schwarz).
// Friction: vs is at least so much that it cannot turn a point's sliding round, mu fn K_t h times
// the points of its body. Sub-steps are taken as this bound asks for, with a margin, to the tick's
// own number, or kSubStepsMax; where that is not enough omega is lowered to what it allows, and the
// island is counted (ContactReport::islands_makeshift).
// Where it differs from rigid contact: it sinks in; friction that is regularised holds nothing for
// good, bodies creep down slopes; while it parts what overlaps, the damper may pull; restitution
// is right only where the points of a contact move together, and then to h omega zeta: e is 0.014
// off at worst.
//
// Order: 1 in h. Cost: 0.1 us a point and sub-step.
#include "server/dynamics/contact/penalty_step.h"

#include <cradle/limits.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/dynamics/contact/baseline_tick.h"

namespace cradle {
namespace {

struct PenaltyTolerances {
  double pull = 9.81;   ///< m/s^2: loads that springs are made for, where there are less ("P18")
  double angle = 0.1;   ///< h omega, at most: the error of e is a seventh of it ("P18")
  double margin = 0.5;  ///< of the stability bound ("springs softer")
  double slip = 1e-3;   ///< m/s, least vs ("P16")
  double tolerance_m = 5e-4;  ///< of contacts without one
};
constexpr PenaltyTolerances kPenaltyTolerances;

/// Of x in (0, 1], by its series in (m - 1) / (m + 1): the same bits everywhere.
double natural_log(double x) {
  int exponent = 0;
  double m = std::frexp(x, &exponent);
  if (m < std::numbers::sqrt2 / 2) {
    m *= 2;
    --exponent;
  }
  const double y = (m - 1) / (m + 1), square = y * y;
  double sum = 0;
  for (int k = 19; k >= 1; k -= 2) sum = sum * square + 1.0 / k;
  return 2 * y * sum + exponent * std::numbers::ln2;
}

double damping_ratio(double restitution) {
  if (restitution == 0) return 1;
  const double L = -natural_log(restitution);
  return L / std::sqrt(std::numbers::pi * std::numbers::pi + L * L);
}

struct PenaltySpring {
  double omega, zeta;  // 1/s
  double limit;        // h omega that is allowed
  int points;          // of the busier of its bodies
};

class PenaltyStep final : public ContactSolver {
 public:
  ContactReport advance(const ContactTick& tick, const BodyArrays& arrays,
                        std::span<const Matrix> inverse_inertia_W,
                        std::span<ContactConstraint* const> constraints) override {
    if (constraints.empty()) return {};
    BaselineTick& t = tick_;
    t.begin(tick, arrays, inverse_inertia_W, constraints);
    const int sub_steps = set_springs();
    const double h = tick.dt / sub_steps;
    for (int k = 0; k < sub_steps; ++k) {
      t.bodies.integrate_velocities(h, 0);
      press(h);
      t.add_work(h);
      if (k + 1 == sub_steps) judge(h);
      t.bodies.integrate_positions(h, 0);
      t.bodies.forget_contacts();
    }
    return t.end(sub_steps);
  }

 private:
  /// The sub-steps to take.
  int set_springs() {
    const ContactSystem::Points points = tick_.system.points();
    springs_.assign(points.size(), {});
    for (std::size_t i = 0; i < points.size(); ++i) springs_[i] = spring(points[i]);
    find_limits();
    const ContactTick& tick = tick_.tick;
    const int most = tick.sub_steps > 0 ? tick.sub_steps : limits::kSubStepsMax;
    double asked = 1;
    std::size_t first = 0;
    for (std::size_t island = 0; island < tick_.system.islands(); ++island) {
      const std::size_t count = tick_.system.island(island).size();
      const std::span<PenaltySpring> springs = std::span(springs_).subspan(first, count);
      first += count;
      double own = 1;
      for (const PenaltySpring& s : springs) own = std::max(own, tick.dt * s.omega / s.limit);
      if (own > most) {
        tick_.note_makeshift(island);
        for (PenaltySpring& s : springs) s.omega *= most / own;
      }
      asked = std::max(asked, std::min<double>(own, most));
    }
    return tick.sub_steps > 0 ? most : static_cast<int>(std::ceil(asked));
  }

  PenaltySpring spring(const ContactSystem::Point& point) const {
    const double pull =
        std::max({tick_.bodies.acceleration(point.A.line).norm(),
                  tick_.bodies.acceleration(point.B.line).norm(), kPenaltyTolerances.pull});
    double tolerance_m = point.c->tolerance_m;
    if (tolerance_m == 0) tolerance_m = tick_.tick.tolerance_m;
    if (tolerance_m == 0) tolerance_m = kPenaltyTolerances.tolerance_m;
    return {std::sqrt(pull / tolerance_m), damping_ratio(point.c->restitution), 0, 0};
  }

  /// 1/kg, along n, of one body.
  static double part_of_K(const ContactSystem::Side& side) {
    return side.inverse_mass + side.L.row(0).dot(side.turn.col(0));
  }

  void find_limits() {
    const ContactSystem::Points points = tick_.system.points();
    stiffness_.assign(tick_.bodies.lines(), 0);
    counts_.assign(tick_.bodies.lines(), 0);
    const auto index = [](std::int32_t line) { return static_cast<std::size_t>(line); };
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double k = springs_[i].omega * springs_[i].omega / points[i].K.x();
      for (const ContactSystem::Side* side : {&points[i].A, &points[i].B}) {
        stiffness_[index(side->line)] += k * std::sqrt(part_of_K(*side));
        counts_[index(side->line)] += side->inverse_mass > 0 ? 1 : 0;
      }
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      PenaltySpring& s = springs_[i];
      double square = 0;
      for (const ContactSystem::Side* side : {&points[i].A, &points[i].B}) {
        square += std::sqrt(part_of_K(*side)) * stiffness_[index(side->line)];
        s.points = std::max(s.points, counts_[index(side->line)]);
      }
      const double faster = std::sqrt(square) / s.omega, z = s.zeta * faster;
      const double bound = 2 * (std::sqrt(1 + z * z) - z) / faster;
      s.limit = std::min(kPenaltyTolerances.angle, kPenaltyTolerances.margin * bound);
    }
  }

  /// What loads have just given is no way yet: else the damper would carry 2 zeta h omega of them.
  Vector before_loads(const ContactSystem::Point& point, double h) const {
    const BodyLines& bodies = tick_.bodies;
    const Vector gained = bodies.acceleration(point.B.line) - bodies.acceleration(point.A.line);
    return ContactSystem::velocity(point, bodies.velocities()) - h * point.E.transpose() * gained;
  }

  /// All points by the same velocities, and then all at once.
  void press(double h) {
    const ContactSystem::Points points = tick_.system.points();
    impulses_.assign(points.size(), Vector::Zero());
    BodyLine* const lines = tick_.bodies.velocities();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ContactSystem::Point& point = points[i];
      const double s = ContactSystem::separation(point, tick_.bodies);
      if (s >= 0) continue;
      const PenaltySpring& spring = springs_[i];
      const Vector u = before_loads(point, h);
      const double m = 1 / point.K.x();
      const double fn = -m * spring.omega * (spring.omega * s + 2 * spring.zeta * u.x());
      const double most = point.c->friction * std::max(fn, 0.0);
      const double round = most * (point.K.y() + point.K.z()) * h * spring.points;
      const double slide = u.tail<2>().norm();
      const double share = most / std::max({slide, kPenaltyTolerances.slip, round});
      impulses_[i] = h * Vector(fn, -share * u.y(), -share * u.z());
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      ContactSystem::push(points[i], impulses_[i], lines);
    }
    BaselineTick::keep(points, impulses_, h);
  }

  void judge(double h) {
    for (ContactSystem::Point& point : tick_.system.points()) {
      point.bias = std::max(ContactSystem::separation(point, tick_.bodies), 0.0) / h;
    }
    tick_.judge();
  }

  BaselineTick tick_;
  std::vector<PenaltySpring> springs_;  // by point
  std::vector<Vector> impulses_;
  std::vector<double> stiffness_;  // by line
  std::vector<int> counts_;
};

}  // namespace

std::unique_ptr<ContactSolver> make_penalty_step() { return std::make_unique<PenaltyStep>(); }

}  // namespace cradle
