#include "server/world/ball_looks.h"

#include <algorithm>

#include "server/collision/fetch.h"
#include "server/collision/index.h"
#include "server/world/contact_material.h"

namespace cradle {

Aabb& box_of_collider(World::State& s, std::int32_t slot) {
  const auto at = std::ranges::lower_bound(s.colliders, slot);
  return s.boxes[static_cast<std::size_t>(at - s.colliders.begin())];
}

bool is_obstacle(const World::State& s, std::int32_t slot) {
  return s.bodies.kind[index(slot)] == BodyKind::fixed &&
         is_obstacle(s.bodies.shape[index(slot)].kind);
}

std::int32_t obstacle_of(World::State& s, std::int32_t slot) {
  std::int32_t& number = s.balls.obstacle[index(slot)];
  if (number >= 0) return number;
  number = static_cast<std::int32_t>(s.balls.obstacle_slots.size());
  s.balls.obstacle_slots.push_back(slot);
  Obstacle obstacle{s.bodies.shape[index(slot)], s.poses[index(slot)]};
  if (s.settings.is_planar && obstacle.shape.kind == ShapeKind::capsule) {
    const Matrix R = obstacle.X.R;  // along x there
    obstacle.X.R << R.col(1), R.col(2), R.col(0);
  }
  s.balls.scene.obstacles.push_back(obstacle);
  return number;
}

void BallLooks::look_around(StruckBall& ball, double now) {
  const std::int32_t number = ball.number;
  list_partners(number);
  if (balls_.are_apart) {
    balls_.grid.note(part_.deviations, number, ball.ball);
    balls_.grid.for_each_near(part_.deviations, number, ball.ball, now, [&](std::int32_t other) {
      const std::int32_t slot = balls_.slots[index(other)];
      if (!is_partner(slot) && part_.events.do_meet(number, other, now)) meet(number, slot);
    });
  }
  const Aabb way = way_of(ball, now);
  Aabb& known = balls_.are_apart ? ball.known : box_of_collider(s_, balls_.slots[index(number)]);
  if (known.holds(way)) return;
  known.lower = known.lower.cwiseMin(way.lower);
  known.upper = known.upper.cwiseMax(way.upper);
  for_each_collider_in(way, [&](std::int32_t slot) {
    if (!is_partner(slot)) meet(number, slot);
  });
}

void BallLooks::before_impacts(StruckBall& ball) {
  const std::size_t i = index(balls_.slots[index(ball.number)]);
  // Where it was expected to go is known from now on: it may have to look beyond.
  if (balls_.are_apart) ball.known = box_of_ball(s_, ball.ball);
  ball.w = s_.bodies.w[i];
  ball.inverse_mass = s_.bodies.inverse_mass[i];
  ball.inverse_inertia = s_.bodies.inverse_inertia[i].z();
}

void BallLooks::expect(std::int32_t number) const {
  const std::size_t i = index(balls_.slots[index(number)]);
  fetch(&s_.bodies.w[i]);
  fetch(&s_.bodies.inverse_mass[i]);
  fetch(&s_.bodies.inverse_inertia[i]);
  fetch(&s_.bodies.material[i]);
}

BallMaterial BallLooks::material_of(const BallPair& pair) {
  const std::int32_t a = balls_.slots[index(pair.a)];
  const std::int32_t b =
      pair.b < 0 ? balls_.obstacle_slots[index(~pair.b)] : balls_.slots[index(pair.b)];
  const ContactMaterial both = combined(s_.bodies.material[index(a)], s_.bodies.material[index(b)]);
  return {both.restitution, both.friction, both.rolling_m, both.torsional_m};
}

Aabb BallLooks::way_of(const StruckBall& ball, double from) const {
  const Vector x = part_.events.position(ball.number, from),
               end = part_.events.position(ball.number, s_.dt);
  const Vector r = Vector::Constant(ball.ball.radius);
  return {x.cwiseMin(end) - r, x.cwiseMax(end) + r};
}

/// By slot.
void BallLooks::list_partners(std::int32_t number) {
  part_.partners.clear();
  part_.partners.push_back(balls_.slots[index(number)]);
  part_.events.for_each_pair_of(number, [&](std::int32_t k) {
    const BallPair& pair = part_.events.pairs[index(k)];
    const std::int32_t other = pair.a == number ? pair.b : pair.a;
    part_.partners.push_back(other < 0 ? balls_.obstacle_slots[index(~other)]
                                       : balls_.slots[index(other)]);
  });
}

bool BallLooks::is_partner(std::int32_t slot) const {
  return std::ranges::find(part_.partners, slot) != part_.partners.end();
}

void BallLooks::meet(std::int32_t number, std::int32_t slot) {
  const std::int32_t other = balls_.number[index(slot)];
  if (other >= 0) {
    const auto [a, b] = std::minmax(number, other);
    part_.events.pairs.push_back({a, b});
  } else if (is_obstacle(s_, slot)) {
    part_.events.pairs.push_back({number, ~obstacle_of(s_, slot)});
  } else {
    part_.strangers.push_back({number, slot});
  }
}

/// Calls `visit(slot)`; of balls that are apart for none.
template <class F>
void BallLooks::for_each_collider_in(const Aabb& way, const F& visit) const {
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

}  // namespace cradle
