#include "client/src/world_mirror.h"

#include <cradle/limits.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace cradle {
namespace {

constexpr double kJitterWeight = 1.0 / 16;  // RFC 3550, section 6.4.1
constexpr double kPause_s = 1;              // a longer gap is a pause of the world, not jitter

struct ById {
  bool operator()(const BodyView& view, BodyId id) const { return view.state.body < id; }
  bool operator()(BodyId id, const BodyView& view) const { return id < view.state.body; }
};

/// What the codec leaves open: the range, and a number of chunks that a world can have.
bool is_plausible(const StateChunk& chunk) {
  return chunk.first_body <= chunk.last_body && chunk.chunks <= limits::kBodies;
}

}  // namespace

bool WorldMirror::take(const StateChunk& chunk, Time now) {
  if (!is_plausible(chunk)) return false;
  ++counters_.chunks_received;
  if (current_.has_come.empty() || chunk.tick > current_.tick) begin_tick(chunk, now);
  if (chunk.tick < current_.tick) {
    ++counters_.chunks_stale;
  } else if (const auto i = static_cast<std::size_t>(chunk.chunk);
             i < current_.has_come.size() && !current_.has_come[i]) {
    current_.has_come[i] = true;
    if (--current_.missing == 0) finished_ticks_.push_back(current_.tick);
  }
  merge(chunk, now);
  return true;
}

void WorldMirror::begin_tick(const StateChunk& chunk, Time now) {
  if (!current_.has_come.empty()) {
    if (current_.missing > 0) finished_ticks_.push_back(current_.tick);
    if (!is_first_tick_) counters_.chunks_lost += current_.missing;
    const Tick skipped = std::min<Tick>(chunk.tick - current_.tick - 1, limits::kTicksAhead);
    counters_.chunks_lost += skipped * chunk.chunks;
    is_first_tick_ = false;

    const double wall_s = std::chrono::duration<double>(now - tick_came_at_).count();
    const double simulated_s = 1e-6 * static_cast<double>(chunk.tick_time_us - tick_time_us_);
    if (wall_s < kPause_s) {
      counters_.tick_jitter_s +=
          kJitterWeight * (std::abs(wall_s - simulated_s) - counters_.tick_jitter_s);
    }
  }
  current_ = {chunk.tick, std::vector<bool>(static_cast<std::size_t>(chunk.chunks)), chunk.chunks};
  tick_came_at_ = now;
  tick_time_us_ = chunk.tick_time_us;
}

void WorldMirror::merge(const StateChunk& chunk, Time now) {
  const auto first = std::lower_bound(bodies_.begin(), bodies_.end(), chunk.first_body, ById{});
  const auto last = std::upper_bound(first, bodies_.end(), chunk.last_body, ById{});
  const auto view_of = [&](const BodyState& state) { return BodyView{state, chunk.tick, now}; };

  const bool has_same_ids =
      std::equal(first, last, chunk.states.begin(), chunk.states.end(),
                 [](const BodyView& a, const BodyState& b) { return a.state.body == b.body; });
  if (has_same_ids) {
    std::transform(first, last, chunk.states.begin(), first, [&](const auto& known, const auto& s) {
      return chunk.tick >= known.tick ? view_of(s) : known;
    });
    return;
  }

  merged_.clear();
  const auto keep_or_forget = [&](const BodyView& known) {
    if (known.tick > chunk.tick) {
      merged_.push_back(known);
    } else {
      forget(known.state.body);
    }
  };
  auto known = first;
  for (const BodyState& state : chunk.states) {
    for (; known != last && known->state.body < state.body; ++known) keep_or_forget(*known);
    if (known != last && known->state.body == state.body) {
      merged_.push_back(chunk.tick >= known->tick ? view_of(state) : *known);
      ++known;
    } else if (chunk.tick >= current_.tick && bodies_.size() < limits::kBodies) {
      merged_.push_back(view_of(state));  // from an older tick it may be gone already
    }
  }
  for (; known != last; ++known) keep_or_forget(*known);
  const auto at = bodies_.erase(first, last);
  bodies_.insert(at, merged_.begin(), merged_.end());
}

std::span<const Event> WorldMirror::take(const Events& batch) {
  std::span<const Event> fresh = batch.events;
  if (!next_event_) next_event_ = batch.first;
  if (batch.first > *next_event_) {
    counters_.events_lost += batch.first - *next_event_;
  } else {
    const auto known = static_cast<std::size_t>(*next_event_ - batch.first);
    fresh = fresh.subspan(std::min(known, fresh.size()));
  }
  next_event_ =
      std::max(*next_event_, batch.first + static_cast<std::int64_t>(batch.events.size()));
  counters_.events_received += static_cast<std::int64_t>(fresh.size());
  for (const Event& event : fresh) remember(event);
  return fresh;
}

void WorldMirror::remember(const Event& event) {
  if (event.kind == EventKind::removed) {
    forget(event.body);
  } else if (event.kind == EventKind::spawned || event.kind == EventKind::described) {
    forget(event.body);  // what else it was said to be: a liar's names must not pile up
    if (about_.size() >= limits::kBodies) return;
    about_.emplace(event.body.value, event);
    if (!event.name.empty()) by_name_.insert_or_assign(event.name, event.body);
  }
}

void WorldMirror::forget(BodyId body) {
  const auto found = about_.find(body.value);
  if (found == about_.end()) return;
  const auto named = by_name_.find(found->second.name);
  if (named != by_name_.end() && named->second == body) by_name_.erase(named);
  about_.erase(found);
}

void WorldMirror::clear() {
  const Counters counters = counters_;
  *this = WorldMirror{};
  counters_ = counters;
}

const BodyView* WorldMirror::find(BodyId body) const {
  const auto found = std::lower_bound(bodies_.begin(), bodies_.end(), body, ById{});
  return found != bodies_.end() && found->state.body == body ? &*found : nullptr;
}

const Event* WorldMirror::about(BodyId body) const {
  const auto found = about_.find(body.value);
  return found == about_.end() ? nullptr : &found->second;
}

BodyId WorldMirror::find_by_name(std::string_view name) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? BodyId{} : found->second;
}

}  // namespace cradle
