#include "server/world/find_pairs.h"

#include <algorithm>
#include <utility>

#include "server/collision/index.h"
#include "server/collision/kept_manifold.h"
#include "server/collision/surface.h"
#include "server/world/ball_pairs.h"
#include "server/world/fast_bodies.h"
#include "server/world/flight.h"
#include "server/world/sleeping.h"
#include "server/world/state.h"

namespace cradle {
namespace {

constexpr int kColliders = 32;  // worth a thread

/// Who can collide, and room for what they need. Others cost nothing from here on.
void list_colliders(World::State& s) {
  s.colliders.clear();
  s.collider_ids.clear();
  s.half_spaces.clear();
  s.has_composites = false;
  s.surfaces = 0;
  s.has_parts.assign(s.bodies.size(), 0);
  s.reaches.resize(s.bodies.size());
  for (std::size_t i = 0; i < s.bodies.size(); ++i) {
    const ShapeKind kind = s.bodies.shape[i].kind;
    if (kind != ShapeKind::none && s.can_collide(kind)) {
      s.reaches[i] = s.reach(i);
      s.has_parts[i] = is_composite(kind) ? 1 : 0;
      s.has_composites |= is_composite(kind);
      s.surfaces += is_surface(kind) ? 1 : 0;
      if (kind == ShapeKind::half_space) {
        s.half_spaces.push_back(static_cast<std::int32_t>(s.colliders.size()));
      }
      s.colliders.push_back(static_cast<std::int32_t>(i));
      s.collider_ids.push_back(s.bodies.id[i]);
    }
  }
  s.boxes.resize(s.colliders.size());
  s.reach_of_tick.resize(s.colliders.size());
  s.moves.resize(s.colliders.size());
  const std::size_t slots = s.colliders.empty() ? 0 : s.bodies.size();
  s.poses.resize(slots);
  s.turned.resize(slots);
  s.turns.assign(slots, 0);
  s.margins.resize(slots);
  s.inverse_inertia_W.resize(slots);
  forget_slots_of_sleepers(s);
}

/// How far ahead contacts are made: as before, unless bodies or gravity are new.
void set_margins(World::State& s) {
  const double at_rest = kSpeculativeMargin_m + s.dt * s.dt * s.gravity_W.norm();
  if (!s.renumbered && at_rest == s.margin_at_rest) return;
  s.margin_at_rest = at_rest;
  s.margin_max = std::max(at_rest, kMarginOfThin_m);
  for (const std::int32_t slot : s.colliders) {
    const bool is_thin = s.fast.limits[index(slot)].thickness < kMarginOfThin_m;
    s.margins[index(slot)] = is_thin ? s.margin_max : at_rest;
  }
}

/// Of one that could take part in the impacts of this tick.
void put_ball_in_box(World::State& s, std::size_t k, std::size_t i) {
  show_ball(s, k, i);
  take_pose_of_ball(s, i);
  if (!s.balls.are_slow) note_if_fast(s, i);
  if (!s.balls.are_apart) s.boxes[k] = box_of_ball(s, s.balls.ball(i));
}

/// Of a collider, by its number.
void put_in_box(World::State& s, std::size_t k) {
  const std::size_t i = index(s.colliders[k]);
  if (s.balls.could_fly(i)) return put_ball_in_box(s, k, i);
  s.moves[k] = moves_for_pairs(s, i) ? 1 : 0;
  if (s.bodies.is_asleep(i) && s.sleepers.is_box_known[i] != 0) return;
  s.sleepers.is_box_known[i] = s.bodies.is_asleep(i) ? 1 : 0;
  s.reach_of_tick[k] = {};
  const BodyFrame B = s.bodies.frame(i);
  const Pose now{B.p_WBo, B.q_WB.toRotationMatrix()};
  s.turned[i] += way_of_turning(s.poses[i].R, now.R, s.reaches[i]);
  s.poses[i] = now;
  s.turns[i] = nearer_by_turning(s, i);
  s.boxes[k] = {};
  if (s.bodies.quarantined[i] != 0 || s.bodies.shape[i].kind == ShapeKind::half_space) return;
  s.boxes[k] = box_over_tick(s, i);
  if (s.fast.is_fast[i] != 0) return;
  s.reach_of_tick[k] = {now.x, s.reaches[i] + s.margins[i] + s.dt * s.bodies.v[i].norm()};
}

/// All but slow balls among themselves: nobody asks how these are turned, or for their boxes.
void put_in_boxes(World::State& s, Executor& executor) {
  if (!s.balls.are_apart || !s.balls.are_slow) {
    for_each_index(executor, s.colliders.size(), kColliders,
                   [&s](std::size_t k) { put_in_box(s, k); });
    return;
  }
  const std::span<const std::int32_t> others = s.balls.others.colliders;
  for_each_index(executor, others.size(), kColliders,
                 [&](std::size_t k) { put_in_box(s, index(others[k])); });
}

/// Of colliders, by number.
void find_all_pairs(World::State& s, Executor& executor) {
  const bool renumbered = s.renumbered || std::exchange(s.balls.was_told_of_some, false);
  s.culling = s.broad_phase->find_pairs(
      {s.boxes, s.moves, s.planes, renumbered, s.collider_ids, &executor}, s.pairs);
}

/// By slot from here on. Pairs of boxes that meet by their corners alone are none.
void keep_near_pairs(World::State& s, Executor& executor) {
  std::swap(s.pairs, s.pairs_of_boxes);
  s.are_near.resize(s.pairs_of_boxes.size());
  const auto number = [&s](std::size_t begin, std::size_t end) {
    std::size_t near = 0;
    for (std::size_t n = begin; n < end; ++n) {
      const auto [k, m] = s.pairs_of_boxes[n];
      const bool is_near = !s.reach_of_tick[index(k)].is_apart(s.reach_of_tick[index(m)]);
      s.are_near[n] = is_near ? 1 : 0;
      near += s.are_near[n];
    }
    return near;
  };
  const auto write = [&s](std::size_t begin, std::size_t end, std::size_t to) {
    for_marked(s.are_near, begin, end, [&](std::size_t n) {
      const auto [k, m] = s.pairs_of_boxes[n];
      s.pairs[to++] = {s.colliders[index(k)], s.colliders[index(m)]};
    });
  };
  s.in_order.list(
      executor, s.pairs_of_boxes.size(), number, [&s](std::size_t near) { s.pairs.resize(near); },
      write);
}

}  // namespace

void find_pairs(World::State& s, Executor& executor) {
  if (s.renumbered) {
    list_colliders(s);
    list_dragged(s);
    measure_fast_limits(s);
    list_balls(s);
  }
  set_margins(s);
  begin_fast_bodies(s);
  begin_balls(s, executor);
  s.planes.clear();
  put_in_boxes(s, executor);
  for (const std::int32_t slot : s.colliders) {
    if (s.fast.is_fast[index(slot)] != 0) list_fast(s, index(slot));
  }
  for (const std::int32_t k : s.half_spaces) {
    const std::size_t i = index(s.colliders[index(k)]);
    if (s.bodies.quarantined[i] != 0) continue;
    const Vector normal = s.poses[i].R.col(2);
    s.planes.push_back({k, normal, normal.dot(s.poses[i].x)});
  }
  if (s.balls.are_apart) find_pairs_beside_balls(s, executor);
  if (!s.balls.are_apart) find_all_pairs(s, executor);
  keep_near_pairs(s, executor);
  s.renumbered = false;
}

}  // namespace cradle
