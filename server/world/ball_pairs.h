/// Where nearly all that can collide are balls that only fall, they are looked for in a grid of
/// their own (dynamics/impact/ball_grid.h), and the broad phase is told of the others alone.
#pragma once

#include "server/world/world.h"

namespace cradle {

/// Whether this tick's balls are apart from the broad phase: sets `s.balls.are_apart`.
void part_balls(World::State& s, Executor& executor);
/// If they are apart: replaces `s.pairs` by all pairs of colliders, by number, but those of two
/// balls that could take part. Too many: they are apart no longer, and there is no use of
/// `s.pairs`.
void find_pairs_beside_balls(World::State& s, Executor& executor);
/// Gives the balls that are apart the boxes that they would have if they were not.
void put_balls_in_boxes(World::State& s);
/// Balls that are apart and take no part: adds the pairs that they are with each other; and, where
/// one of the two is fast, takes note of those with balls that fly past (`Ballistic::passed_by`).
void add_pairs_of_bound_balls(World::State& s);

}  // namespace cradle
