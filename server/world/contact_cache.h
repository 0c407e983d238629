/// What contacts remember from tick to tick: the forces that warm starting begins from.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/collision/executor.h"
#include "server/dynamics/contact/contact_constraint.h"
#include "server/world/pair_name.h"

namespace cradle {

/// What one point carried, by which features of the parts meet. A contact with rolling or torsional
/// friction has one more: kTurningFeature, with its torque (N m, in W) for friction. One that
/// carries nothing, and rests nowhere, has a single one for all its points, kIdleFeature: in a heap
/// that falls these are half of all.
struct CarriedForce {
  std::uint64_t feature = 0;
  double force = 0;                  ///< N
  double press = 0;                  ///< m/s^2, see ConstraintPoint
  double K_normal = 0;               ///< 1/kg, see ContactConstraint
  PointRest rest;                    ///< likewise
  Vector friction = Vector::Zero();  ///< N, in W: survives a turn of the tangents
  Vector arm = Vector::Zero();       ///< m, in W, from A's centre
};

/// By the ids of its bodies (a < b), and which of their parts meet.
struct CachedForce {
  std::int64_t a = 0, b = 0;
  std::uint64_t part = 0;
  CarriedForce carried;
};

/// Of no point: their features have 32 bits.
inline constexpr std::uint64_t kTurningFeature = ~std::uint64_t{0},
                               kIdleFeature = kTurningFeature - 1;

/// What contacts remembered when their constraint was made.
class ContactMemory {
 public:
  /// Gives `c` what its points carried last tick. Which four of eight points stand for a face may
  /// change from tick to tick: what points carried that have gone, those that are new carry on, all
  /// together with the same force and torque.
  void restore(ContactConstraint& c) const;

  void clear() { count_ = 0; }
  CarriedForce& add() {
    assert(count_ < forces_.size());
    return forces_[count_++];
  }
  std::span<const CarriedForce> forces() const { return {forces_.data(), count_}; }

 private:
  void hand_on(ContactConstraint& c) const;

  std::array<CarriedForce, kManifoldPoints + 1> forces_;
  std::size_t count_ = 0;
};

/// A contact by its bodies, and which of their parts meet.
struct ContactName {
  PairName pair;
  std::uint64_t part = 0;
};

/// The constraints of contacts. They stay at their place while their contact lasts, and are what it
/// remembers; where in memory that is changes nothing else.
class ContactCache {
 public:
  /// Takes over the contacts of this tick, `name(k)` by the order of pairs.
  template <class Name>
  void follow(Executor& executor, std::size_t count, const Name& name) {
    std::swap(names_, last_);
    names_.resize(count);
    begin();
    for_chunks(executor, count, kChunk, [&](std::size_t, std::size_t first, std::size_t end) {
      for (std::size_t k = first; k < end; ++k) names_[k] = name(k);
      find(first, end);
    });
    settle();
  }

  /// Until it is set, of last tick.
  ContactConstraint& operator[](std::size_t k) {
    return room_[static_cast<std::size_t>(places_[k])];
  }
  /// Whether the k-th was there last tick, and is still what it remembers.
  bool lasts(std::size_t k) const { return from_[k] >= 0 && !were_entries_; }
  /// What the k-th carried last tick, before it is set.
  void recall(std::size_t k, ContactMemory& memory) const;
  /// Fetches it.
  void expect(std::size_t k) const;

  /// Forgets the contacts of these bodies (ids ascending).
  void forget(std::span<const std::int64_t> ids);
  template <class F>
  void forget_if(F&& f) {
    entries();
    std::erase_if(entries_, f);
  }

  /// All, sorted by (a, b). What was read from the constraints before is read from these then.
  std::span<CachedForce> entries();
  /// Others instead, from elsewhere.
  void set(std::span<const CachedForce> entries);

 private:
  static constexpr std::size_t kChunk = 512;  // contacts that one thread takes at a time

  void begin();
  void find(std::size_t begin, std::size_t end);
  void settle();

  std::vector<ContactConstraint> room_;
  std::vector<std::int32_t> free_;  // places in it, the next to be taken last
  std::vector<ContactName> names_, last_;
  std::vector<std::int32_t> places_, last_places_;  // of these
  std::vector<std::int32_t> from_;                  // of `names_` in `last_`; -1: it is new
  std::vector<std::uint8_t> is_new_, is_gone_;      // of `names_`; of `last_`
  std::vector<CachedForce> entries_;
  bool are_entries_ = false;   // what contacts carry now is in `entries_`
  bool were_entries_ = false;  // likewise, last tick
};

}  // namespace cradle
