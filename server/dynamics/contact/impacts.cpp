// Restitution at the time of impact, inside a sub-step.
//
// Points that will touch before the sub-step ends, faster than what the loads give in two of them,
// are struck in the order of their times t: the contacts that touch then and approach are reflected
// together (reflections.h), with friction once, lambda_t = min(mu lambda, |vt| / K_t) point by
// point. A body's line is moved back by t dv, so that from the sub-step's start on it leads to
// where the body will be; loads, soft contacts and positions then go on as if nothing had happened.
// Energy: kept to rounding at e = 1 in translation; what rotation does to arms in the tick is not
// followed. Order 2 in the time of an impact. Cost: one look at each point with restitution a
// sub-step, about a microsecond an impact.
#include "server/dynamics/contact/impacts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/collision/index.h"
#include "server/dynamics/contact/single_contacts.h"
#include "server/dynamics/contact/turning_contact.h"

namespace cradle {
namespace {

/// m: what comes nearer than this at the time of an impact is struck, too; or, of fast ones, what
/// would touch within this part of the sub-step (an edge that lands nearly flush).
constexpr double kImpactTouching_m = 1e-5;
constexpr double kTouchingTime = 0.01;
/// m: what is left of a gap at a sub-step's end must be more than rounding, or soft contacts, which
/// return nothing, take the impact ("a box that is struck off its middle").
constexpr double kGrain_m = 1e-6;
/// m/s: floor of the speed of impacts ("comes to rest").
constexpr double kBounceSpeed = 1e-3;
/// Sub-steps of the relative acceleration that are no impact but a contact at rest.
constexpr double kRestSteps = 2;
/// Impacts of a body in a tick; more are left to the soft contacts, which return nothing.
constexpr int kHitsMax = 32;

}  // namespace

void Impacts::begin(std::span<ContactConstraint* const> constraints, const BodyLines& bodies) {
  points_.clear();
  ordered_ = 0;
  for (ContactConstraint* c : constraints) {
    if (c->restitution == 0) continue;
    const std::int32_t a = bodies.line(c->a), b = bodies.line(c->b);
    const Matrix &IA = *c->inverse_inertia_A, &IB = *c->inverse_inertia_B;
    for (ConstraintPoint& p : c->used()) {
      points_.push_back({c, &p, side(*c, a, c->turn_A, c->inverse_mass_A, IA, p.rA, bodies),
                         side(*c, b, c->turn_B, c->inverse_mass_B, IB, c->rB(p), bodies), 0,
                         false});
    }
  }
  if (!points_.empty()) link(bodies.lines());
}

Impacts::Side Impacts::side(const ContactConstraint& c, std::int32_t line, const Rotation& turn,
                            double inverse_mass, const Matrix& inverse_inertia, const Vector& r,
                            const BodyLines& bodies) const {
  const Vector arm = r.cross(c.n);
  const bool yields = bodies.yields(line);
  Side side{line, yields ? inverse_mass : 0, arm,
            yields ? Vector(inverse_inertia * arm) : Vector(Vector::Zero())};
  if (c.is_ahead && bodies.tumbles(line)) {  // the line's w is that of the tick's start
    side.along = turn.conjugate() * side.along;
    side.turn = turn.conjugate() * side.turn;
  }
  return side;
}

void Impacts::link(std::size_t lines) {
  first_.assign(lines, -1);
  hits_.assign(lines, 0);
  place_.assign(lines, -1);
  next_.resize(2 * points_.size());
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const auto at = static_cast<std::int32_t>(2 * k);
    next_[2 * k] = std::exchange(first_[index(points_[k].A.line)], at);
    next_[2 * k + 1] = std::exchange(first_[index(points_[k].B.line)], at + 1);
  }
}

void Impacts::strike(BodyLines& bodies, double h) {
  bodies_ = &bodies;
  h_ = h;
  due_.clear();
  for (std::size_t k = 0; k < points_.size(); ++k) foresee(static_cast<std::int32_t>(k), 0);
  while (!due_.empty()) {
    std::ranges::pop_heap(due_, is_later);
    const Due now = due_.back();
    due_.pop_back();
    const Point& point = points_[index(now.point)];
    const bool is_old =
        hits_[index(point.A.line)] != now.hits_a || hits_[index(point.B.line)] != now.hits_b;
    if (!is_old) strike_set(now.point, now.time);
  }
}

bool Impacts::is_later(const Due& one, const Due& other) {
  return one.time != other.time ? one.time > other.time : one.point > other.point;
}

/// Slower approach is that of a contact at rest.
double Impacts::slow(const Point& point) const {
  return std::max(kRestSteps * h_ * std::abs(pull(point)), kBounceSpeed);
}

