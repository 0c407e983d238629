// Nearly all pairs stay from call to call, so that what is done for each of them counts: those that
// go keep their place until they are many, and those that come move the others by whole runs.
#include "server/collision/room_pairs.h"

#include <algorithm>

#include "server/collision/box_lanes.h"
#include "server/collision/index.h"

namespace cradle {
namespace {

constexpr std::size_t kCompared = 2048;  // pairs at a time: worth a thread
constexpr std::size_t kGone = 16;        // one pair in ... may be gone

}  // namespace

void RoomPairs::clear() {
  pairs_.clear();
  states_.clear();
  gone_ = 0;
}

void RoomPairs::replace(std::vector<BodyPair>& sorted) {
  pairs_.swap(sorted);
  states_.assign(pairs_.size(), State::fresh);
  gone_ = 0;
}

void RoomPairs::renumber(std::span<const std::int32_t> now) {
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    pairs_[k] = {now[index(pairs_[k].a)], now[index(pairs_[k].b)]};
    if (pairs_[k].a < 0 || pairs_[k].b < 0) states_[k] = State::gone;
  }
  sweep();
}

void RoomPairs::sweep() {
  std::size_t count = 0;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    pairs_[count] = pairs_[k];
    states_[count] = states_[k];
    count += states_[k] != State::gone ? 1 : 0;
  }
  pairs_.resize(count);
  states_.resize(count);
  gone_ = 0;
}

/// From the last to the first, each run to its place.
void RoomPairs::insert(std::span<const BodyPair> sorted) {
  if (gone_ * kGone > pairs_.size()) sweep();
  auto end = static_cast<std::ptrdiff_t>(pairs_.size());
  pairs_.resize(pairs_.size() + sorted.size());
  states_.resize(pairs_.size());
  const auto pairs = pairs_.begin();
  const auto states = states_.begin();
  for (auto left = static_cast<std::ptrdiff_t>(sorted.size()); left > 0; --left) {
    const BodyPair pair = sorted[static_cast<std::size_t>(left - 1)];
    const std::ptrdiff_t place = std::lower_bound(pairs, pairs + end, pair) - pairs;
    std::move_backward(pairs + place, pairs + end, pairs + end + left);
    std::move_backward(states + place, states + end, states + end + left);
    pairs[place + left - 1] = pair;
    states[place + left - 1] = State::fresh;
    end = place;
  }
}

std::int64_t RoomPairs::compare(const BroadPhaseInput& input, std::span<const std::uint8_t> changed,
                                std::span<const std::uint8_t> left, std::vector<BodyPair>& pairs) {
  pairs.resize(pairs_.size());
  compared_.assign(chunks_of(pairs_.size(), kCompared), {});
  const auto chunks = static_cast<int>(compared_.size());
  input.executor->for_ranges(chunks, 1, [&](int first, int last) {
    const std::size_t begin = index(first) * kCompared;
    const std::size_t end = std::min(index(last) * kCompared, pairs_.size());
    compared_[index(first)] =
        compare_some(input, {changed.data(), left.data()}, begin, end, pairs.data() + begin);
  });
  std::int64_t looked_at = 0;
  auto to = pairs.begin();
  for (std::size_t chunk = 0; chunk < compared_.size(); ++chunk) {
    looked_at += compared_[chunk].looked_at;
    gone_ += index(compared_[chunk].gone);
    const auto from = pairs.begin() + static_cast<std::ptrdiff_t>(chunk * kCompared);
    if (from != to) std::move(from, from + compared_[chunk].overlapping, to);
    to += compared_[chunk].overlapping;
  }
  pairs.erase(to, pairs.end());
  return looked_at;
}

/// Those of `begin` to `end` that overlap go to `to`.
RoomPairs::Compared RoomPairs::compare_some(const BroadPhaseInput& input, const Marks& marks,
                                            std::size_t begin, std::size_t end, BodyPair* to) {
  // By pointers that no byte that is written could be part of.
  const BodyPair* const pairs = pairs_.data();
  const Aabb* const boxes = input.boxes.data();
  State* const states = states_.data();
  const auto [changed, left] = marks;
  Compared compared;
  for (std::size_t k = begin; k < end; ++k) {
    const BodyPair pair = pairs[k];
    const std::size_t a = index(pair.a), b = index(pair.b);
    if ((changed[a] | changed[b]) != 0 && states[k] != State::gone) {
      if (states[k] != State::fresh && (left[a] | left[b]) != 0) {
        states[k] = State::gone;
        ++compared.gone;
      } else {
        states[k] = overlap(boxes[a], boxes[b]) ? State::overlapping : State::apart;
        ++compared.looked_at;
      }
    }
    to[compared.overlapping] = pair;
    compared.overlapping += states[k] == State::overlapping ? 1 : 0;
  }
  return compared;
}

}  // namespace cradle
