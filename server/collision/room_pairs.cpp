// Nearly all pairs stay from call to call, so that what is done for each of them counts: they are
// moved in place, by whole runs where others come in between.
#include "server/collision/room_pairs.h"

#include <algorithm>

#include "server/collision/box_lanes.h"

namespace cradle {
namespace {

constexpr std::size_t kCompared = 2048;  // pairs at a time: worth a thread

std::size_t index(std::int32_t slot) { return static_cast<std::size_t>(slot); }

}  // namespace

void RoomPairs::clear() {
  pairs_.clear();
  overlaps_.clear();
}

void RoomPairs::replace(std::vector<BodyPair>& sorted) {
  pairs_.swap(sorted);
  overlaps_.assign(pairs_.size(), 0);
}

void RoomPairs::renumber(std::span<const std::int32_t> now) {
  std::size_t count = 0;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const BodyPair pair{now[index(pairs_[k].a)], now[index(pairs_[k].b)]};
    if (pair.a < 0 || pair.b < 0) continue;
    overlaps_[count] = overlaps_[k];
    pairs_[count++] = pair;
  }
  pairs_.resize(count);
  overlaps_.resize(count);
}

void RoomPairs::exchange(std::span<const std::uint8_t> left, std::span<const BodyPair> sorted) {
  const std::uint8_t* const has_left = left.data();
  BodyPair* const pairs = pairs_.data();
  std::uint8_t* const overlaps = overlaps_.data();
  std::size_t count = 0;
  for (std::size_t k = 0, size = pairs_.size(); k < size; ++k) {
    const BodyPair pair = pairs[k];
    pairs[count] = pair;
    overlaps[count] = overlaps[k];
    count += (has_left[index(pair.a)] | has_left[index(pair.b)]) == 0 ? 1 : 0;
  }
  pairs_.resize(count);
  overlaps_.resize(count);
  insert(sorted);
}

/// From the last to the first, each run to its place.
void RoomPairs::insert(std::span<const BodyPair> sorted) {
  auto end = static_cast<std::ptrdiff_t>(pairs_.size());
  pairs_.resize(pairs_.size() + sorted.size());
  overlaps_.resize(pairs_.size());
  const auto pairs = pairs_.begin();
  const auto overlaps = overlaps_.begin();
  for (auto left = static_cast<std::ptrdiff_t>(sorted.size()); left > 0; --left) {
    const BodyPair pair = sorted[static_cast<std::size_t>(left - 1)];
    const std::ptrdiff_t place = std::lower_bound(pairs, pairs + end, pair) - pairs;
    std::move_backward(pairs + place, pairs + end, pairs + end + left);
    std::move_backward(overlaps + place, overlaps + end, overlaps + end + left);
    pairs[place + left - 1] = pair;
    overlaps[place + left - 1] = 0;
    end = place;
  }
}

std::int64_t RoomPairs::compare(const BroadPhaseInput& input, std::span<const std::uint8_t> changed,
                                std::vector<BodyPair>& pairs) {
  pairs.resize(pairs_.size());
  compared_.resize(chunks_of(pairs_.size(), kCompared));
  for_chunks(*input.executor, pairs_.size(), kCompared,
             [&](std::size_t chunk, std::size_t begin, std::size_t end) {
               compared_[chunk] =
                   compare_some(input, changed.data(), begin, end, pairs.data() + begin);
             });
  std::int64_t looked_at = 0;
  auto to = pairs.begin();
  for (std::size_t chunk = 0; chunk < compared_.size(); ++chunk) {
    looked_at += compared_[chunk].looked_at;
    const auto from = pairs.begin() + static_cast<std::ptrdiff_t>(chunk * kCompared);
    to = std::move(from, from + compared_[chunk].overlapping, to);
  }
  pairs.erase(to, pairs.end());
  return looked_at;
}

/// Those of `begin` to `end` that overlap go to `to`.
RoomPairs::Compared RoomPairs::compare_some(const BroadPhaseInput& input,
                                            const std::uint8_t* changed, std::size_t begin,
                                            std::size_t end, BodyPair* to) {
  // By pointers that no byte that is written could be part of.
  const BodyPair* const pairs = pairs_.data();
  const Aabb* const boxes = input.boxes.data();
  std::uint8_t* const overlaps = overlaps_.data();
  Compared compared{0, 0};
  for (std::size_t k = begin; k < end; ++k) {
    const BodyPair pair = pairs[k];
    if ((changed[index(pair.a)] | changed[index(pair.b)]) != 0) {
      overlaps[k] = overlap(boxes[index(pair.a)], boxes[index(pair.b)]) ? 1 : 0;
      ++compared.looked_at;
    }
    to[compared.overlapping] = pair;
    compared.overlapping += overlaps[k];
  }
  return compared;
}

}  // namespace cradle
