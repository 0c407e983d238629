/// What contacts remember from tick to tick: the impulses that warm starting begins from.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/dynamics/contact_constraint.h"

namespace cradle {

/// One point's impulses, by the ids of its bodies (a < b), and which of their parts and
/// features meet.
struct CachedImpulse {
  std::int64_t a = 0, b = 0;
  std::uint64_t part = 0;
  std::uint64_t feature = 0;
  double lambda = 0;                 ///< N s, of a sub-step
  Vector friction = Vector::Zero();  ///< N s, in W: survives a turn of the tangents
};

/// Sorted by (a, b).
class ContactCache {
 public:
  /// Gives the constraints, sorted by (a, b), what their points carried last tick.
  void restore(std::span<const std::int64_t> ids, std::span<ContactConstraint> constraints) const;

  /// Keeps what they carry now, and nothing else.
  void store(std::span<const std::int64_t> ids, std::span<const ContactConstraint> constraints);

  /// Forgets the contacts of these bodies (ids ascending).
  void forget(std::span<const std::int64_t> ids);

  std::vector<CachedImpulse>& entries() { return entries_; }

 private:
  std::vector<CachedImpulse> entries_;
};

}  // namespace cradle