/// Relative acceleration along the normal by loads, m/s^2.
double Impacts::pull(const Point& point) const {
  return point.c->n.dot(bodies_->acceleration(point.B.line) - bodies_->acceleration(point.A.line));
}

/// If soft contacts would stop it in the sub-step, which look at its end: s + v h < 0 with v then.
/// The time is that of s + v t + a t^2 / 2 = 0, or the end.
void Impacts::foresee(std::int32_t k, double now) {
  const Point& point = points_[index(k)];
  const std::int32_t a = point.A.line, b = point.B.line;
  if (std::max(hits_[index(a)], hits_[index(b)]) > kHitsMax) return;
  const double v = normal_velocity(point), pull = this->pull(point), least = slow(point);
  if (v + h_ * std::min(pull, 0.0) > -least) return;
  const double s = separation(point, 0);
  if (s + h_ * (v + h_ * pull) > kGrain_m) return;
  double t = now;
  if (s + now * v + 0.5 * now * now * pull > 0) {
    const double root2 = std::max(v * v - 2 * pull * s, 0.0);
    t = v < 0 ? 2 * s / (-v + std::sqrt(root2)) : (v + std::sqrt(root2)) / -pull;
    t = std::clamp(t, now, h_);
  }
  if (v + t * pull > -least) return;
  due_.push_back({t, k, hits_[index(a)], hits_[index(b)]});
  std::ranges::push_heap(due_, is_later);
}

void Impacts::strike_set(std::int32_t first, double t) {
  struck_.clear();
  set_.clear();
  take_point(first, t);
  add_violated(t);  // at once, not one after the other: four corners of a face
  do {
    reflect_set();
  } while (add_violated(t));
  for (const std::int32_t k : set_) rub(points_[index(k)]);
  release(t);
  for (const Struck& body : struck_) {
    for (std::int32_t at = first_[index(body.line)]; at >= 0; at = next_[index(at)]) {
      if (bodies_->yields(body.line)) foresee(at / 2, t);
    }
  }
}

void Impacts::take_point(std::int32_t k, double t) {
  Point& point = points_[index(k)];
  point.is_struck = true;
  point.impulse = 0;
  set_.push_back(k);
  take(point.A.line, t);
  take(point.B.line, t);
}

/// The body as it is at the time.
void Impacts::take(std::int32_t line, double t) {
  if (place_[index(line)] >= 0) return;
  place_[index(line)] = static_cast<std::int32_t>(struck_.size());
  Struck& body = struck_.emplace_back();
  const Vector a = bodies_->acceleration(line);
  body.line = line;
  body.v = bodies_->v(line);
  body.w = bodies_->w(line);
  linear(body.motion) = bodies_->dp(line) + t * body.v + 0.5 * t * t * a;
  angular(body.motion) = bodies_->theta(line) + t * body.w;
  bodies_->v(line) += t * a;
}

/// Contacts of the bodies that touch at the time and approach now. False if there are none.
bool Impacts::add_violated(double t) {
  const std::size_t before = set_.size();
  for (std::size_t i = 0; i < struck_.size(); ++i) {
    const std::int32_t line = struck_[i].line;
    if (!bodies_->yields(line)) continue;
    for (std::int32_t at = first_[index(line)]; at >= 0; at = next_[index(at)]) {
      const Point& point = points_[index(at / 2)];
      if (point.is_struck) continue;
      const double v = normal_velocity(point);
      const double near = std::max(kImpactTouching_m, -kTouchingTime * h_ * v);
      if (v < -slow(point) && separation(point, t) <= near) take_point(at / 2, t);
    }
  }
  return set_.size() > before;
}

double Impacts::normal_velocity(const Point& point) const {
  const Side &A = point.A, &B = point.B;
  return point.c->n.dot(bodies_->v(B.line) - bodies_->v(A.line)) + B.along.dot(bodies_->w(B.line)) -
         A.along.dot(bodies_->w(A.line));
}

double Impacts::separation(const Point& point, double t) const {
  const Vector &n = point.c->n, &rA = point.p->rA;
  const auto moved = [&](std::int32_t line, const Vector& r) {
    if (place_[index(line)] >= 0) {
      const BodyLine& motion = struck_[index(place_[index(line)])].motion;
      return n.dot(linear(motion)) + r.cross(n).dot(angular(motion));
    }
    const Vector way = bodies_->dp(line) + t * bodies_->v(line);
    return n.dot(way) + r.cross(n).dot(bodies_->theta(line) + t * bodies_->w(line));
  };
  return point.p->s0 + moved(point.B.line, point.c->rB(*point.p)) - moved(point.A.line, rA);
}

