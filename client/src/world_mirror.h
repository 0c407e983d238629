/// What a client knows of the world's bodies, from chunks and events that may get lost, doubled or
/// late. No clock, no wire.
#pragma once

#include <cradle/client_values.h>

#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "protocol/messages.h"

namespace cradle {

class WorldMirror {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// What was counted; outlives clear().
  struct Counters {
    std::int64_t chunks_received = 0;
    std::int64_t chunks_lost = 0;
    std::int64_t chunks_stale = 0;
    std::int64_t events_received = 0;
    std::int64_t events_lost = 0;
    double tick_jitter_s = 0;
  };

  /// Takes a chunk of this epoch. False if its numbers contradict each other.
  bool take(const StateChunk& chunk, Time now);

  /// Takes a batch of events of this epoch; those that are new, in order.
  std::span<const Event> take(const Events& batch);

  /// The ticks that became complete, or were overtaken, since the last call, in ascending order.
  std::vector<Tick> take_finished_ticks() { return std::exchange(finished_ticks_, {}); }

  /// Forgets the world: another one took its place.
  void clear();

  std::span<const BodyView> bodies() const { return bodies_; }
  const BodyView* find(BodyId body) const;
  const Event* about(BodyId body) const;
  BodyId find_by_name(std::string_view name) const;

  Tick tick() const { return current_.tick; }
  std::int64_t tick_time_us() const { return tick_time_us_; }
  const Counters& counters() const { return counters_; }

 private:
  /// Which chunks of the newest tick have come.
  struct TickProgress {
    Tick tick = 0;
    std::vector<bool> has_come;  ///< by chunk; empty before the first tick
    std::int64_t missing = 0;
  };

  void begin_tick(const StateChunk& chunk, Time now);
  void merge(const StateChunk& chunk, Time now);
  void forget(BodyId body);
  void remember(const Event& event);

  std::vector<BodyView> bodies_;  ///< in ascending order of ids
  std::vector<BodyView> merged_;  ///< scratch
  std::unordered_map<std::int64_t, Event> about_;
  std::map<std::string, BodyId, std::less<>> by_name_;

  TickProgress current_;
  bool is_first_tick_ = true;  ///< we came in the middle of it: what is missing is not lost
  Time tick_came_at_{};
  std::int64_t tick_time_us_ = 0;
  std::vector<Tick> finished_ticks_;
  std::optional<std::int64_t> next_event_;
  Counters counters_;
};

}  // namespace cradle
