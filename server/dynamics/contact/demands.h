/// How many sub-steps an island takes, of what its contacts ask for.
///
/// A contact at rest sinks in until its spring carries its load: s = a / omega^2, with a the
/// acceleration that the load would give to the contact's effective mass, and omega = 2 pi c / h_c
/// (softness.h). For s <= tolerance it asks for  n = dt / (2 pi c) sqrt(a / tolerance)  sub-steps.
/// Two contacts in a thousand of an island are not asked, and one in eight may carry a part of its
/// load at once instead, so that the rest sinks in by the tolerance (`preload`):
/// s = (1 - preload) a / omega^2; of many single points, while they move, one in three. On terrain
/// with 3000 bodies the most loaded contacts ask for 24 to 32 where 8 to 12 do for the others.
/// A large heap in turmoil takes three in five of the sub-steps that its contacts are as stiff as:
/// omega, and what sinks in by it, is the same, and sweeps are fewer.
/// Contacts of a large heap that moves, or of many single points, are solved in single precision:
/// impulses are found to 1e-7 of themselves and of the velocities that they meet, and half as much
/// memory goes through the processor in each sweep.
/// Source: measured sag, within 1 % of the law for stacks and heavy bodies on light ones; the
/// numbers are rounded up to a few, so that lanes are filled.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "server/dynamics/contact/contact_solver.h"

namespace cradle {

inline constexpr std::array kSubSteps{4,  5,  6,  7,  8,  10, 12, 14, 16,
                                      20, 24, 28, 32, 40, 48, 56, 64};
static_assert(2 * kSubSteps.size() < kSubStepChoices);

/// By sub-steps that are asked for: the first of kSubSteps that has as many, if any has.
inline constexpr auto kFirstOfAtLeast = [] {
  std::array<std::uint8_t, kSubSteps.back() + 1> first{};
  for (std::size_t asked = 1; asked < first.size(); ++asked) {
    first[asked] = first[asked - 1];
    if (kSubSteps[first[asked]] < static_cast<int>(asked)) ++first[asked];
  }
  return first;
}();
inline std::uint8_t first_of_at_least(double asked) {
  const double most = kSubSteps.back();
  return kFirstOfAtLeast[static_cast<std::size_t>(std::ceil(std::min(most, asked)))];
}

/// How many contacts of an island ask for each of kSubSteps; and, in the last place, for none.
using Demands = std::array<int, kSubSteps.size() + 1>;
inline constexpr std::uint8_t kAsksForNone = kSubSteps.size();

struct Answer {
  int stiff_as;    ///< contacts are to be as stiff as those of so many sub-steps
  double preload;  ///< of a contact, at most
};

/// `of_points`: those of them that are the only point of their bodies, in an island that moves.
/// `least`: sub-steps that nobody is excused from.
Answer answer_to(const Demands& demands, const Demands& of_points, int least);

/// Contacts: a large heap has more, and what it does hangs on no single one of them.
inline constexpr int kLargeHeap = 500;
/// It is in turmoil while the bodies of a contact go farther beside each other in a tick, in the
/// mean, than the speed of so many ticks' fall takes them, 16 cm/s at 60 Hz. A wall that rocks is
/// not, by 2 cm/s at most; one that has fallen by 2 cm is by half of that for a second, and would
/// sway for half a minute after it ("a large wall that has fallen").
inline constexpr double kTurmoilTicks = 1;
/// What it takes then, rounded up.
int sub_steps_in_turmoil(int stiff_as);

}  // namespace cradle
