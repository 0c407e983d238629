// Events inside a tick: an impact happens at its time, then what follows from it is foreseen anew.
//
// Sources: Alder and Wainwright (1959), "Studies in Molecular Dynamics I" (events in their order);
// Smith et al. (2012) for what is struck at once (reflections.h). The bounces of one ball on an
// obstacle are a geometric series: with outgoing speed v and acceleration a into it, they end after
//   T = 2 v / (a (1 - e)),
// and if the tick lasts longer, the ball is at rest on it at the tick's end: it slides along it,
// with what the obstacle leaves of gravity, into what else is in its way.
// Friction acts once an impact: lambda_t = min(mu lambda, |vt| / K_t), exact for a ball against one
// contact, since its normal and tangential velocities do not depend on each other.
// Order: none; exact to rounding, but for friction in sets of several contacts (one after the
// other), and without friction while a ball rests for the rest of its first tick.
// Cost: n log n in the impacts, 0.7 us each in a gas of 10 000 (Xeon), half of it to look around.
#include "server/dynamics/impact/ball_events.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/collision/fetch.h"
#include "server/collision/index.h"
#include "server/dynamics/rotation.h"

namespace cradle {
namespace {

/// Impacts of one ball in a tick, from which on it loses its restitution; and after as many again
/// it stays where it is for the rest of the tick (inelastic collapse).
constexpr int kImpactsMax = 64;
/// Motion along an obstacle: what rounding leaves across it, of speed and of gravity.
constexpr double kLevel = 1e-9;

}  // namespace

void BallEvents::begin(const BallScene& scene) {
  scene_ = &scene;
  dt_ = scene.dt;
  g_ = scene.gravity;
  pairs.clear();
  struck_.clear();
  strikes_.clear();
  any_rests_ = false;
  at_.assign(scene.balls.size(), -1);
}

double BallEvents::time_of(const BallPair& pair, double now) const {
  const Ball& a = ball(pair.a);
  return pair.b >= 0 ? impact_time(a, ball(pair.b), now, dt_)
                     : impact_time(a, scene_->obstacles[index(~pair.b)], g_, now, dt_);
}

/// Of a ball that rests on one obstacle, with another.
double BallEvents::time_along(const BallPair& pair, double now) const {
  const Obstacle& obstacle = scene_->obstacles[index(~pair.b)];
  const Vector free = g_ - struck(pair.a)->held, x = position(pair.a, now),
               v = velocity(pair.a, now);
  Ball a = ball(pair.a);
  const NearestPlane plane = nearest_plane(obstacle, x);
  const bool is_held = plane.distance <= (1 + kStruckTogether) * a.radius &&
                       -plane.n.dot(v) <= kLevel * (v.norm() + dt_ * g_.norm()) &&
                       -plane.n.dot(free) <= kLevel * g_.norm();
  if (is_held) return kNever;
  a.v = v - now * free;
  a.x = x - now * a.v - 0.5 * now * now * free;
  return impact_time(a, obstacle, free, now, dt_);
}

bool BallEvents::do_meet(std::int32_t a, std::int32_t b, double now) const {
  if (rests(a) || rests(b)) return true;
  const Ball &one = ball(std::min(a, b)), &other = ball(std::max(a, b));
  if (impact_time(one, other, now, dt_) != kNever) return true;
  const double reach = (1 + kStruckTogether) * (one.radius + other.radius);
  return (other.x - one.x + now * (other.v - one.v)).squaredNorm() <= reach * reach;
}

void BallEvents::run(std::span<const std::uint8_t> is_out, BallSurroundings& surroundings) {
  is_out_ = is_out;
  due_.clear();
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const BallPair& pair = pairs[k];
    if (pair.time == kNever || is_out[index(pair.a)] != 0) continue;
    if (pair.b >= 0 && is_out[index(pair.b)] != 0) continue;
    due_.push_back({pair.time, static_cast<std::int32_t>(k), 0, 0});
  }
  if (due_.empty()) return;
  std::ranges::sort(due_, [](const Due& one, const Due& other) { return is_later(other, one); });
  next_due_ = 0;
  foreseen_.clear();
  foreseen_.reserve(at_.size());  // their number varies: more than there will be
  struck_.reserve(at_.size());
  strikes_.reserve(at_.size());
  first_.assign(at_.size(), -1);
  next_.clear();
  place_.assign(at_.size(), -1);
  link_new_pairs();
  for (Due now{}; take_next(now);) {
    constexpr std::size_t kAhead = 2;
    if (next_due_ + kAhead < due_.size()) expect(due_[next_due_ + kAhead].pair, surroundings);
    const BallPair& pair = pairs[index(now.pair)];
    if (impacts_of(pair.a) != now.impacts_a || impacts_of(pair.b) != now.impacts_b) continue;
    strike(now.pair, now.time, surroundings);
    for (const std::int32_t one : changed_) {
      surroundings.look_around(struck_of(one), now.time);
      link_new_pairs();
    }
    for (const std::int32_t one : changed_) foresee_all_of(one, now.time);
  }
}

