#include "server/world/ballistic.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "server/collision/bounds.h"
#include "server/collision/index.h"
#include "server/collision/kept_manifold.h"
#include "server/collision/pair_rules.h"
#include "server/dynamics/rotation.h"
#include "server/dynamics/schemes/scheme.h"
#include "server/world/ball_looks.h"
#include "server/world/ball_pairs.h"
#include "server/world/ball_parts.h"
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

/// All of a gas, as in the last tick: their numbers are those of then. Who had one is among the
/// candidates, or `list_balls` has forgotten it.
bool are_all_again(World::State& s, Executor& executor) {
  Ballistic& balls = s.balls;
  const std::size_t count = balls.candidates.size();
  if (count == 0 || balls.slots.size() != count) return false;
  balls.agree.resize(chunks_of(count, kBallsTogether));
  for_chunks(executor, count, kBallsTogether,
             [&](std::size_t part, std::size_t begin, std::size_t end) {
               bool agree = true;
               for (std::size_t k = begin; k < end; ++k) {
                 agree &= could_take_part(s, index(balls.candidates[k]));
               }
               balls.agree[part] = agree ? 1 : 0;
             });
  return std::ranges::find(balls.agree, 0) == balls.agree.end();
}

void number_balls(World::State& s) {
  Ballistic& balls = s.balls;
  balls.slots.clear();
  balls.number.assign(s.bodies.size(), -1);
  for (const std::int32_t slot : balls.candidates) {
    const std::size_t i = index(slot);
    if (!could_take_part(s, i)) continue;
    balls.number[i] = static_cast<std::int32_t>(balls.slots.size());
    balls.slots.push_back(slot);
    s.sleepers.is_box_known[i] = 0;
  }
}

Vector sum_of_velocities(World::State& s, Executor& executor) {
  Ballistic& balls = s.balls;
  balls.sums.resize(chunks_of(balls.slots.size(), kBallsTogether));
  for_chunks(executor, balls.slots.size(), kBallsTogether,
             [&](std::size_t part, std::size_t begin, std::size_t end) {
               Vector sum = Vector::Zero();
               for (std::size_t k = begin; k < end; ++k) sum += s.bodies.v[index(balls.slots[k])];
               balls.sums[part] = sum;
             });
  return std::accumulate(balls.sums.begin(), balls.sums.end(), Vector(Vector::Zero()));
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
  balls.scene.balls.resize(balls.slots.size());
  balls.squares.assign(chunks_of(balls.slots.size(), kBallsTogether), 0);
  for_chunks(executor, balls.slots.size(), kBallsTogether,
             [&](std::size_t part, std::size_t begin, std::size_t end) {
               double sum = 0;
               for (std::size_t k = begin; k < end; ++k) {
                 const Ball ball = ball_of(s, index(balls.slots[k]));
                 balls.scene.balls[k] = ball;
                 sum += (ball.v - balls.v_mean).squaredNorm();
               }
               balls.squares[part] = sum;
             });
  return std::accumulate(balls.squares.begin(), balls.squares.end(), 0.0);
}

/// One tick's balls, from the pairs of boxes to where they are at its end.
class Bounces {
 public:
  Bounces(World::State& s, Executor& executor) : s_(s), executor_(executor), balls_(s.balls) {}

  void find_and_apply() {
    list_pairs();
    leave_out();
    find_impacts(s_, executor_, any_is_out_);
    apply();
    std::erase_if(s_.pairs, [this](const BodyPair& pair) {
      return balls_.flies(index(pair.a)) || balls_.flies(index(pair.b));
    });
    if (balls_.are_apart && any_is_out_) add_pairs_of_bound_balls(s_);
  }

 private:
  std::int32_t number(std::int32_t slot) const { return balls_.number[index(slot)]; }
  bool is_out(std::int32_t number) const { return balls_.is_out[index(number)] != 0; }

