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
inline constexpr int kCarryPerAskew = kBlockLanes;
/// But for so many of them: the points of a few bodies are solved together in any case.
inline constexpr int kFewAskew = 2 * kBlockLanes;

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
  double press;        ///< m/s^2: of the constraint, or what it may be at first
  double tolerance_m;  ///< of the constraint
  bool was_pressed, is_met, is_known, is_deep, has_rested, is_ahead;
  bool is_single;  ///< it has one point
  bool is_askew;   ///< it carries on some of its points only
  bool is_driven;  ///< by a kinematic body
};
/// `number`: by slot, -1: does not yield.
ContactLook look_of(const ContactConstraint& c, const BodyArrays& arrays,
                    std::span<const std::int32_t> number, double dt);

/// And of an island, what there is to know of its bodies and contacts, and what was chosen.
struct IslandFacts {
  int contacts = 0;
  int excess = 0;                           ///< of deep contacts over others
  int askew = -kFewAskew * kCarryPerAskew;  ///< contacts that are, over the rest
  bool has_past = false;                    ///< it has been pressed before
  bool lies_askew = false;                  ///< a contact does
  bool is_driven = false, is_free = false;  ///< a body of it is
  bool is_slow = false, moves = false;      ///< its bodies, in the mean
  Past past = Past::none;
  double way = 0;           ///< m, in the tick, in the mean
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
  void add(const ContactLook& look) {
    ++contacts;
    has_past |= look.was_pressed;
    if (look.is_known) past = Past::lasts;
    lies_askew |= look.is_askew;
    is_driven |= look.is_driven;
    askew += (look.is_askew ? kCarryPerAskew : 0) - (look.was_pressed ? 1 : 0);
    excess += look.is_deep ? 3 : -1;
  }
};

}  // namespace cradle