/// Of what comes soon, most likely: balls lie anywhere, and so do their partners.
void BallEvents::expect(std::int32_t k, const BallSurroundings& surroundings) const {
  const BallPair& pair = pairs[index(k)];
  for (const std::int32_t one : {pair.a, pair.b}) {
    if (one < 0) continue;
    if (struck(one) == nullptr) surroundings.expect(one);
    for_each_pair_of(one, [&](std::int32_t number) {
      const BallPair& both = pairs[index(number)];
      const std::int32_t other = both.a == one ? both.b : both.a;
      if (other >= 0) fetch(&scene_->balls[index(other)]);
    });
  }
}

bool BallEvents::take_next(Due& now) {
  const bool is_left = next_due_ < due_.size();
  if (foreseen_.empty() || (is_left && is_later(foreseen_.front(), due_[next_due_]))) {
    if (is_left) now = due_[next_due_++];
    return is_left;
  }
  std::ranges::pop_heap(foreseen_, is_later);
  now = foreseen_.back();
  foreseen_.pop_back();
  return true;
}

bool BallEvents::is_later(const Due& one, const Due& other) {
  return one.time != other.time ? one.time > other.time : one.pair > other.pair;
}

void BallEvents::link_new_pairs() {
  for (auto k = static_cast<std::int32_t>(next_.size() / 2); index(k) < pairs.size(); ++k) {
    const BallPair& pair = pairs[index(k)];
    next_.push_back(std::exchange(first_[index(pair.a)], 2 * k));
    next_.push_back(pair.b < 0 ? -1 : std::exchange(first_[index(pair.b)], 2 * k + 1));
  }
}

void BallEvents::foresee(std::int32_t k, double now) {
  const BallPair& pair = pairs[index(k)];
  if (is_out_[index(pair.a)] != 0 || (pair.b >= 0 && is_out_[index(pair.b)] != 0)) return;
  const int impacts_a = impacts_of(pair.a), impacts_b = impacts_of(pair.b);
  if (std::max(impacts_a, impacts_b) > 2 * kImpactsMax) return;
  const double time = pair.b < 0 && rests(pair.a) ? time_along(pair, now) : time_of(pair, now);
  if (time == kNever) return;
  foreseen_.push_back({time, k, impacts_a, impacts_b});
  std::ranges::push_heap(foreseen_, is_later);
}

void BallEvents::foresee_all_of(std::int32_t ball, double now) {
  for_each_pair_of(ball, [&](std::int32_t k) { foresee(k, now); });
}

/// The impact of a pair, and of all that touches it.
void BallEvents::strike(std::int32_t pair, double t, BallSurroundings& surroundings) {
  gather(pair, t, surroundings);
  strikes_.push_back({changed_[0], contacts_.size() > std::size_t{kReflectedTogether}, 0});
  if (strikes_.back().is_ordered) {
    reflect_in_order();
  } else {
    reflect_together();
  }
  for (const Contact& contact : contacts_) rub(contact, t);
  for (const std::int32_t number : changed_) {
    const std::size_t place = index(std::exchange(place_[index(number)], -1));
    StruckBall& one = struck_of(number);
    one.held = Vector::Zero();
    one.ball.v = v_[place] - t * g_;
    one.ball.x = x_[place] - t * one.ball.v - 0.5 * t * t * g_;
    if (++one.ball.impacts == 2 * kImpactsMax + 1) stay(one.ball, x_[place]);
  }
  for (const Contact& contact : contacts_) rest_if_due(contact, t);
}

/// It keeps its velocity, and loses the rest of the tick.
void BallEvents::stay(Ball& ball, const Vector& x) {
  ++strikes_.back().spent;
  ball.x = x - dt_ * ball.v - 0.5 * dt_ * dt_ * g_;
}

bool BallEvents::is_touching(const BallPair& pair, double t, Vector& n) const {
  const double radius = ball(pair.a).radius;
  const Vector x = position(pair.a, t);
  if (pair.b >= 0) {
    const double other = ball(pair.b).radius;
    const Vector d = position(pair.b, t) - x;
    const double reach = radius + other + kStruckTogether * std::min(radius, other);
    const double length2 = d.squaredNorm();
    n = d / std::sqrt(length2);
    return length2 <= reach * reach;
  }
  const NearestPlane plane = nearest_plane(scene_->obstacles[index(~pair.b)], x);
  n = -plane.n;
  return plane.distance <= (1 + kStruckTogether) * radius;
}

