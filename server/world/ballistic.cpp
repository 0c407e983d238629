#include "server/world/ballistic.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "server/collision/bounds.h"
#include "server/collision/fetch.h"
#include "server/collision/index.h"
#include "server/collision/kept_manifold.h"
#include "server/collision/pair_rules.h"
#include "server/dynamics/rotation.h"
#include "server/dynamics/schemes/scheme.h"
#include "server/world/ball_pairs.h"
#include "server/world/contact_material.h"
#include "server/world/plane.h"
#include "server/world/state.h"

namespace cradle {
namespace {

/// Balls overlap or lie on something if they are deeper or nearer, m; slower, by the fall over as
/// much, is at rest. Above it events are exact; below, it is what soft contacts leave to rounding.
constexpr double kAtRest_m = 1e-6;
/// Worth a thread, at some tens of nanoseconds each.
constexpr int kBallPairs = 64;
constexpr std::size_t kBallsTogether = 1024;  // some nanoseconds each

/// By what it is made of.
bool is_ball(const World::State& s, std::size_t i) {
  const BodyTable& bodies = s.bodies;
  if (bodies.shape[i].kind != ShapeKind::sphere || bodies.kind[i] != BodyKind::dynamic) {
    return false;
  }
  if (bodies.is_offset[i] != 0 || bodies.drag[i].any()) return false;
  const Vector& J = bodies.inertia[i];
  return s.settings.is_planar || (J.x() == J.y() && J.y() == J.z());
}

/// And by what happens to it.
bool could_take_part(const World::State& s, std::size_t i) {
  return s.loads.course[i] == Course::falls && s.bodies.in_contact[i] == 0 &&
         s.bodies.quarantined[i] == 0 && s.balls.is_sprung[i] == 0;
}

void list_sprung(World::State& s) {
  s.balls.is_sprung.assign(s.bodies.size(), 0);
  for (const Spring& spring : s.springs) {
    for (const BodyId end : {spring.a, spring.b}) {
      if (const auto slot = s.bodies.slot(end)) s.balls.is_sprung[*slot] = 1;
    }
  }
}

Ball ball_of(const World::State& s, std::size_t i) {
  Ball ball;
  ball.x = s.bodies.x[i];
  ball.v = s.bodies.v[i];
  ball.radius = s.reaches[i];
  return ball;
}

/// As they are when the tick begins. Returns the sum of their velocities' squares about the mean.
double take_balls(World::State& s, Executor& executor) {
  Ballistic& balls = s.balls;
  balls.events.balls.resize(balls.slots.size());
  balls.squares.assign(chunks_of(balls.slots.size(), kBallsTogether), 0);
  for_chunks(executor, balls.slots.size(), kBallsTogether,
             [&](std::size_t part, std::size_t begin, std::size_t end) {
               double sum = 0;
               for (std::size_t k = begin; k < end; ++k) {
                 const Ball ball = ball_of(s, index(balls.slots[k]));
                 balls.events.balls[k] = ball;
                 sum += (ball.v - balls.v_mean).squaredNorm();
               }
               balls.squares[part] = sum;
             });
  return std::accumulate(balls.squares.begin(), balls.squares.end(), 0.0);
}

/// One tick's balls, from the pairs of boxes to where they are at its end.
class Bounces final : public BallSurroundings {
 public:
  Bounces(World::State& s, Executor& executor)
      : s_(s), executor_(executor), balls_(s.balls), events_(s.balls.events) {
    strangers_.clear();
    obstacle_slots_.clear();
  }

  void find_and_apply() {
    list_pairs();
    leave_out();
    balls_.report = events_.run(balls_.is_out, *this);
    apply();
    std::erase_if(s_.pairs, [this](const BodyPair& pair) {
      return balls_.flies(index(pair.a)) || balls_.flies(index(pair.b));
    });
    if (balls_.are_apart && any_is_out_) add_pairs_of_bound_balls(s_);
  }

  /// Among others only if the ball leaves the box that its pairs were sought with.
  void look_around(std::int32_t number, double now) override {
    const std::int32_t slot = balls_.slots[index(number)];
    list_partners(number);
    const auto meet = [&](std::int32_t other) {
      if (other == slot || std::ranges::find(partners_, other) != partners_.end()) return;
      add({std::min(other, slot), std::max(other, slot)});
    };
    if (balls_.are_apart) {
      balls_.grid.note(number, events_.balls[index(number)]);
      balls_.grid.for_each_near(number, now,
                                [&](std::int32_t other) { meet(balls_.slots[index(other)]); });
    }
    const Aabb way = way_of(number, now);
    Aabb& known = box_of(number);
    if (known.holds(way)) return;
    known.lower = known.lower.cwiseMin(way.lower);
    known.upper = known.upper.cwiseMax(way.upper);
    for_each_collider_in(way, meet);
  }

