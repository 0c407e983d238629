/// What the server says to everybody, as values: receipts, status, states, events.
#pragma once

#include <cradle/world_view.h>

#include <string>

#include "protocol/command.h"

namespace cradle {

struct Receipts {
  std::int64_t epoch = 0;
  std::vector<Receipt> receipts;
  friend bool operator==(const Receipts&, const Receipts&) = default;
};

/// One chunk of a tick's snapshot; it stands alone.
struct StateChunk {
  std::int64_t epoch = 0;
  Tick tick = 0;
  std::int64_t tick_time_us = 0;
  std::int64_t sent_us = 0;
  std::int32_t chunk = 0;
  std::int32_t chunks = 1;
  BodyId first_body;  ///< ids of first_body .. last_body that are not listed do not exist
  BodyId last_body;
  std::vector<BodyState> states;  ///< in ascending order of ids
  friend bool operator==(const StateChunk&, const StateChunk&) = default;
};

struct Events {
  std::int64_t epoch = 0;
  std::int64_t first = 0;  ///< number of the first event here
  std::vector<Event> events;
  friend bool operator==(const Events&, const Events&) = default;
};

}  // namespace cradle
