/// Islands of bodies at rest, which cost next to nothing until something happens to them.
///
/// An island is what carries each other: bodies whose contacts press, or would in a tick. It falls
/// asleep at the end of a tick when all its bodies have been still for SleepTolerances::window_s:
/// none went farther from where it was than the slightest acceleration would take it, so that what
/// merely starts slowly, or turns back, stays awake. None may have wrenches or springs, drag that
/// would hide an acceleration, or lie on a kinematic body that moves. What carries nothing and is
/// not carried never sleeps.
///
/// Asleep, velocities are zero and poses stay as they are to the bit; there are no pairs of
/// sleepers with each other and with what stands. What their contacts carried is put by, and their
/// manifolds, so that they wake as if no time had passed. They wake by islands: by a command to one
/// of its bodies or to what it touches, by another gravity, and in the tick in which something that
/// moves comes to touch one of them, before contacts are made. What passes close by wakes nobody,
/// and has no contact with them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/dynamics/contact/islands.h"
#include "server/world/contact_cache.h"
#include "server/world/world.h"

namespace cradle {

struct SleepTolerances {
  /// s, for which bodies are still: longer than a body thrown or rolling needs to turn back ("what
  /// begins slowly or turns back stays awake").
  double window_s = 0.5;
  /// Ticks, if these are more: contacts take a few to carry ("at ten ticks a second").
  int window_ticks = 8;
  /// Of gravity: what starts from rest with more than this, goes farther in the window than what is
  /// still may. 0.12 mm at 9.81 m/s^2 ("a box just above the friction angle").
  double acceleration = 1e-4;
  /// Of the speed that gravity gives in a tick: contacts at rest take it back in each, and what
  /// they leave is far less ("a tumbler that rocks").
  double noise = 0.1;
};
inline constexpr SleepTolerances kSleep;

/// A contact of sleepers.
struct SleepingContact {
  std::int64_t island = 0;
  CachedForce force;
};
static_assert(sizeof(SleepingContact) == 8 + sizeof(CachedForce));

/// What is put by for sleepers. Each has a contact at least: none, and nobody sleeps.
struct Sleepers {
  std::vector<SleepingContact>
      contacts;  ///< by islands, in no order of these; then as in the cache
  // Made from the above, and from poses:
  std::vector<std::uint8_t> is_box_known;  ///< by slot
  bool are_slots_known = false;
  std::vector<std::int32_t> slots;  ///< of sleepers and what they touch
  // To find who falls asleep, made anew in each tick, in memory that is kept:
  Islands islands;  ///< of what carries
  std::vector<ColouredPair> carrying;
  std::vector<std::int32_t> number;  ///< by slot: among the moving bodies, or -1
  std::vector<std::int64_t> names;   ///< by island: id of its first body, or that it stays awake
  std::vector<std::uint8_t> is_bound;
  bool any() const { return !contacts.empty(); }
};

/// Bodies that the broad phase is to find pairs for: for the sake of sleepers also what is not
/// dynamic, but moves by its velocities or was told to.
bool moves_for_pairs(const World::State& s, std::size_t i);

/// Wakes the islands that something touches in this tick: true if there are any, and pairs must be
/// found again. Else pairs of sleepers are taken out of `s.pairs`.
bool wake_struck(World::State& s);

/// At the end of a tick: who has been still for how long, and islands that fall asleep.
void let_sleep(World::State& s);

/// For commands, before they change anything: wakes the islands of these bodies, and of what rests
/// on those of them that are not dynamic. Ids ascending.
void wake_for_command(World::State& s, std::span<const std::int64_t> ids);
void wake_all(World::State& s);

/// The slots of bodies, or their shapes, are others now.
void forget_slots_of_sleepers(World::State& s);
/// They, and what they touch.
void mark_sleepers_in_contact(World::State& s);
std::int64_t count_sleepers(const World::State& s);

}  // namespace cradle