  void expect(std::int32_t number) const override {
    const std::size_t i = index(balls_.slots[index(number)]);
    if (balls_.are_apart) fetch(&s_.boxes[index(balls_.colliders[index(number)])], sizeof(Aabb));
    fetch(&s_.bodies.w[i]);
    fetch(&s_.bodies.inverse_mass[i]);
    fetch(&s_.bodies.inverse_inertia[i]);
    fetch(&s_.bodies.material[i]);
  }

  void before_impacts(std::int32_t number, StruckBall& struck) override {
    const std::size_t i = index(balls_.slots[index(number)]);
    if (balls_.are_apart) {
      // Where it was expected to go is known from now on: it may have to look beyond.
      const Aabb box = box_of_ball(s_, events_.balls[index(number)]);
      box_of(number).lower = box.lower;  // number by number, as they were written just now
      box_of(number).upper = box.upper;
    }
    struck.x_start = s_.bodies.x[i];
    struck.w = s_.bodies.w[i];
    struck.turn = Rotation::Identity();
    struck.held = Vector::Zero();
    struck.inverse_mass = s_.bodies.inverse_mass[i];
    struck.inverse_inertia = s_.bodies.inverse_inertia[i].z();
  }

  BallMaterial material_of(const BallPair& pair) override {
    const std::int32_t a = balls_.slots[index(pair.a)];
    const std::int32_t b =
        pair.b < 0 ? obstacle_slots_[index(~pair.b)] : balls_.slots[index(pair.b)];
    const ContactMaterial both =
        combined(s_.bodies.material[index(a)], s_.bodies.material[index(b)]);
    return {both.restitution, both.friction, both.rolling_m, both.torsional_m};
  }

 private:
  using Stranger = Ballistic::Stranger;

  std::int32_t number(std::int32_t slot) const { return balls_.number[index(slot)]; }
  bool is_out(std::int32_t number) const { return balls_.is_out[index(number)] != 0; }

  Aabb& box(std::int32_t slot) {
    const auto at = std::ranges::lower_bound(s_.colliders, slot);
    return s_.boxes[static_cast<std::size_t>(at - s_.colliders.begin())];
  }

  Aabb& box_of(std::int32_t number) {
    if (!balls_.are_apart) return box(balls_.slots[index(number)]);
    return s_.boxes[index(balls_.colliders[index(number)])];
  }

  /// Calls `visit(slot)`; of balls that are apart for none.
  template <class F>
  void for_each_collider_in(const Aabb& way, const F& visit) const {
    const auto look_at = [&](std::size_t k) {
      if (way.overlaps(s_.boxes[k])) visit(s_.colliders[k]);
    };
    if (balls_.are_apart) {
      for (const std::int32_t k : balls_.others.colliders) look_at(index(k));
    } else {
      for (std::size_t k = 0; k < s_.boxes.size(); ++k) look_at(k);
    }
    for (const Plane& plane : s_.planes) {
      if (overlap(way, plane)) visit(s_.colliders[index(plane.slot)]);
    }
  }

  /// By slot.
  void list_partners(std::int32_t number) {
    partners_.clear();
    events_.for_each_pair_of(number, [&](std::int32_t k) {
      const BallPair& pair = events_.pairs[index(k)];
      const std::int32_t other = pair.a == number ? pair.b : pair.a;
      partners_.push_back(other < 0 ? obstacle_slots_[index(~other)] : balls_.slots[index(other)]);
    });
  }

  Aabb way_of(std::int32_t number, double from) const {
    const Vector x = events_.position(number, from), end = events_.position(number, s_.dt);
    const Vector r = Vector::Constant(events_.balls[index(number)].radius);
    return {x.cwiseMin(end) - r, x.cwiseMax(end) + r};
  }

  /// By their slots, whoever has found them.
  void list_pairs() {
    balls_.met.clear();
    if (balls_.are_apart) {
      s_.culling.nodes_seen += balls_.grid.find_pairs(executor_, s_.settings.lanes, balls_.met);
      s_.culling.boxes_seen += static_cast<std::int64_t>(balls_.slots.size() + balls_.met.size());
    }
    auto next = balls_.met.cbegin();
    for (const BodyPair& pair : s_.pairs) {
      for (; next != balls_.met.cend() && slots_of(*next) < pair; ++next) add_balls(*next);
      add(pair);
    }
    for (; next != balls_.met.cend(); ++next) add_balls(*next);
  }

