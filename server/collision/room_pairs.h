/// Pairs of bodies whose rooms overlap, and which of them do so themselves. Private to this folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/broad_phase.h"

namespace cradle {

class RoomPairs {
 public:
  std::size_t size() const { return pairs_.size(); }
  void clear();

  /// These from now on, in order; all have to be compared. Takes the vector, and gives another.
  void replace(std::vector<BodyPair>& sorted);

  /// Slots have changed: `now` has the new one of each, in the old order, negative for bodies that
  /// are no more; their pairs go.
  void renumber(std::span<const std::int32_t> now);

  /// The pairs of slots that are marked in `left` go; others, in order, come, and have to be
  /// compared.
  void exchange(std::span<const std::uint8_t> left, std::span<const BodyPair> sorted);

  /// Sets `pairs` to those whose boxes overlap. Only those are compared of which one slot is marked
  /// in `changed`. Returns how many.
  std::int64_t compare(const BroadPhaseInput& input, std::span<const std::uint8_t> changed,
                       std::vector<BodyPair>& pairs);

 private:
  struct Compared {
    int looked_at, overlapping;
  };
  Compared compare_some(const BroadPhaseInput& input, const std::uint8_t* changed,
                        std::size_t begin, std::size_t end, BodyPair* to);
  void insert(std::span<const BodyPair> sorted);

  std::vector<BodyPair> pairs_;         // sorted
  std::vector<std::uint8_t> overlaps_;  // one a pair: the true boxes do
  std::vector<Compared> compared_;      // by part of the pairs
};

}  // namespace cradle
