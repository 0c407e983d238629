#include "server/dynamics/contact/baseline_tick.h"

#include <algorithm>

#include "server/dynamics/contact/contact_sweeps.h"
#include "server/dynamics/contact/island_facts.h"
#include "server/dynamics/contact/single_contacts.h"
#include "server/dynamics/lcp/lemke.h"

namespace cradle {
namespace {

constexpr double kOverlap_m = 1e-12;  ///< less is rounding of places ("a stack by pivots")

}  // namespace

void BaselineTick::begin(const ContactTick& of, const BodyArrays& arrays,
                         std::span<const Matrix> inverse_inertia_W,
                         std::span<ContactConstraint* const> constraints) {
  tick = of;
  report = {};
  constraints_ = constraints;
  bodies.begin(tick, arrays, inverse_inertia_W);
  system.begin(tick, arrays, constraints, bodies);
  report.islands = static_cast<int>(system.islands());
  is_makeshift_.assign(system.islands(), 0);
  if (tick.is_balanced) bodies.begin_balance(report.balance);
}

bool BaselineTick::bounces(const ContactSystem::Point& point) const {
  if (point.c->restitution == 0) return false;
  const double pull =
      std::max(bodies.acceleration(point.A.line).norm(), bodies.acceleration(point.B.line).norm());
  const double slow = kRestTicks * tick.dt * pull;
  const BodyLines& lines = bodies;
  const Vector u = ContactSystem::velocity(point, lines.velocities());
  return u.x() < -slow;
}

void BaselineTick::set_bounce(ContactSystem::Point& point) const {
  const BodyLines& lines = bodies;
  const Vector u = ContactSystem::velocity(point, lines.velocities());
  point.bias = bounces(point) ? point.c->restitution * u.x() : 0;
}

bool BaselineTick::part(ContactSystem::Points points) {
  std::vector<Vector> impulses(points.size(), Vector::Zero());
  if (points.size() > kPivotPoints) {
    return sweep(points, impulses, ways_.data(), {.has_friction = false});
  }
  const CoulombProblem problem = ContactSystem::problem(points, ways_.data());
  const auto normals = Eigen::seqN(0, points.size(), 3);
  // Scaled, so that the LCP has the size of 1.
  const Eigen::MatrixXd W = problem.W(normals, normals);
  const Eigen::VectorXd s = problem.b(normals), roots = W.diagonal().cwiseSqrt();
  const double size = s.cwiseQuotient(roots).cwiseAbs().maxCoeff();
  const auto inverse = roots.cwiseInverse().asDiagonal();
  const LcpSolution found = lemke(inverse * W * inverse, inverse * s / size);
  if (found.status != LcpStatus::solved) return false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    ContactSystem::push(points[i], {size * found.z[k] / roots[k], 0, 0}, ways_.data());
  }
  return true;
}

void BaselineTick::part_overlaps() {
  ways_.assign(bodies.lines(), BodyLine{});
  for (ContactSystem::Point& point : system.points()) {
    point.bias = ContactSystem::separation(point, bodies);
    point.acts = true;
  }
  for (std::size_t i = 0; i < system.islands(); ++i) {
    const ContactSystem::Points points = system.island(i);
    const bool overlaps =
        std::ranges::any_of(points, [](const auto& p) { return p.bias < -kOverlap_m; });
    if (overlaps && !part(points)) note_makeshift(i);
  }
  for (std::size_t line = 0; line < bodies.moving(); ++line) {
    bodies.displace(static_cast<std::int32_t>(line), ways_[line]);
  }
}

std::vector<Vector> BaselineTick::forces_of(ContactSystem::Points points, double h) {
  std::vector<Vector> impulses;
  for (const ContactSystem::Point& point : points) {
    const ConstraintPoint& p = *point.p;
    impulses.push_back(h * Vector(p.force, p.force_t.x(), p.force_t.y()));
  }
  return impulses;
}

void BaselineTick::keep(ContactSystem::Points points, std::span<const Vector> impulses, double h) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    ConstraintPoint& p = *points[i].p;
    PointImpulse& own = points[i].c->impulse(p);
    own.lambda = impulses[i].x();
    own.lambda_t = impulses[i].tail<2>();
    p.force = own.lambda / h;
    p.force_t = own.lambda_t / h;
  }
}

void BaselineTick::note_makeshift(std::size_t island) {
  report.islands_makeshift += is_makeshift_[island] == 0 ? 1 : 0;
  is_makeshift_[island] = 1;
}

void BaselineTick::judge() {
  report.residual = {};
  const BodyLines& lines = bodies;
  for (const ContactSystem::Point& point : system.points()) {
    const PointImpulse& own = point.c->impulse(*point.p);
    const Vector u = ContactSystem::velocity(point, lines.velocities()) + Vector(point.bias, 0, 0);
    report.residual.add(point.K.x(), point.c->friction,
                        {own.lambda, own.lambda_t.x(), own.lambda_t.y()}, u);
  }
}

void BaselineTick::add_work(double h) {
  if (!tick.is_balanced) return;
  bodies.take_means(h);
  for (ContactConstraint* c : constraints_) SingleContact(*c, bodies).add_work(report.balance);
}

ContactReport BaselineTick::end(int sub_steps) {
  if (tick.is_balanced) bodies.end_balance(report.balance, tick.dt);
  for (ContactSystem::Point& point : system.points()) {
    point.c->impulse(*point.p).s = ContactSystem::separation(point, bodies);
    point.c->torque = Vector::Zero();
  }
  bodies.finish();
  report.sub_steps_max = sub_steps;
  report.body_sub_steps = sub_steps * static_cast<std::int64_t>(bodies.moving());
  report.choices[report.choices_used++] = {sub_steps, report.islands,
                                           static_cast<int>(bodies.moving()), 0};
  return report;
}

}  // namespace cradle