  BodyPair slots_of(const BodyPair& balls) const {
    return {balls_.slots[index(balls.a)], balls_.slots[index(balls.b)]};
  }
  void add_balls(const BodyPair& balls) { events_.pairs.push_back({balls.a, balls.b}); }

  void add(const BodyPair& pair) {
    const auto [a, b] = pair;
    if (number(a) >= 0 && number(b) >= 0) {
      events_.pairs.push_back({number(a), number(b)});
    } else if (number(a) >= 0) {
      add_other(number(a), b);
    } else if (number(b) >= 0) {
      add_other(number(b), a);
    }
  }

  void add_other(std::int32_t ball, std::int32_t other) {
    const bool stands = s_.bodies.kind[index(other)] == BodyKind::fixed;
    if (stands && is_obstacle(s_.bodies.shape[index(other)].kind)) {
      events_.pairs.push_back({ball, ~obstacle_of(other)});
    } else {
      strangers_.push_back({ball, other});
    }
  }

  std::int32_t obstacle_of(std::int32_t slot) {
    std::int32_t& number = balls_.obstacle[index(slot)];
    if (number >= 0) return number;
    number = static_cast<std::int32_t>(obstacle_slots_.size());
    obstacle_slots_.push_back(slot);
    Obstacle obstacle{s_.bodies.shape[index(slot)], s_.poses[index(slot)]};
    if (s_.settings.is_planar && obstacle.shape.kind == ShapeKind::capsule) {
      const Matrix R = obstacle.X.R;  // along x there
      obstacle.X.R << R.col(1), R.col(2), R.col(0);
    }
    events_.obstacles.push_back(obstacle);
    return number;
  }

  void leave_out() {
    balls_.is_bound.resize(events_.pairs.size());
    for_each_index(executor_, events_.pairs.size(), kBallPairs, [this](std::size_t k) {
      BallPair& pair = events_.pairs[k];
      pair.time = events_.first_time(pair);
      balls_.is_bound[k] = is_bound(pair) ? 1 : 0;
    });
    for (std::size_t k = 0; k < events_.pairs.size(); ++k) {
      const BallPair& pair = events_.pairs[k];
      if (balls_.is_bound[k] == 0) continue;
      put_out(pair.a);
      if (pair.b >= 0) put_out(pair.b);
    }
    for (const Stranger& one : strangers_) {
      if (is_out(one.ball)) continue;
      if (comes_near(one)) put_out(one.ball);
    }
    while (any_is_out_ && leave_out_partners()) {
    }
  }

  void put_out(std::int32_t number) {
    if (std::exchange(balls_.is_out[index(number)], std::uint8_t{1}) != 0) return;
    take_pose_of_ball(s_, index(balls_.slots[index(number)]));
    any_is_out_ = true;
  }

  /// Overlapping, or at rest on an obstacle.
  bool is_bound(const BallPair& pair) const {
    const Ball& a = events_.balls[index(pair.a)];
    if (pair.b >= 0) {
      const Ball& b = events_.balls[index(pair.b)];
      const double R = a.radius + b.radius - kAtRest_m;
      return (b.x - a.x).squaredNorm() < R * R;
    }
    const NearestPlane plane = nearest_plane(events_.obstacles[index(~pair.b)], a.x);
    const double s = plane.distance - a.radius, pull = -plane.n.dot(s_.gravity_W);
    const double v = plane.n.dot(a.v);
    return s < -kAtRest_m || (s <= kAtRest_m && pull > 0 && v * v <= 2 * pull * kAtRest_m);
  }

  bool comes_near(const Stranger& one) {
    const Aabb way = way_of(one.ball, 0);
    if (s_.bodies.shape[index(one.slot)].kind != ShapeKind::half_space) {
      return way.overlaps(box(one.slot));
    }
    return std::ranges::any_of(s_.planes, [&](const Plane& plane) {
      return s_.colliders[index(plane.slot)] == one.slot && overlap(way, plane);
    });
  }

  bool leave_out_partners() {
    bool found = false;
    for (const BallPair& pair : events_.pairs) {
      if (pair.time == kNever || pair.b < 0 || is_out(pair.a) == is_out(pair.b)) continue;
      put_out(is_out(pair.a) ? pair.b : pair.a);
      found = true;
    }
    return found;
  }