/// All contacts that are connected with it by balls; and these balls, as they are at the time.
void BallEvents::gather(std::int32_t first, double t, BallSurroundings& surroundings) {
  contacts_.clear();
  changed_.clear();
  x_.clear();
  v_.clear();
  const auto take = [&](std::int32_t number) {
    if (number < 0 || place_[index(number)] >= 0) return;
    place_[index(number)] = static_cast<std::int32_t>(changed_.size());
    changed_.push_back(number);
    if (struck(number) == nullptr) {
      at_[index(number)] = static_cast<std::int32_t>(struck_.size());
      surroundings.before_impacts(struck_.emplace_back(number, scene_->balls[index(number)]));
    }
    x_.emplace_back().noalias() = position(number, t);
    v_.emplace_back().noalias() = velocity(number, t);
  };
  take(pairs[index(first)].a);
  take(pairs[index(first)].b);
  for (std::size_t k = 0; k < changed_.size(); ++k) {
    const std::int32_t one = changed_[k];
    for_each_pair_of(one, [&](std::int32_t number) {
      const BallPair& pair = pairs[index(number)];
      const std::int32_t other = pair.a == one ? pair.b : pair.a;
      const bool is_known =
          other >= 0 && place_[index(other)] >= 0 && index(place_[index(other)]) < k;
      if (is_known || is_out_[index(pair.a)] != 0) return;
      if (other >= 0 && is_out_[index(other)] != 0) return;
      Contact contact{number, Vector::Zero(), 0, {}};
      if (!is_touching(pair, t, contact.n) && number != first) return;
      contact.material = surroundings.material_of(pair);
      contacts_.push_back(contact);
      take(other);
    });
  }
}

double BallEvents::restitution(const Contact& contact) const {
  const BallPair& pair = pairs[index(contact.pair)];
  const int impacts = std::max(impacts_of(pair.a), impacts_of(pair.b));
  return impacts < kImpactsMax ? contact.material.restitution : 0;
}

double BallEvents::normal_velocity(const Contact& contact) const {
  const BallPair& pair = pairs[index(contact.pair)];
  const Vector& v_a = v_[index(place_[index(pair.a)])];
  if (pair.b < 0) return -contact.n.dot(v_a);
  return contact.n.dot(v_[index(place_[index(pair.b)])] - v_a);
}

void BallEvents::push(const Contact& contact, const Vector& impulse) {
  const BallPair& pair = pairs[index(contact.pair)];
  v_[index(place_[index(pair.a)])] -= struck(pair.a)->inverse_mass * impulse;
  if (pair.b < 0) return;
  v_[index(place_[index(pair.b)])] += struck(pair.b)->inverse_mass * impulse;
}

void BallEvents::push_normal(Contact& contact, double impulse) {
  push(contact, impulse * contact.n);
  contact.impulse += impulse;
}

double BallEvents::inverse_mass(const BallPair& pair) const {
  const double of_b = pair.b >= 0 ? struck(pair.b)->inverse_mass : 0;
  return struck(pair.a)->inverse_mass + of_b;
}

void BallEvents::reflect_together() {
  if (contacts_.size() == 1) {
    Contact& only = contacts_[0];
    const BallPair& pair = pairs[index(only.pair)];
    const double approach = std::max(-normal_velocity(only), 0.0);
    push_normal(only, (1 + restitution(only)) * approach / inverse_mass(pair));
    return;
  }
  const auto n = static_cast<Eigen::Index>(contacts_.size());
  ImpactMatrix A = ImpactMatrix::Zero(n, n);
  ImpactVector b(n), e(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Contact& one = contacts_[static_cast<std::size_t>(i)];
    b[i] = normal_velocity(one);
    e[i] = restitution(one);
    for (Eigen::Index j = 0; j <= i; ++j) {
      A(i, j) = A(j, i) = coupling(one, contacts_[static_cast<std::size_t>(j)]);
    }
  }
  const Reflection reflection = reflect(A, b, e);
  for (Eigen::Index i = 0; i < n; ++i) {
    push_normal(contacts_[static_cast<std::size_t>(i)], reflection.impulses[i]);
  }
}

/// What a unit impulse of one changes of the other's normal velocity, 1/kg.
double BallEvents::coupling(const Contact& one, const Contact& other) const {
  const BallPair &p = pairs[index(one.pair)], &q = pairs[index(other.pair)];
  double sum = 0;
  for (const std::int32_t i : {p.a, p.b}) {
    if (i < 0) continue;
    const double side_p = i == p.a ? -1 : 1;
    if (i == q.a) sum -= side_p * struck(i)->inverse_mass;
    if (i == q.b) sum += side_p * struck(i)->inverse_mass;
  }
  return sum * one.n.dot(other.n);
}

