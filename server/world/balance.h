/// What became of energy and momentum in a tick, by what.
///
/// Of bodies in contact, by their sub-steps (dynamics/contact/contact_balance.h); of flying balls
/// that were struck, what impacts took; of bodies that fly otherwise, if told to. These are exact
/// by their closed forms, and so many at times that adding them up would cost more than moving
/// them. Bodies with springs, drag or torques that fly are left out: what these take is not known
/// apart from what they do to the motion; forces of drag and springs on a body in contact, constant
/// over the tick there, are among the loads. So are bodies in quarantine.
#pragma once

#include <vector>

#include "server/world/world.h"

namespace cradle {

/// Of one body.
struct Momentum {
  double kinetic_J = 0;
  Vector linear_Ns = Vector::Zero();
};

struct Balance {
  struct Flyer {
    std::int32_t slot;
    Vector x;
    Momentum momentum;
  };
  bool is_due = false;                           ///< in this tick
  StepBalance tick;                              ///< this tick's, or the last one's that had one
  Vector momentum_unaccounted = Vector::Zero();  ///< N s
  std::vector<Flyer> flyers;                     ///< as they were at the tick's start
};

Momentum momentum_of(const World::State& s, std::size_t i);
/// For the two below: nothing in a tick without a balance.
Momentum momentum_before(const World::State& s, std::size_t i);
/// Of a tick, or of a part of it: when the loads are known, before anything has moved; and after.
void begin_balance(World::State& s, bool is_first);
void end_balance(World::State& s);
/// A ball that was struck; `x` and `before` are as if it had not been, at the same time.
void add_ball(World::State& s, std::size_t i, const Vector& x, const Momentum& before);
/// A body whose motion something else has changed that no law accounts for; as above.
void add_unaccounted(World::State& s, std::size_t i, const Vector& x, const Momentum& before);

}  // namespace cradle
