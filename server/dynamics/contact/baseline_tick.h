/// What the baselines lcp, impulse and penalty share: the bodies of a tick, its contacts as
/// equations, overlaps that are parted without a velocity, and the report.
#pragma once

#include <vector>

#include "server/dynamics/contact/contact_solver.h"
#include "server/dynamics/contact/contact_system.h"

namespace cradle {

/// Larger islands are solved by sweeps instead of pivots: at 32 points a tick takes 20 ms.
inline constexpr std::size_t kPivotPoints = 32;

struct BaselineTick {
  BodyLines bodies;
  ContactSystem system;
  ContactReport report;
  ContactTick tick;

  void begin(const ContactTick& of, const BodyArrays& arrays,
             std::span<const Matrix> inverse_inertia_W,
             std::span<ContactConstraint* const> constraints);

  /// Newton's law of impact, by velocities before impulses: un after is -e un. A point that does
  /// not close faster than loads make it within kRestTicks is at rest, and bounces off nothing.
  bool bounces(const ContactSystem::Point& point) const;
  void set_bounce(ContactSystem::Point& point) const;

  /// Moves bodies by the least way, by mass, after which no point overlaps. Each island is an LCP
  /// of its own: 0 <= y, Wnn y + s >= 0, y . (Wnn y + s) = 0; the way M^-1 Jn^T y minimises way . M
  /// way. Overwrites biases.
  void part_overlaps();

  /// Impulses of the points, to their constraints and back.
  static std::vector<Vector> forces_of(ContactSystem::Points points, double h);
  static void keep(ContactSystem::Points points, std::span<const Vector> impulses, double h);
  /// Once velocities are what they will be: how well it does; before positions change.
  void judge();
  void add_work(double h);
  /// Once a tick, however often it is told.
  void note_makeshift(std::size_t island);
  ContactReport end(int sub_steps);

 private:
  bool part(ContactSystem::Points points);

  std::span<ContactConstraint* const> constraints_;
  std::vector<BodyLine> ways_;              // of overlaps, by line
  std::vector<std::uint8_t> is_makeshift_;  // by island
};

}  // namespace cradle
