/// The small values that the client library takes and gives.
#pragma once

#include <cradle/export.h>
#include <cradle/result.h>
#include <cradle/types.h>

#include <chrono>
#include <cstdint>
#include <string>

namespace cradle {

/// Where a world is, and what to call this client there.
struct ClientOptions {
  /// udpm://GROUP:PORT?ttl=N; empty: udpm://239.255.76.67:7667?ttl=0. Or a recording, made by
  /// lcm-logger: file://PATH?speed=X&states=PATH, see Client::is_recording().
  std::string lcm_url;
  std::string world = "default";  ///< 1 .. limits::kWorldNameBytes letters, digits, '-', '_'
  std::string name;               ///< for the server's logs; at most limits::kNameBytes of UTF-8
  /// Who we are to the world, 1 .. limits::kIntegerMax; 0: a random number. What clients do in the
  /// same tick takes effect in the order of their numbers: fix them where runs must be repeatable,
  /// to different ones for different clients that live. A client that is started again may keep its
  /// number: its earlier run's commands for later ticks still happen.
  std::int64_t number = 0;

  /// Only looks: takes no place among the world's clients, hears no names of bodies that were there
  /// before, and its commands are refused: not_allowed.
  bool is_spectator = false;

  /// The defaults, with `lcm_url` and `world` from the environment variables CRADLE_LCM_URL and
  /// CRADLE_WORLD where these are set.
  CRADLE_EXPORT static ClientOptions from_environment(std::string name);
};

/// The URL of a recording in one file or two, each a path, at a speed of 0 or 0.001 .. 1000: see
/// Client::is_recording().
CRADLE_EXPORT std::string recording_url(const std::string& path,
                                        const std::string& states_path = "", double speed = 1);

/// When a command takes effect: before the step of a tick.
struct When {
  Tick tick = 0;  ///< 0: the next one
};

/// The name of a command that was sent, or that the library refused to send. Never used again.
struct Ticket {
  std::int64_t number = 0;
  Result refused = Result::ok;  ///< else: nothing was sent, and this is why

  explicit operator bool() const { return refused == Result::ok; }
  friend bool operator==(const Ticket&, const Ticket&) = default;
};

/// What became of a command.
struct Answer {
  Result result = Result::ok;
  BodyId body;    ///< spawn: the first body made; the others have the ids after it
  int item = 0;   ///< refused lists: the first item at fault
  Tick tick = 0;  ///< the first tick whose state shows the effect; 0 where the server did not say

  explicit operator bool() const { return result == Result::ok; }
  friend bool operator==(const Answer&, const Answer&) = default;
};

/// How many items one command can carry to this world: what fits one datagram.
struct BatchLimits {
  int spawn = 0, despawn = 0, push = 0, clear_wrenches = 0, set_motion = 0;
};

/// The newest motion known of a body.
struct BodyView {
  BodyState state;
  Tick tick = 0;                                      ///< of which `state` is
  std::chrono::steady_clock::time_point received_at;  ///< the poll() that brought it
};

/// Counted since the client was made; times in s, wall time.
struct ClientStatistics {
  std::int64_t datagrams_received = 0;  ///< on both ports, of any sender, our own included
  std::int64_t datagrams_rejected = 0;  ///< not whole short LCM messages, or malformed
  std::int64_t datagrams_dropped = 0;   ///< by the kernel: the receive buffer was full
  std::int64_t send_failures = 0;
  int receive_buffer_bytes = 0;  ///< of the port of states, as granted

  std::int64_t chunks_received = 0;
  std::int64_t chunks_lost = 0;   ///< missing when a newer tick came
  std::int64_t chunks_stale = 0;  ///< of an older tick than the newest
  std::int64_t events_received = 0;
  std::int64_t events_lost = 0;

  std::int64_t commands_sent = 0;  ///< each once
  std::int64_t resends = 0;
  std::int64_t answers = 0;
  double round_trip_last_s = 0;  ///< from sending to the receipt, without commands for later ticks
  double round_trip_smoothed_s = 0;  ///< moving mean as RFC 6298, of those that were sent once
  double round_trip_max_s = 0;
  /// Moving mean, weight 1/16, of |wall time - simulated time| between ticks seen, as RFC 3550.
  double tick_jitter_s = 0;

  /// Heartbeats of other runs of the server than the present one, which lives: a recording played
  /// into the network, or a second server of the same name.
  std::int64_t strangers = 0;
  std::int64_t restarts = 0;             ///< of the world, since we know it
  std::int64_t callback_exceptions = 0;  ///< see Client::last_callback_error()
};

}  // namespace cradle