void Impacts::push(const Side& side, double impulse, const Vector& n) {
  if (!bodies_->yields(side.line)) {
    const double speed = n.dot(bodies_->v(side.line)) + side.along.dot(bodies_->w(side.line));
    return push_back(impulse * n, impulse * speed);
  }
  bodies_->v(side.line) += side.inverse_mass * impulse * n;
  bodies_->w(side.line) += impulse * side.turn;
}

/// For the balance: `impulse` on a body that does not yield, which comes back at its velocity.
void Impacts::push_back(const Vector& impulse, double work) {
  if (balance_ == nullptr) return;
  balance_->contacts_Ns -= impulse;
  balance_->driven_J -= work;
  balance_->impacts_J += work;
}

void Impacts::push(Point& point, double impulse) {
  push(point.A, -impulse, point.c->n);
  push(point.B, impulse, point.c->n);
  point.impulse += impulse;
}

/// What a unit impulse of one changes of the other's normal velocity, 1/kg.
double Impacts::coupling(const Point& one, const Point& other) const {
  const double linear = one.c->n.dot(other.c->n);
  const auto shared = [&](const Side& p, const Side& q) {
    return p.line == q.line ? p.inverse_mass * linear + p.turn.dot(q.along) : 0;
  };
  return shared(one.A, other.A) + shared(one.B, other.B) - shared(one.A, other.B) -
         shared(one.B, other.A);
}

void Impacts::reflect_set() {
  if (set_.size() > std::size_t{kReflectedTogether}) return reflect_in_order();
  const auto n = static_cast<Eigen::Index>(set_.size());
  ImpactMatrix A(n, n);
  ImpactVector b(n), e(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Point& point = points_[index(set_[static_cast<std::size_t>(i)])];
    b[i] = normal_velocity(point);
    e[i] = point.c->restitution;
    for (Eigen::Index j = 0; j <= i; ++j) {
      A(i, j) = A(j, i) = coupling(point, points_[index(set_[static_cast<std::size_t>(j)])]);
    }
  }
  const ImpactVector impulses = reflect(A, b, e).impulses;
  for (Eigen::Index i = 0; i < n; ++i) {
    push(points_[index(set_[static_cast<std::size_t>(i)])], impulses[i]);
  }
}

/// One after the other, until nothing approaches: energy is kept, symmetry is not.
void Impacts::reflect_in_order() {
  ++ordered_;
  bool has_changed = true;
  for (int sweep = 0; has_changed && sweep < 2 * kHitsMax; ++sweep) {
    has_changed = false;
    for (const std::int32_t k : set_) {
      Point& point = points_[index(k)];
      const double v = normal_velocity(point);
      if (v >= -kBounceSpeed) continue;
      const double e = sweep < kHitsMax ? point.c->restitution : 0;
      push(point, -(1 + e) * v / coupling(point, point));
      has_changed = true;
    }
  }
}

void Impacts::rub(Point& point) {
  point.is_struck = false;
  if (point.impulse <= 0) return;
  const Vector given = SingleContact(*point.c, *bodies_).rub(*point.p, point.impulse);
  const auto push_back = [&](std::int32_t line, const Vector& r, const Vector& impulse) {
    if (bodies_->yields(line)) return;
    const Vector v = bodies_->v(line) + Vector(bodies_->w(line)).cross(r);
    this->push_back(impulse, impulse.dot(v));
  };
  push_back(point.A.line, point.p->rA, -given);
  push_back(point.B.line, point.c->rB(*point.p), given);
  if (point.c->turns_heavily()) {
    TurningContact(*point.c, *bodies_).rub_at_impact(*bodies_, point.impulse);
  }
}

/// To the sub-step's start again, on the lines that lead on.
void Impacts::release(double t) {
  for (const Struck& body : struck_) {
    place_[index(body.line)] = -1;
    if (!bodies_->yields(body.line)) continue;
    ++hits_[index(body.line)];
    if (balance_ != nullptr) {
      const Vector v_before = body.v + t * bodies_->acceleration(body.line);
      const Vector v = bodies_->v(body.line), w = bodies_->w(body.line);
      balance_->impacts_J += bodies_->kinetic_energy(body.line, v, w) -
                             bodies_->kinetic_energy(body.line, v_before, body.w);
    }
    bodies_->v(body.line) -= t * bodies_->acceleration(body.line);
    bodies_->strike(body.line, bodies_->v(body.line) - body.v, bodies_->w(body.line) - body.w, t);
  }
}

}  // namespace cradle
