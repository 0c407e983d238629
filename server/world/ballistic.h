/// Balls that only fall: they meet each other and what stands still at the exact times, without
/// contacts (dynamics/impact/ball_events.h).
///
/// A dynamic sphere takes part in a tick if gravity alone acts on it, it had no contact in the last
/// one, overlaps nothing and rests on nothing, and no other body than such balls and static
/// half-spaces, boxes, spheres and capsules is in its way. Whoever would meet one that takes no
/// part takes none, either. What balls meet by deviating from their ways, and do not know, touches
/// them in the next tick.
#pragma once

#include <vector>

#include "server/collision/broad_phase.h"
#include "server/collision/pair_rules.h"
#include "server/dynamics/impact/ball_events.h"
#include "server/dynamics/impact/ball_grid.h"
#include "server/world/world.h"

namespace cradle {

/// A ball is expected to have no more than this times the spread of velocities after impacts:
/// whoever has, looks for what else it may meet.
inline constexpr double kSpreads = 1.5;

/// A pair of a ball with what is no business of balls.
struct Stranger {
  std::int32_t ball, slot;
};

/// Where impacts are found by themselves: ball_parts.h.
struct BallPart {
  BallGrid::Slab core;   ///< whose balls' impacts these are
  BallGrid::Slab known;  ///< all that it looks at
  BallEvents events;
  BallGrid::Deviations deviations;
  std::vector<Stranger> strangers;     ///< of balls that have deviated
  std::vector<std::int32_t> partners;  ///< of a ball that looks around
};

/// Made anew in each tick, but for what stays while the same balls fly, in memory that is kept.
struct Ballistic {
  /// What the broad phase is told of, if not of all colliders.
  struct Others {
    std::vector<std::int32_t> colliders;  ///< places in `World::State::colliders`, ascending
    std::vector<std::int64_t> ids;
    std::vector<Aabb> boxes;
    std::vector<std::uint8_t> moves;
    std::vector<Plane> planes;
  };

  std::vector<std::int32_t> candidates;  ///< slots of spheres that are alike about all axes
  std::vector<std::uint8_t> is_sprung;   ///< by slot, if there are candidates
  std::vector<std::int32_t> number;  ///< by slot, of what could take part: place in `slots`; or -1
  std::vector<std::int32_t> slots;   ///< ascending
  std::vector<std::uint8_t> is_out;  ///< by number: takes no part
  std::vector<std::int32_t> obstacle;  ///< by slot: number of the obstacle; or -1
  Vector v_mean = Vector::Zero();      ///< m/s, of those in `slots`
  std::vector<std::uint8_t> agree;     ///< by part of the candidates: all could take part
  std::vector<Vector> sums;            ///< m/s: of velocities, by part of the balls
  std::vector<double> squares;         ///< m^2/s^2: of deviations from it, by part of the balls
  double spread = 0;                   ///< m/s, of their velocities about it, mean square
  std::vector<BodyPair> passed_by;     ///< pairs of fast deviated balls with what they do not know
  BallScene scene;                     ///< when the tick begins
  std::vector<std::int32_t> obstacle_slots;
  std::vector<BallPair> pairs;      ///< that may meet then, by their slots; until impacts are found
  std::vector<Stranger> strangers;  ///< likewise
  std::vector<std::uint8_t> is_bound;  ///< by pair: overlaps, or rests on an obstacle
  std::vector<BallPart> parts;
  std::size_t parts_used = 0;
  int ticks_to_next_try = 0;                ///< of parts; no result depends on it
  std::vector<const StruckBall*> in_order;  ///< of all parts
  BallReport report;

  // Where the balls are apart from the broad phase: ball_pairs.h.
  bool are_apart = false;
  bool are_slow = false;          ///< none of them can be fast in the sense of fast_bodies.h
  bool was_told_of_some = false;  ///< the broad phase, when last it was asked
  BallGrid grid;
  std::vector<std::int32_t> colliders;  ///< by number: place in `World::State::colliders`
  Others others;                        ///< that can collide
  std::vector<BodyPair> met;            ///< of balls that may meet, by number
  PairParts beside;                     ///< pairs of balls with others
  PairSorter sorter;

  bool could_fly(std::size_t slot) const { return !slots.empty() && number[slot] >= 0; }
  /// Of one that could, when the tick begins.
  const Ball& ball(std::size_t slot) const {
    return scene.balls[static_cast<std::size_t>(number[slot])];
  }
  /// By number, after impacts; null: it had none.
  const StruckBall* struck(std::int32_t ball) const;
  /// Calls `visit(ball)` for those that had impacts, of a part.
  template <class F>
  void for_each_struck(const BallPart& part, const F& visit) const {
    for (const StruckBall& ball : part.events.struck()) {
      if (grid.is_in(part.core, ball.number)) visit(ball);
    }
  }
  bool flies(std::size_t slot) const {
    return could_fly(slot) && is_out[static_cast<std::size_t>(number[slot])] == 0;
  }
};

/// The colliders are others now.
void list_balls(World::State& s);
/// Who could take part.
void begin_balls(World::State& s, Executor& executor);
/// Where one that could take part is when the tick begins, for others that may come near it; by its
/// place among the colliders and its slot. Not how it is turned: a ball's surface does not show.
void show_ball(World::State& s, std::size_t k, std::size_t i);
/// How it lies when the tick begins, and how far it has turned since that was asked last.
void take_pose_of_ball(World::State& s, std::size_t i);
/// Where it may get in this tick, struck or not; of one that could take part, as it is when the
/// tick begins.
Aabb box_of_ball(const World::State& s, const Ball& ball);
/// Puts balls at the tick's start so that free flight leads them to where they are at its end, and
/// takes their pairs out of `s.pairs`.
void bounce_balls(World::State& s, Executor& executor);

}  // namespace cradle
