/// Groups of bodies that come to rest, and those that are at rest.
///
/// What lies on others sways about the place where forces balance: contacts are springs that no
/// damping slows down sideways. Sway of less than the contact tolerance is an error that the user
/// has allowed; it is ended at its peaks (kinetic damping). A group in which nothing moves and the
/// forces of the tick before balance all loads stays as it is: to see that takes one look at each
/// contact, no sub-step.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/dynamics/contact/contact_constraint.h"
#include "server/dynamics/contact/contact_solver.h"
#include "server/dynamics/contact/tick_islands.h"

namespace cradle {

/// The bodies of a tick by group.
struct Grouping {
  const TickIslands& islands;
  std::span<const std::int32_t> number;  ///< by slot: which of `tick.moving`, or -1
  /// s^2, by group: a contact without preload sinks in by so much of the acceleration that its load
  /// would give it.
  std::span<const double> give;
  /// By group: 1 for those that are looked at; empty: all are.
  std::span<const std::uint8_t> which = {};

  bool has(std::size_t island) const { return which.empty() || which[island] != 0; }
  std::size_t count() const { return islands.count(); }
  std::size_t of(std::size_t moving) const { return islands.of(static_cast<std::int32_t>(moving)); }
};

class Settling {
 public:
  /// Looks for groups at rest. Forces of `constraints` are those of the tick before.
  void find(const ContactTick& tick, const BodyArrays& bodies,
            std::span<const Matrix> inverse_inertia_W, const Grouping& groups,
            std::span<ContactConstraint* const> constraints);
  bool rests(std::size_t island) const { return rests_[island] != 0; }
  /// By the last call of damp.
  bool has_ended(std::size_t island) const { return ends_[island] != 0; }
  /// m/s: what loads that are not balanced to the last digit would make of the bodies at rest.
  double unbalanced_mps() const { return unbalanced_mps_; }

  /// After the tick's last sub-step: takes the velocities of groups whose sway is at its peak.
  /// `is_calm` by island: others are not looked at. What they lose goes into the balance, if that
  /// is asked for.
  void damp(const ContactTick& tick, const BodyArrays& bodies, const Grouping& groups,
            std::span<const std::uint8_t> is_calm, ContactBalance& balance);

 private:
  struct Load {
    Vector force, torque;  // N, N m, in W: what loads and contacts make together
  };
  void start_loads(const ContactTick& tick, const BodyArrays& bodies, const Grouping& groups);
  void add_contact(const ContactConstraint& c, const Grouping& groups);
  void weigh(const ContactTick& tick, const BodyArrays& bodies,
             std::span<const Matrix> inverse_inertia_W, const Grouping& groups);
  void measure(const ContactTick& tick, const BodyArrays& bodies, const Grouping& groups,
               std::span<const std::uint8_t> is_calm);

  std::vector<std::uint8_t> rests_;  // by island
  std::vector<Load> loads_;          // of `tick.moving`
  std::vector<Sway> sways_;          // by island, of this tick
  std::vector<std::uint8_t> ends_;   // by island: its sway, here
  double unbalanced_mps_ = 0;
};

}  // namespace cradle
