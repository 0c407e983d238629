/// What contacts remember from tick to tick: the forces that warm starting begins from.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/executor.h"
#include "server/dynamics/contact/contact_constraint.h"

namespace cradle {

/// One point's forces, by the ids of its bodies (a < b), and which of their parts and
/// features meet. A contact with rolling or torsional friction has one more: kTurningFeature, with
/// its torque (N m, in W) for friction. One that carries nothing, and rests nowhere, has a single
/// one for all its points, kIdleFeature: in a heap that falls these are half of all.
struct CachedForce {
  std::int64_t a = 0, b = 0;
  std::uint64_t part = 0;
  std::uint64_t feature = 0;
  double force = 0;                  ///< N
  double press = 0;                  ///< m/s^2, see ConstraintPoint
  double K_normal = 0;               ///< 1/kg, see ContactConstraint
  double rest_m = 0;                 ///< m, see PointRest
  double rest_load = 0;              ///< m/s^2, likewise
  Vector friction = Vector::Zero();  ///< N, in W: survives a turn of the tangents
  Vector arm = Vector::Zero();       ///< m, in W, from A's centre
};

/// Of no point: their features have 32 bits.
inline constexpr std::uint64_t kTurningFeature = ~std::uint64_t{0},
                               kIdleFeature = kTurningFeature - 1;

/// Sorted by (a, b).
class ContactCache {
  /// Entries that one thread wrote: they lie apart.
  struct Run {
    CachedForce *begin, *end;
  };
  /// Goes through runs as if they were one.
  class Cursor {
   public:
    explicit Cursor(std::span<const Run> runs) : runs_(runs) {
      if (!is_end()) enter();
    }
    bool is_end() const { return runs_.empty(); }
    const CachedForce& operator*() const { return *at_; }
    const CachedForce* operator->() const { return at_; }
    void operator++() {
      if (++at_ == runs_.front().end) next();
    }
    void go_to(const CachedForce* at) { at_ = at; }

   private:
    void next() {
      runs_ = runs_.subspan(1);
      if (!is_end()) enter();
    }
    void enter() { at_ = runs_.front().begin; }

    std::span<const Run> runs_;  // from that of `at_` on
    const CachedForce* at_ = nullptr;
  };

 public:
  /// Gives constraints, asked for in the order of (a, b), what their points carried last tick.
  class Reader {
   public:
    Reader(const ContactCache& cache, std::span<const std::int64_t> ids)
        : ids_(ids), entry_(cache.runs_) {}
    /// From the pair of slots (a, b) on.
    Reader(const ContactCache& cache, std::span<const std::int64_t> ids, std::int32_t a,
           std::int32_t b);
    /// Which four of eight points stand for a face may change from tick to tick: what points
    /// carried that have gone, those that are new carry on, all together with the same force and
    /// torque.
    void restore(ContactConstraint& c);

   private:
    void hand_on(ContactConstraint& c, Cursor of_pair);

    std::span<const std::int64_t> ids_;
    Cursor entry_;
  };

  /// Keeps what they carry now, and nothing else.
  void store(Executor& executor, std::span<const std::int64_t> ids,
             std::span<const ContactConstraint> constraints);

  /// Forgets the contacts of these bodies (ids ascending).
  void forget(std::span<const std::int64_t> ids);
  template <class F>
  void forget_if(F&& f) {
    const std::span<CachedForce> all = entries();
    keep_first(static_cast<std::size_t>(std::remove_if(all.begin(), all.end(), f) - all.begin()));
  }

  /// All, side by side.
  std::span<CachedForce> entries();
  /// Others instead, from elsewhere.
  void set(std::span<const CachedForce> entries);

 private:
  void keep_first(std::size_t count);

  std::vector<CachedForce> room_;  // for the entries of all constraints, and more
  std::vector<Run> runs_;          // of it, in use; none empty
};

}  // namespace cradle
