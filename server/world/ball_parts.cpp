#include "server/world/ball_parts.h"

#include <algorithm>
#include <utility>

#include "server/collision/index.h"
#include "server/world/ball_looks.h"
#include "server/world/state.h"

namespace cradle {
namespace {

/// Planes of cells that a part sees beyond its core. In a gas of 10 000 balls (T1 of the benchmark)
/// two parts do not agree in 46 of 100 ticks with one, in 4 with two, in none of 250 with three.
constexpr std::int32_t kBeyond = 3;
/// Planes that are worth a part.
constexpr std::int32_t kPlanesLeast = 2 * kBeyond;
/// Expected impacts that are worth a part, of half a microsecond each.
constexpr std::ptrdiff_t kImpactsLeast = 64;

/// After parts did not agree, the next time that they are tried: where impacts travel far, they
/// will in the next tick, too.
constexpr int kTicksToNextTry = 16;

/// How many parts are worth it. One, if some balls take no part: those that meet them are told
/// apart by what all have met.
int parts_for(World::State& s, Executor& executor, bool any_is_out) {
  Ballistic& balls = s.balls;
  if (balls.ticks_to_next_try > 0 && --balls.ticks_to_next_try > 0) return 1;
  if (executor.threads() == 1 || !balls.are_apart || any_is_out) return 1;
  const auto expected =
      std::ranges::count_if(balls.pairs, [](const BallPair& pair) { return pair.time != kNever; });
  return static_cast<int>(std::min<std::ptrdiff_t>(
      {executor.threads(), balls.grid.planes() / kPlanesLeast, expected / kImpactsLeast}));
}

void begin(const Ballistic& balls, BallPart& part) {
  part.strangers.clear();
  part.events.begin(balls.scene);
  if (balls.are_apart) balls.grid.begin(part.deviations);
}

void run(World::State& s, BallPart& part) {
  BallLooks looks(s, part);
  part.events.run(s.balls.is_out, looks);
}

void run_in_one(World::State& s) {
  BallPart& all = s.balls.parts[0];
  all.core = all.known = {};
  begin(s.balls, all);
  std::swap(all.events.pairs, s.balls.pairs);
  run(s, all);
}

/// With the pairs that it knows.
void run_part(World::State& s, BallPart& part) {
  const Ballistic& balls = s.balls;
  begin(balls, part);
  for (const BallPair& pair : balls.pairs) {
    const bool is_known = balls.grid.is_in(part.known, pair.a) ||
                          (pair.b >= 0 && balls.grid.is_in(part.known, pair.b));
    if (is_known) part.events.pairs.push_back(pair);
  }
  run(s, part);
}

/// Of all that balls may meet, so that no part has to ask for one.
void number_obstacles(World::State& s) {
  for (const std::int32_t k : s.balls.others.colliders) {
    const std::int32_t slot = s.colliders[index(k)];
    if (is_obstacle(s, slot)) obstacle_of(s, slot);
  }
}

/// Balls alike by number, each with what cells beyond ask for.
void run_in(World::State& s, Executor& executor, std::size_t parts) {
  number_obstacles(s);
  const BallGrid& grid = s.balls.grid;
  for (std::size_t k = 0; k < parts; ++k) {
    const std::int32_t begin = k == 0 ? 0 : grid.plane_after(k, parts);
    const std::int32_t end = k + 1 == parts ? grid.planes() : grid.plane_after(k + 1, parts);
    BallPart& part = s.balls.parts[k];
    part.core = grid.slab(begin, end);
    part.known = grid.slab(begin - kBeyond, end + kBeyond);
  }
  for_each_index(executor, parts, 1, [&s](std::size_t k) { run_part(s, s.balls.parts[k]); });
}

bool is_same(const StruckBall& one, const StruckBall* other) {
  return other != nullptr && one.ball.impacts == other->ball.impacts &&
         one.ball.x == other->ball.x && one.ball.v == other->ball.v && one.w == other->w;
}

/// Of two parts that follow each other: of balls as near to where they meet as balls of one core
/// that may meet those of the other.
bool agree(const BallGrid& grid, const BallPart& one, const BallPart& next) {
  const std::int32_t apart =
      std::max(grid.planes_apart(one.deviations), grid.planes_apart(next.deviations));
  if (apart > kBeyond) return false;
  const BallGrid::Slab between = grid.around(one.core.end, apart);
  const auto is_between = [&](const StruckBall& ball) { return grid.is_in(between, ball.number); };
  const auto struck = one.events.struck();
  return std::ranges::count_if(struck, is_between) ==
             std::ranges::count_if(next.events.struck(), is_between) &&
         std::ranges::all_of(struck, [&](const StruckBall& ball) {
           return !is_between(ball) || is_same(ball, next.events.struck(ball.number));
         });
}

/// Nor if a ball has come to rest: in which order it met those around depends on what its part
/// knows.
bool all_agree(const Ballistic& balls, std::size_t parts) {
  for (std::size_t k = 0; k < parts; ++k) {
    if (balls.parts[k].events.any_rests()) return false;
    if (k + 1 < parts && !agree(balls.grid, balls.parts[k], balls.parts[k + 1])) return false;
  }
  return true;
}

/// What each part says of its core.
BallReport report_of(const Ballistic& balls) {
  BallReport all;
  for (const BallPart& part : std::span(balls.parts).first(balls.parts_used)) {
    const BallReport report =
        part.events.report([&](std::int32_t ball) { return balls.grid.is_in(part.core, ball); });
    all.impacts += report.impacts;
    all.ordered += report.ordered;
    all.spent += report.spent;
  }
  return all;
}

}  // namespace

void find_impacts(World::State& s, Executor& executor, bool any_is_out) {
  Ballistic& balls = s.balls;
  const auto parts = static_cast<std::size_t>(std::max(parts_for(s, executor, any_is_out), 1));
  if (balls.parts.size() < parts) balls.parts.resize(parts);
  balls.parts_used = parts;
  if (parts > 1) {
    run_in(s, executor, parts);
    if (!all_agree(balls, parts)) balls.ticks_to_next_try = kTicksToNextTry;
  }
  if (parts == 1 || balls.ticks_to_next_try > 0) {
    balls.parts_used = 1;
    run_in_one(s);
  }
  balls.report = report_of(balls);
}

const StruckBall* Ballistic::struck(std::int32_t ball) const {
  for (std::size_t k = 0; k < parts_used; ++k) {
    if (grid.is_in(parts[k].core, ball)) return parts[k].events.struck(ball);
  }
  return nullptr;
}

}  // namespace cradle