  void apply() {
    BodyTable& bodies = s_.bodies;
    for (const std::int32_t number : events_.deviated) {
      const Ball& ball = events_.balls[index(number)];
      const std::size_t i = index(balls_.slots[index(number)]);
      const Vector x = bodies.x[i];
      const Momentum before = momentum_before(s_, i);
      bodies.x[i] = ball.x;
      bodies.v[i] = ball.v;
      const StruckBall& struck = events_.struck[index(number)];
      if (struck.w != bodies.w[i]) {
        bodies.w[i] = struck.w;
        bodies.q[i] = normalised(struck.turn * bodies.q[i]);
      }
      if (s_.settings.is_planar) keep_in_plane(bodies, i);
      add_ball(s_, i, x, before);
    }
    for (const Stranger& one : strangers_) {
      const std::int32_t slot = balls_.slots[index(one.ball)];
      const bool has_deviated = events_.balls[index(one.ball)].impacts > 0;
      if (!has_deviated || s_.fast.is_fast[index(slot)] == 0) continue;
      balls_.passed_by.push_back({std::min(slot, one.slot), std::max(slot, one.slot)});
    }
    if (any_is_out_) list_parted_balls();
  }

  /// Of which one is out: either may have deviated into the other since they were told apart.
  void list_parted_balls() {
    for (const BallPair& pair : events_.pairs) {
      if (pair.b < 0 || is_out(pair.a) == is_out(pair.b)) continue;
      const std::int32_t a = balls_.slots[index(pair.a)], b = balls_.slots[index(pair.b)];
      if (s_.fast.is_fast[index(a)] == 0 && s_.fast.is_fast[index(b)] == 0) continue;
      balls_.passed_by.push_back({std::min(a, b), std::max(a, b)});
    }
  }

  World::State& s_;
  Executor& executor_;
  Ballistic& balls_;
  BallEvents& events_;
  std::vector<Stranger>& strangers_ = balls_.strangers;
  std::vector<std::int32_t>& obstacle_slots_ = balls_.obstacle_slots;
  std::vector<std::int32_t>& partners_ = balls_.partners;
  bool any_is_out_ = false;
};

}  // namespace

void show_ball(World::State& s, std::size_t k, std::size_t i) {
  s.moves[k] = 1;
  s.reach_of_tick[k] = {};
  s.poses[i].x = s.balls.x_start(i);
}

void take_pose_of_ball(World::State& s, std::size_t i) {
  const Pose now{s.bodies.x[i], s.bodies.q[i].toRotationMatrix()};
  s.turned[i] += way_of_turning(s.poses[i].R, now.R, s.reaches[i]);
  s.poses[i] = now;
}

void list_balls(World::State& s) {
  s.balls.candidates.clear();
  if (s.scheme->advance != exact) return;
  for (const std::int32_t slot : s.colliders) {
    if (is_ball(s, index(slot))) s.balls.candidates.push_back(slot);
  }
}

void begin_balls(World::State& s, Executor& executor) {
  Ballistic& balls = s.balls;
  balls.slots.clear();
  balls.passed_by.clear();
  balls.are_apart = balls.are_slow = false;
  balls.report = {};
  balls.number.assign(s.bodies.size(), -1);
  balls.events.begin(s.dt, s.gravity_W);
  if (balls.candidates.empty()) return;
  list_sprung(s);
  Vector sum = Vector::Zero();
  for (const std::int32_t slot : balls.candidates) {
    const std::size_t i = index(slot);
    if (!could_take_part(s, i)) continue;
    balls.number[i] = static_cast<std::int32_t>(balls.slots.size());
    balls.slots.push_back(slot);
    s.sleepers.is_box_known[i] = 0;
    sum += s.bodies.v[i];
  }
  if (balls.slots.empty()) return;
  const auto count = static_cast<double>(balls.slots.size());
  balls.v_mean = sum / count;
  balls.spread = std::sqrt(take_balls(s, executor) / count);
  balls.is_out.assign(balls.slots.size(), 0);
  balls.obstacle.assign(s.bodies.size(), -1);
  part_balls(s, executor);
}

Aabb box_of_ball(const World::State& s, const Ball& ball) {
  const Ballistic& balls = s.balls;
  const double expected = kSpreads * balls.spread, own2 = (ball.v - balls.v_mean).squaredNorm();
  const double deviation = own2 > expected * expected ? std::sqrt(own2) : expected;
  const Vector r = Vector::Constant(ball.radius + s.dt * deviation + s.margin_max);
  const Vector way = s.dt * balls.v_mean + 0.5 * s.dt * s.dt * s.gravity_W;
  return {ball.x + way.cwiseMin(0.0) - r, ball.x + way.cwiseMax(0.0) + r};
}

void bounce_balls(World::State& s, Executor& executor) {
  if (!s.balls.slots.empty()) Bounces(s, executor).find_and_apply();
}

}  // namespace cradle