/// Energy and momentum are kept, symmetry is not.
void BallEvents::reflect_in_order() {
  double fastest = 0;
  for (const Contact& contact : contacts_) {
    fastest = std::max(fastest, -normal_velocity(contact));
  }
  bool has_changed = true;
  for (int sweep = 0; has_changed && sweep < 2 * kImpactsMax; ++sweep) {
    has_changed = false;
    for (Contact& contact : contacts_) {
      const BallPair& pair = pairs[index(contact.pair)];
      const double approach = -normal_velocity(contact);
      if (!(approach > 1e-12 * fastest)) continue;
      const double e = sweep < kImpactsMax ? restitution(contact) : 0;
      push_normal(contact, (1 + e) * approach / inverse_mass(pair));
      has_changed = true;
    }
  }
}

/// Friction, with the spins.
void BallEvents::rub(const Contact& contact, double t) {
  const BallPair& pair = pairs[index(contact.pair)];
  if (contact.impulse <= 0) return;
  const BallMaterial& material = contact.material;
  if (material.rolling_m > 0 || material.torsional_m > 0) rub_turning(contact, t);
  if (material.friction == 0) return;
  StruckBall& a = struck_of(pair.a);
  StruckBall* b = pair.b >= 0 ? &struck_of(pair.b) : nullptr;
  const double radius_a = a.ball.radius;
  const double radius_b = b != nullptr ? b->ball.radius : 0;
  const Vector r_a = radius_a * contact.n;
  Vector v = -(v_[index(place_[index(pair.a)])] + a.w.cross(r_a));
  double K = inverse_mass(pair) + radius_a * radius_a * a.inverse_inertia;
  if (b != nullptr) {
    v += v_[index(place_[index(pair.b)])] - b->w.cross(radius_b * contact.n);
    K += radius_b * radius_b * b->inverse_inertia;
  }
  v -= contact.n.dot(v) * contact.n;
  const double speed = v.norm();
  if (speed == 0) return;
  const Vector impulse = -std::min(material.friction * contact.impulse, speed / K) / speed * v;
  push(contact, impulse);
  spin(a, -a.inverse_inertia * r_a.cross(impulse), t);
  if (b != nullptr) spin(*b, -b->inverse_inertia * radius_b * contact.n.cross(impulse), t);
}

/// Rolling and torsional friction, of spheres alike about all axes.
void BallEvents::rub_turning(const Contact& contact, double t) {
  const BallPair& pair = pairs[index(contact.pair)];
  StruckBall& a = struck_of(pair.a);
  StruckBall* b = pair.b >= 0 ? &struck_of(pair.b) : nullptr;
  const double K = a.inverse_inertia + (b != nullptr ? b->inverse_inertia : 0);
  if (K == 0) return;
  const Vector W = (b != nullptr ? b->w : Vector(Vector::Zero())) - a.w;
  const Vector W_n = contact.n.dot(W) * contact.n, W_t = W - W_n;
  const auto stopping = [&](const Vector& part, double limit) {
    const double size = part.norm();
    return size * (1 / K) > limit ? Vector(-limit / size * part) : Vector(-1 / K * part);
  };
  const Vector impulse = stopping(W_n, contact.material.torsional_m * contact.impulse) +
                         stopping(W_t, contact.material.rolling_m * contact.impulse);
  spin(a, -a.inverse_inertia * impulse, t);
  if (b != nullptr) spin(*b, b->inverse_inertia * impulse, t);
}

void BallEvents::spin(StruckBall& ball, const Vector& change, double t) {
  const Vector w = ball.w + change;
  ball.turn = rotation_exp(-t * w) * rotation_exp(t * ball.w) * ball.turn;
  ball.w = w;
}

/// On an obstacle, if the series of its bounces ends in this tick.
void BallEvents::rest_if_due(const Contact& contact, double t) {
  const BallPair& pair = pairs[index(contact.pair)];
  if (pair.b >= 0) return;
  StruckBall& one = struck_of(pair.a);
  Vector& held = one.held;
  const Vector n = -contact.n;
  const double a = -n.dot(g_ - held);
  const double leaving = n.dot(velocity(pair.a, t));
  const double left = dt_ - t;
  if (!(a > 0) || !(2 * leaving <= a * (1 - restitution(contact)) * left)) return;
  const Vector x = position(pair.a, t);
  Vector v = velocity(pair.a, t) - leaving * n;
  Vector along = g_ - n.dot(g_) * n;
  if (along.dot(held) > 0) {  // on both, in the groove between them
    const Vector groove = n.cross(held).normalized();
    v = groove.dot(v) * groove;
    along = groove.dot(g_) * groove;
  }
  held = g_ - along;
  any_rests_ = true;
  const Vector x_end = x + left * v + 0.5 * left * left * along;
  one.ball.v = v + left * along - dt_ * g_;
  one.ball.x = x_end - dt_ * one.ball.v - 0.5 * dt_ * dt_ * g_;
}

}  // namespace cradle
