/// What soft steps know of bodies, contacts and islands before they choose sub-steps.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "server/dynamics/contact/contact_block.h"
#include "server/dynamics/contact/contact_constraint.h"
#include "server/dynamics/contact/demands.h"
#include "server/dynamics/contact/soft_batch.h"

namespace cradle {

/// An island is at rest, or nearly, while its bodies are no faster in the mean than so many ticks
/// of its acceleration make them: what sinks in at first is not faster (A8b of the benchmark).
inline constexpr double kRestTicks = 2;

/// Of an island's contacts that carry, one in so many may do so on some of its points only: of two
/// blocks in three one then does, and all that was done for points together was in vain (T2 of the
/// benchmark).
inline constexpr int kCarryPerAskew = kBlockLanes<double>;
/// But for so many of them: the points of a few bodies are solved together in any case.
inline constexpr int kFewAskew = 2 * kBlockLanes<double>;

/// Of each body by itself, when the tick begins.
struct BodyMotion {
  double way;           ///< m, in the tick: its part of the island's mean
  double acceleration;  ///< m/s^2
  bool is_slow;         ///< no faster than kRestTicks make it
  bool is_free;         ///< as Poise has it
};
/// `bodies`: in its island.
BodyMotion motion_of(std::size_t slot, const BodyArrays& arrays, double dt, int bodies);

/// Likewise of a constraint.
struct ContactLook {
  double press;         ///< m/s^2: of the constraint; or what it may be at first, 0 of a gap
  double tolerance_m;   ///< of the constraint
  double relative_way;  ///< m, in the tick: of its two bodies, beside each other
  bool was_pressed, is_met, is_known, is_deep, is_ahead;
  bool is_special;  ///< it is ahead, bounces, or has rested
  bool is_single;   ///< it has one point
  bool is_askew;    ///< it carries on some of its points only
  bool is_driven;   ///< by a kinematic body
};
ContactLook look_of(const ContactConstraint& c, const BodyArrays& arrays, double dt);

/// And of an island, what there is to know of its bodies and contacts, and what was chosen.
struct IslandFacts {
  int contacts = 0;
  int points = 0;                           ///< contacts of one point
  int excess = 0;                           ///< of deep contacts, three times, over others
  int askew = -kFewAskew * kCarryPerAskew;  ///< contacts that are, over the rest
  int special = 0;                          ///< contacts
  bool has_past = false;                    ///< it has been pressed before
  bool lies_askew = false;                  ///< a contact does
  bool is_driven = false, is_free = false;  ///< a body of it is
  bool is_slow = false, moves = false;      ///< its bodies, in the mean
  bool is_in_turmoil = false;               ///< demands.h
  bool in_floats = false;                   ///< likewise
  Past past = Past::none;
  double way = 0;           ///< m, in the tick, of its bodies in the mean
  double relative_way = 0;  ///< likewise, of its contacts; until all are added, their sum
  double acceleration = 0;  ///< m/s^2, the largest
  Demands demands{}, of_points{};
  int least = 0;  ///< sub-steps
  int stiff_as = 0, sub_steps = 0;
  double preload = 0;                 ///< the most there is
  std::size_t batch = 0, number = 0;  ///< of those that are stepped

  void add(const BodyMotion& motion) {
    way += motion.way;
    acceleration = std::max(acceleration, motion.acceleration);
    is_free |= motion.is_free;
  }
  /// Neighbours, in numbers first: one after the other they would wait for each other.
  void add(std::span<const ContactLook> looks) {
    int pressed = 0, known = 0, lying_askew = 0, driven = 0, deep = 0, single = 0;
    for (const ContactLook& look : looks) {
      pressed += look.was_pressed ? 1 : 0;
      known += look.is_known ? 1 : 0;
      lying_askew += look.is_askew ? 1 : 0;
      driven += look.is_driven ? 1 : 0;
      deep += look.is_deep ? 1 : 0;
      special += look.is_special ? 1 : 0;
      single += look.is_single ? 1 : 0;
      relative_way += look.relative_way;
    }
    const int all = static_cast<int>(looks.size());
    contacts += all;
    points += single;
    has_past |= pressed > 0;
    if (known > 0) past = Past::lasts;
    lies_askew |= lying_askew > 0;
    is_driven |= driven > 0;
    askew += kCarryPerAskew * lying_askew - pressed;
    excess += 4 * deep - all;
  }
  /// Its points are solved one after another.
  bool is_heap() const { return askew > 0; }
};

}  // namespace cradle
