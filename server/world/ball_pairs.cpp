#include "server/world/ball_pairs.h"

#include <algorithm>
#include <cmath>

#include "server/collision/index.h"
#include "server/collision/pair_rules.h"
#include "server/world/state.h"

namespace cradle {
namespace {

/// One collider in ... may be none of these balls: each of those asks the grid for what it meets.
constexpr std::size_t kOthers = 4;

BodyPair in_order(std::int32_t a, std::int32_t b) { return {std::min(a, b), std::max(a, b)}; }

/// Which colliders the balls are, and who else there is.
void list_others(World::State& s) {
  Ballistic::Others& others = s.balls.others;
  others.colliders.clear();
  others.ids.clear();
  s.balls.colliders.resize(s.balls.slots.size());
  for (std::size_t k = 0; k < s.colliders.size(); ++k) {
    const std::int32_t number = s.balls.number[index(s.colliders[k])];
    if (number >= 0) {
      s.balls.colliders[index(number)] = static_cast<std::int32_t>(k);
      continue;
    }
    others.colliders.push_back(static_cast<std::int32_t>(k));
    others.ids.push_back(s.collider_ids[k]);
  }
}

/// What the broad phase is told of them.
void look_at_others(World::State& s) {
  Ballistic::Others& others = s.balls.others;
  others.boxes.clear();
  others.moves.clear();
  for (const std::int32_t k : others.colliders) {
    others.boxes.push_back(s.boxes[index(k)]);
    others.moves.push_back(s.moves[index(k)]);
  }
  others.planes = s.planes;
  for (Plane& plane : others.planes) {
    const auto at = std::ranges::lower_bound(others.colliders, plane.slot);
    plane.slot = static_cast<std::int32_t>(at - others.colliders.begin());
  }
}

/// `s.pairs` are those of the others, by collider.
void find_pairs_of_others(World::State& s, Executor& executor) {
  look_at_others(s);
  const Ballistic::Others& others = s.balls.others;
  const bool may_be_others_now = s.balls.was_told_of_some = true;
  s.culling = s.broad_phase->find_pairs(
      {others.boxes, others.moves, others.planes, may_be_others_now, others.ids, &executor},
      s.pairs);
  for (BodyPair& pair : s.pairs) {
    pair = {others.colliders[index(pair.a)], others.colliders[index(pair.b)]};
  }
}

/// How far from its centre a ball's box reaches, m.
double reach_of_boxes(const World::State& s) {
  const Ballistic& balls = s.balls;
  const double deviation = std::max(kSpreads * balls.spread, balls.grid.speed_max());
  const Vector way = s.dt * balls.v_mean.cwiseAbs() + 0.5 * s.dt * s.dt * s.gravity_W.cwiseAbs();
  const double r = balls.grid.radius_max() + s.dt * deviation + s.margin_max;
  constexpr double kRounding = 1 + 1e-9;
  return kRounding * (r + way.maxCoeff());
}

/// Calls `visit(number)` for balls whose boxes overlap this one when the tick begins.
template <class F>
void for_each_ball_in(const World::State& s, const Aabb& box, double reach, const F& visit) {
  const Vector r = Vector::Constant(reach);
  const Aabb wider{box.lower - r, box.upper + r};
  s.balls.grid.for_each_in(wider, [&](std::int32_t number) {
    const Ball& ball = s.balls.scene.balls[index(number)];
    const bool is_near = wider.holds({ball.x, ball.x});
    if (is_near && overlap(box, box_of_ball(s, ball))) visit(number);
  });
}

template <class F>
void for_each_ball_in(const World::State& s, const Plane& plane, double reach, const F& visit) {
  const double most = plane.offset + 1.75 * reach;  // the root of three, at an edge
  for (std::size_t k = 0; k < s.balls.slots.size(); ++k) {
    const Ball& ball = s.balls.scene.balls[k];
    if (plane.normal_W.dot(ball.x) > most) continue;
    if (overlap(box_of_ball(s, ball), plane)) visit(static_cast<std::int32_t>(k));
  }
}

/// To whatever may be in their way.
void show_balls_beside(World::State& s) {
  for (const BodyPair& pair : s.pairs) {
    for (const std::int32_t k : {pair.a, pair.b}) {
      const std::size_t i = index(s.colliders[index(k)]);
      if (s.balls.could_fly(i)) show_ball(s, index(k), i);
    }
  }
}

}  // namespace

void part_balls(World::State& s, Executor& executor) {
  Ballistic& balls = s.balls;
  const std::size_t others = s.colliders.size() - balls.slots.size();
  balls.are_apart = others * kOthers <= balls.slots.size() &&
                    balls.grid.build(executor, balls.scene.balls, s.dt, balls.v_mean, s.gravity_W);
  if (!balls.are_apart) return;
  list_others(s);
  const double speed = balls.v_mean.norm() + balls.grid.speed_max();
  const double way = s.dt * speed + 0.5 * s.dt * s.dt * s.gravity_W.norm();
  balls.are_slow = 1.001 * way < balls.grid.radius_min();
}

void find_pairs_beside_balls(World::State& s, Executor& executor) {
  Ballistic& balls = s.balls;
  find_pairs_of_others(s, executor);
  const double reach = reach_of_boxes(s);
  const std::size_t most = pairs_max(s.colliders.size());
  const auto of_box = [&](std::int32_t k, std::vector<BodyPair>& found) {
    const Aabb& box = s.boxes[index(k)];
    if (!is_usable(box)) return;
    for_each_ball_in(s, box, reach, [&](std::int32_t ball) {
      found.push_back(in_order(k, balls.colliders[index(ball)]));
    });
  };
  const auto of_plane = [&](const Plane& plane, std::vector<BodyPair>& found) {
    for_each_ball_in(s, plane, reach, [&](std::int32_t ball) {
      found.push_back(in_order(plane.slot, balls.colliders[index(ball)]));
    });
  };
  const std::size_t boxes = balls.others.colliders.size();
  const auto find = [&](std::size_t begin, std::size_t end, std::vector<BodyPair>& found) {
    for (std::size_t k = begin; k < end && found.size() <= most; ++k) {
      if (k < boxes) {
        of_box(balls.others.colliders[k], found);
      } else {
        of_plane(s.planes[k - boxes], found);
      }
    }
    return 0;
  };
  balls.beside.find(executor, boxes + s.planes.size(), s.pairs, find);
  balls.are_apart = s.pairs.size() <= most && s.culling.crowded == 0;
  s.culling.method = "balls";
  balls.sorter.sort(s.colliders.size(), s.pairs);
  show_balls_beside(s);
  if (!balls.are_apart) put_balls_in_boxes(s);
}

void put_balls_in_boxes(World::State& s) {
  Ballistic& balls = s.balls;
  for (std::size_t k = 0; k < balls.slots.size(); ++k) {
    const Ball& ball = balls.scene.balls[k];
    const std::size_t collider = index(balls.colliders[k]);
    show_ball(s, collider, index(balls.slots[k]));
    const StruckBall* const struck = balls.struck(static_cast<std::int32_t>(k));
    s.boxes[collider] = struck != nullptr ? struck->known : box_of_ball(s, ball);
  }
}

void add_pairs_of_bound_balls(World::State& s) {
  Ballistic& balls = s.balls;
  const double reach = reach_of_boxes(s);
  const auto is_fast = [&](std::int32_t number) {
    return s.fast.is_fast[index(balls.slots[index(number)])] != 0;
  };
  for (std::size_t k = 0; k < balls.slots.size(); ++k) {
    if (balls.is_out[k] == 0) continue;
    const auto ball = static_cast<std::int32_t>(k);
    const auto pass = [&](std::int32_t other) {
      if (!is_fast(ball) && !is_fast(other)) return;
      balls.passed_by.push_back(in_order(balls.slots[k], balls.slots[index(other)]));
    };
    const Aabb box = box_of_ball(s, balls.scene.balls[k]);
    for_each_ball_in(s, box, reach, [&](std::int32_t other) {
      if (balls.is_out[index(other)] == 0) {
        if (balls.struck(other) == nullptr) pass(other);
      } else if (other > ball) {
        s.pairs.push_back({balls.slots[k], balls.slots[index(other)]});
      }
    });
    if (!s.fast.any) continue;
    balls.for_each_struck(balls.parts[0], [&](const StruckBall& other) {  // one, if some are out
      if (box.overlaps(other.known)) pass(other.number);
    });
  }
  s.balls.sorter.sort(s.bodies.size(), s.pairs);
}

}  // namespace cradle
