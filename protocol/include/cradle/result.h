/// The one list of outcomes: of commands on the wire, and of calls to the client library.
#pragma once

#include <cradle/export.h>

#include <cstdint>
#include <string_view>

namespace cradle {

/// Below 100: answers of the server. From 100: found by the client library itself.
enum class Result : std::int32_t {
  ok = 0,
  queued = 1,  ///< accepted for a later tick; the final answer follows then
  held = 2,    ///< arrived before an earlier one of its client; the answer follows in its turn

  unknown_client = 10,  ///< say hello first
  wrong_epoch = 11,     ///< meant for another run of the server
  bad_version = 12,     ///< other protocol version
  malformed = 13,       ///< the bytes are not this message, or an enumerator or flag is unknown
  gap = 14,             ///< too far ahead of missing commands: not taken, send again later
  expired = 15,         ///< handled long ago, its receipt is no longer kept
  late = 16,            ///< the target tick has passed
  too_far_ahead = 17,   ///< the target tick is further off than the server keeps commands
  busy = 18,            ///< the inbox was full: not taken, send again later
  not_allowed = 19,     ///< the server's configuration forbids it
  superseded = 20,      ///< another client has said hello with this number since

  unknown_body = 30,
  not_finite = 31,    ///< a number is infinite or not a number
  out_of_range = 32,  ///< a number is beyond the limits of limits.h
  too_large = 33,     ///< more items than fit one command or one datagram
  over_quota = 34,    ///< more bodies, wrenches, clients or queued commands than the server allows
  duplicate_name = 35,
  bad_name = 36,      ///< not UTF-8, or has control characters
  bad_shape = 37,     ///< unknown kind, a size that is not positive, or not for this kind of body
  bad_mass = 38,      ///< no positive mass, or moments that no rigid body has
  bad_rotation = 39,  ///< a quaternion without length
  bad_wrench = 40,    ///< fields that contradict each other
  wrong_kind = 41,    ///< this kind of body cannot do that (a force on a static body)
  out_of_plane = 42,  ///< the world is planar, and this leaves z = 0 or turns about another axis

  timed_out = 100,        ///< no answer in the time given
  no_world = 101,         ///< no heartbeat of such a world
  world_restarted = 102,  ///< the server began a new epoch: what was pending is lost
  no_network = 103,       ///< the transport could not be opened or cannot send
  bad_url = 104,
  over_window = 105,    ///< too many commands without an answer: poll first
  recording = 106,      ///< the world is a recording, which takes no commands
  bad_recording = 107,  ///< the file cannot be read, or is no recording
  contested = 108,      ///< two servers claim this world: end one of them
};

/// Answers of the server have numbers below this.
inline constexpr int kServerResults = 100;

/// The enumerator's name, "ok", "unknown_body", ...; "unlisted" for other numbers.
CRADLE_EXPORT std::string_view to_string(Result result);

/// True for answers that another one follows.
constexpr bool is_interim(Result r) { return r == Result::queued || r == Result::held; }

/// True for the answers after which a client may send the very same command again later.
constexpr bool is_retry(Result r) { return r == Result::gap || r == Result::busy; }

}  // namespace cradle
