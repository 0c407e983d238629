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
  std::size_t size() const { return pairs_.size() - gone_; }
  void clear();

  /// These from now on, in order; all have to be compared. Takes the vector, and gives another.
  void replace(std::vector<BodyPair>& sorted);

  /// Slots have changed: `now` has the new one of each, in the old order, negative for bodies that
  /// are no more; their pairs go.
  void renumber(std::span<const std::int32_t> now);

  /// Others, in order, come, and have to be compared.
  void insert(std::span<const BodyPair> sorted);

  /// Sets `pairs` to those whose boxes overlap. Only those are compared of which one slot is marked
  /// in `changed`; of those that were here before `insert`, the pairs of slots that are marked in
  /// `left`, too, go. Returns how many it compared.
  std::int64_t compare(const BroadPhaseInput& input, std::span<const std::uint8_t> changed,
                       std::span<const std::uint8_t> left, std::vector<BodyPair>& pairs);

 private:
  enum class State : std::uint8_t { apart, overlapping, fresh, gone };
  struct Marks {
    const std::uint8_t *changed, *left;
  };
  struct Compared {
    int looked_at = 0, overlapping = 0, gone = 0;
  };
  Compared compare_some(const BroadPhaseInput& input, const Marks& marks, std::size_t begin,
                        std::size_t end, BodyPair* to);
  void sweep();

  std::vector<BodyPair> pairs_;     // sorted
  std::vector<State> states_;       // of each
  std::size_t gone_ = 0;            // how many are
  std::vector<Compared> compared_;  // by the first of a range's parts
};

}  // namespace cradle