  /// By their slots, whoever has found them.
  void list_pairs() {
    balls_.pairs.clear();
    balls_.strangers.clear();
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
  void add_balls(const BodyPair& balls) { balls_.pairs.push_back({balls.a, balls.b}); }

  void add(const BodyPair& pair) {
    const auto [a, b] = pair;
    if (number(a) >= 0 && number(b) >= 0) {
      add_balls({number(a), number(b)});
    } else if (number(a) >= 0) {
      add_other(number(a), b);
    } else if (number(b) >= 0) {
      add_other(number(b), a);
    }
  }

  void add_other(std::int32_t ball, std::int32_t other) {
    if (is_obstacle(s_, other)) {
      balls_.pairs.push_back({ball, ~obstacle_of(s_, other)});
    } else {
      balls_.strangers.push_back({ball, other});
    }
  }

  void leave_out() {
    balls_.is_bound.resize(balls_.pairs.size());
    for_each_index(executor_, balls_.pairs.size(), kBallPairs, [this](std::size_t k) {
      BallPair& pair = balls_.pairs[k];
      pair.time = first_time(balls_.scene, pair);
      balls_.is_bound[k] = is_bound(pair) ? 1 : 0;
    });
    for (std::size_t k = 0; k < balls_.pairs.size(); ++k) {
      const BallPair& pair = balls_.pairs[k];
      if (balls_.is_bound[k] == 0) continue;
      put_out(pair.a);
      if (pair.b >= 0) put_out(pair.b);
    }
    for (const Stranger& one : balls_.strangers) {
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
    const Ball& a = balls_.scene.balls[index(pair.a)];
    if (pair.b >= 0) {
      const Ball& b = balls_.scene.balls[index(pair.b)];
      const double R = a.radius + b.radius - kAtRest_m;
      return (b.x - a.x).squaredNorm() < R * R;
    }
    const NearestPlane plane = nearest_plane(balls_.scene.obstacles[index(~pair.b)], a.x);
    const double s = plane.distance - a.radius, pull = -plane.n.dot(s_.gravity_W);
    const double v = plane.n.dot(a.v);
    return s < -kAtRest_m || (s <= kAtRest_m && pull > 0 && v * v <= 2 * pull * kAtRest_m);
  }

  bool comes_near(const Stranger& one) {
    const Ball& ball = balls_.scene.balls[index(one.ball)];
    const Vector end = ball.x + s_.dt * ball.v + 0.5 * s_.dt * s_.dt * s_.gravity_W;
    const Vector r = Vector::Constant(ball.radius);
    const Aabb way{ball.x.cwiseMin(end) - r, ball.x.cwiseMax(end) + r};
    if (s_.bodies.shape[index(one.slot)].kind != ShapeKind::half_space) {
      return way.overlaps(box_of_collider(s_, one.slot));
    }
    return std::ranges::any_of(s_.planes, [&](const Plane& plane) {
      return s_.colliders[index(plane.slot)] == one.slot && overlap(way, plane);
    });
  }

  bool leave_out_partners() {
    bool found = false;
    for (const BallPair& pair : balls_.pairs) {
      if (pair.time == kNever || pair.b < 0 || is_out(pair.a) == is_out(pair.b)) continue;
      put_out(is_out(pair.a) ? pair.b : pair.a);
      found = true;
    }
    return found;
  }

  void apply() {
    const std::span parts = std::span(balls_.parts).first(balls_.parts_used);
    if (s_.balance.is_due) {
      apply_in_order(parts);
    } else {
      for_each_index(executor_, parts.size(), 1, [&](std::size_t k) {
        balls_.for_each_struck(parts[k], [this](const StruckBall& struck) { apply(struck); });
      });
    }
    for (const Stranger& one : balls_.strangers) {
      if (balls_.struck(one.ball) != nullptr) pass_by(one);
    }
    for (const BallPart& part : parts) {
      for (const Stranger& one : part.strangers) {
        if (balls_.grid.is_in(part.core, one.ball)) pass_by(one);
      }
    }
    if (any_is_out_) list_parted_balls();
    std::ranges::sort(balls_.passed_by);  // whoever has found them
  }

  /// Of their numbers: sums of balances are not to depend on parts.
  void apply_in_order(std::span<const BallPart> parts) {
    std::vector<const StruckBall*>& all = balls_.in_order;
    all.clear();
    all.reserve(balls_.slots.size());  // their number varies
    for (const BallPart& part : parts) {
      balls_.for_each_struck(part, [&all](const StruckBall& struck) { all.push_back(&struck); });
    }
    std::ranges::sort(all, {}, &StruckBall::number);
    for (const StruckBall* struck : all) apply(*struck);
  }

  void apply(const StruckBall& struck) {
    BodyTable& bodies = s_.bodies;
    const std::size_t i = index(balls_.slots[index(struck.number)]);
    const Vector x = bodies.x[i];
    const Momentum before = momentum_before(s_, i);
    bodies.x[i] = struck.ball.x;
    bodies.v[i] = struck.ball.v;
    if (struck.w != bodies.w[i]) {
      bodies.w[i] = struck.w;
      bodies.q[i] = normalised(struck.turn * bodies.q[i]);
    }
    if (s_.settings.is_planar) keep_in_plane(bodies, i);
    add_ball(s_, i, x, before);
  }

  /// A ball that has deviated.
  void pass_by(const Stranger& one) {
    const std::int32_t slot = balls_.slots[index(one.ball)];
    if (s_.fast.is_fast[index(slot)] == 0) return;
    balls_.passed_by.push_back({std::min(slot, one.slot), std::max(slot, one.slot)});
  }

  /// Of which one is out: either may have deviated into the other since they were told apart.
  void list_parted_balls() {
    for (const BallPair& pair : balls_.parts[0].events.pairs) {
      if (pair.b < 0 || is_out(pair.a) == is_out(pair.b)) continue;
      const std::int32_t a = balls_.slots[index(pair.a)], b = balls_.slots[index(pair.b)];
      if (s_.fast.is_fast[index(a)] == 0 && s_.fast.is_fast[index(b)] == 0) continue;
      balls_.passed_by.push_back({std::min(a, b), std::max(a, b)});
    }
  }

  World::State& s_;
  Executor& executor_;
  Ballistic& balls_;
  bool any_is_out_ = false;
};

}  // namespace

void show_ball(World::State& s, std::size_t k, std::size_t i) {
  s.moves[k] = 1;
  s.reach_of_tick[k] = {};
  s.poses[i].x = s.balls.ball(i).x;
}

void take_pose_of_ball(World::State& s, std::size_t i) {
  const Pose now{s.bodies.x[i], s.bodies.q[i].toRotationMatrix()};
  s.turned[i] += way_of_turning(s.poses[i].R, now.R, s.reaches[i]);
  s.poses[i] = now;
}

void list_balls(World::State& s) {
  s.balls.candidates.clear();
  s.balls.slots.clear();
  if (s.scheme->advance != exact) return;
  for (const std::int32_t slot : s.colliders) {
    if (is_ball(s, index(slot))) s.balls.candidates.push_back(slot);
  }
}

void begin_balls(World::State& s, Executor& executor) {
  Ballistic& balls = s.balls;
  balls.passed_by.clear();
  balls.are_apart = balls.are_slow = false;
  balls.report = {};
  balls.parts_used = 0;
  balls.scene.obstacles.clear();
  balls.obstacle_slots.clear();
  balls.scene.gravity = s.gravity_W;
  balls.scene.dt = s.dt;
  if (!balls.candidates.empty()) list_sprung(s);
  if (!are_all_again(s, executor)) number_balls(s);
  if (balls.slots.empty()) return;
  const auto count = static_cast<double>(balls.slots.size());
  balls.v_mean = sum_of_velocities(s, executor) / count;
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
