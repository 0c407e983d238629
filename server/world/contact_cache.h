/// What contacts remember from tick to tick: the forces that warm starting begins from.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/executor.h"
#include "server/dynamics/contact/contact_constraint.h"

namespace cradle {

/// One point's forces, by the ids of its bodies (a < b), and which of their parts and
/// features meet. A contact with rolling or torsional friction has one more: kTurningFeature, with
/// its torque (N m, in W) for friction.
struct CachedForce {
  std::int64_t a = 0, b = 0;
  std::uint64_t part = 0;
  std::uint64_t feature = 0;
  double force = 0;                  ///< N
  double press = 0;                  ///< m/s^2, see ConstraintPoint
  double K_normal = 0;               ///< 1/kg, likewise
  double rest_m = 0;                 ///< m, likewise
  double rest_load = 0;              ///< m/s^2, likewise
  Vector friction = Vector::Zero();  ///< N, in W: survives a turn of the tangents
  Vector arm = Vector::Zero();       ///< m, in W, from A's centre
};

/// Of no point: their features have 32 bits.
inline constexpr std::uint64_t kTurningFeature = ~std::uint64_t{0};

/// Sorted by (a, b).
class ContactCache {
 public:
  /// Gives constraints, asked for in the order of (a, b), what their points carried last tick.
  class Reader {
   public:
    Reader(const ContactCache& cache, std::span<const std::int64_t> ids)
        : ids_(ids), entry_(cache.entries_.begin()), end_(cache.entries_.end()) {}
    /// From the pair of slots (a, b) on.
    Reader(const ContactCache& cache, std::span<const std::int64_t> ids, std::int32_t a,
           std::int32_t b);
    /// Which four of eight points stand for a face may change from tick to tick: what points
    /// carried that have gone, those that are new carry on, all together with the same force and
    /// torque.
    void restore(ContactConstraint& c);

   private:
    void hand_on(ContactConstraint& c, std::vector<CachedForce>::const_iterator of_pair);

    std::span<const std::int64_t> ids_;
    std::vector<CachedForce>::const_iterator entry_, end_;
  };

  /// Keeps what they carry now, and nothing else.
  void store(Executor& executor, std::span<const std::int64_t> ids,
             std::span<const ContactConstraint> constraints);

  /// Forgets the contacts of these bodies (ids ascending).
  void forget(std::span<const std::int64_t> ids);

  std::vector<CachedForce>& entries() { return entries_; }

 private:
  std::vector<CachedForce> entries_;
  std::vector<std::size_t> begins_;  // of parts of the constraints, among the entries
};

}  // namespace cradle
