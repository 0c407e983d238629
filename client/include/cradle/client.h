/// A game's end of a world: send commands, learn what became of them, watch bodies move.
///
/// Units are SI; frames are those of cradle/types.h (W world, Bo origin, Bcm centre of mass).
///
/// The one rule about threads: a Client is used by one thread at a time, and does everything inside
/// the calls you make. It has no thread of its own. Messages are received, commands sent again, and
/// callbacks run only in poll(), and in connect() and wait(), which poll. Call poll() once a frame;
/// a full server forgets a client that it has not heard of for ten seconds.
#pragma once

#include <cradle/client_values.h>
#include <cradle/world_view.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace cradle {

class Client;

/// A client, or why there is none.
struct Connection {
  std::unique_ptr<Client> client;
  Result result = Result::ok;
  std::string message;  ///< one line if there is no client: what is wrong, what to do
};

class CRADLE_EXPORT Client {
 public:
  /// Finds the world by its heartbeat and introduces us, in at most `timeout`. Fails with
  ///  - bad_url, bad_name, out_of_range: the options have no meaning,
  ///  - no_network: the host cannot send to or hear the multicast group,
  ///  - no_world: no heartbeat of that name,
  ///  - bad_version: the world speaks another protocol version,
  ///  - over_quota: the world takes no more clients,
  ///  - timed_out: there is a heartbeat, but no answer to hello,
  ///  - bad_recording: the file cannot be read, or is no recording.
  static Connection connect(const ClientOptions& options, std::chrono::milliseconds timeout);

  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  // --- commands -------------------------------------------------------------------------------
  //
  // Each returns at once. The ticket's answer comes with a later poll(); wait() is the blocking
  // form. Commands take effect in the order in which they were given. Lists are atomic: all of it
  // happens or nothing. A command is sent again until it is answered, and happens once.
  //
  // Refused here, without sending: what breaks a limit of cradle/limits.h or contradicts itself
  // (not_finite, out_of_range, bad_shape, bad_mass, bad_rotation, bad_wrench, bad_name,
  // unknown_body for ids below 1, malformed for an empty list), lists larger than batch_limits()
  // (too_large), anything while limits::kHeldCommands wait for their answer (over_window), and
  // anything while two servers claim the world (contested).
  // Refused by the server: late, too_far_ahead, unknown_body, duplicate_name, over_quota,
  // wrong_kind, not_allowed; by planar worlds out_of_plane. Lost with the server: world_restarted.

  /// At the next tick the server begins: the default of every command.
  static constexpr When next_tick() { return {}; }
  /// Before the step of `tick`: late if that is done already, too_far_ahead beyond
  /// limits::kTicksAhead.
  static constexpr When at(Tick tick) { return {tick}; }

  /// Makes bodies; Answer::body is the first, the ids of the others follow it.
  Ticket spawn(const BodySpec& spec, When when = next_tick());
  Ticket spawn(std::span<const BodySpec> specs, When when = next_tick());

  /// Removes bodies. unknown_body if one does not exist (any more).
  Ticket despawn(BodyId body, When when = next_tick());
  Ticket despawn(std::span<const BodyId> bodies, When when = next_tick());

  /// Applies forces, torques, impulses or accelerations (N, N m, N s, N m s, m/s^2), each in its
  /// own frame, at its own point, for its own duration. wrong_kind unless the body is dynamic.
  Ticket push(const Wrench& wrench, When when = next_tick());
  Ticket push(std::span<const Wrench> wrenches, When when = next_tick());

  /// Ends every wrench that acts on the bodies. A push for a later tick still comes.
  Ticket clear_wrenches(BodyId body, When when = next_tick());
  Ticket clear_wrenches(std::span<const BodyId> bodies, When when = next_tick());

  /// Places bodies (m, W), sets their velocities (m/s of Bcm and rad/s, W), or both.
  Ticket set_motion(const Motion& motion, When when = next_tick());
  Ticket set_motion(std::span<const Motion> motions, When when = next_tick());

  /// Gravity of the whole world, m/s^2, W.
  Ticket set_gravity(const Vec3& gravity_W, When when = next_tick());

  /// Stop, go on, or make 1 .. limits::kStepsPerCommand ticks; step is answered when they are done.
  /// not_allowed unless status().controllable; step, too, while time runs.
  Ticket pause(When when = next_tick());
  Ticket resume(When when = next_tick());
  Ticket step(std::int64_t ticks, When when = next_tick());

  /// Ends the server. not_allowed unless its configuration lets clients do that.
  Ticket shutdown();

  BatchLimits batch_limits() const;

  // --- answers --------------------------------------------------------------------------------

  /// The final answer, if it has come. Those of the last 4096 commands answered are kept.
  std::optional<Answer> answer(Ticket ticket) const;

  /// Polls until the final answer comes. Answer::result is timed_out if it does not within
  /// `timeout`; the command is not withdrawn then: it may still happen, and the ticket be answered.
  /// Inside a callback this does not poll: it gives what is known, or timed_out, at once.
  Answer wait(Ticket ticket, std::chrono::milliseconds timeout);

  /// Receives what has come, sends again what is due, keeps the server's memory of us alive, then
  /// runs the callbacks. Waits at most `wait` if nothing has come. How many messages for us came.
  /// Inside a callback this does nothing.
  int poll(std::chrono::milliseconds wait = std::chrono::milliseconds(0));

  // --- the world as it was last seen ----------------------------------------------------------
  //
  // Pointers and spans hold until the next poll() or wait().

  /// Every body known, in ascending order of ids.
  std::span<const BodyView> bodies() const;

  /// The newest motion of one body; null if it is not known.
  const BodyView* find(BodyId body) const;

  /// Kind, shape, mass and name of a body, as its event of kind spawned or described told. Null
  /// until that has come: soon after connect(), or with the body.
  const Event* about(BodyId body) const;

  /// Empty if it has none, or if it is not known.
  std::string_view name(BodyId body) const;
  BodyId find_by_name(std::string_view name) const;  ///< no body if it is not known

  /// The newest tick heard of, and its simulated time, s.
  Tick tick() const;
  double time_s() const;

  /// How far behind the newest tick the view is, s of simulated time.
  double age_s(const BodyView& view) const;
  /// How long before the last poll() it came, s of wall time.
  double wall_age_s(const BodyView& view) const;

  /// The last heartbeat.
  const WorldStatus& status() const;
  /// Random number of this run of the server.
  std::int64_t epoch() const;
  /// False if no heartbeat has come for three seconds before the last poll(), or if the recording
  /// has ended.
  bool is_alive() const;
  /// True if two servers claim this world, and both have answered us in the three seconds before
  /// the last poll(): on_restart told of the change to the one shown here. Commands are refused:
  /// contested. Not noticed with a fixed ClientOptions::number, which a recording may have, too.
  bool is_contested() const;

  // --- recordings -----------------------------------------------------------------------------
  //
  // Connected to file://PATH?speed=X&states=PATH, a client sees what a client of that time saw. A
  // world has two ports, and lcm-logger records one: the file of the control port has status and
  // names, that of the state port has the states; give both, or the states alone. Time passes
  // `speed` times as fast (default 1), pauses above 5 s are cut; at speed 0 each poll() brings one
  // message, so that every tick is seen. Ages, received_at and jitter are in recorded time.

  /// True if it takes no commands: each is refused here, with Result::recording.
  bool is_recording() const;
  /// True when all of a recording has been seen; the bodies stay where they were last.
  bool has_ended() const;

  // --- callbacks ------------------------------------------------------------------------------
  //
  // Run at the end of poll(), in the order in which things came. They may send commands. They must
  // not destroy the client or replace callbacks. What they throw goes no further: it is counted,
  // and its text kept.

  void on_event(std::function<void(const Event&)> callback);
  /// Every final answer, those of commands refused here included.
  void on_answer(std::function<void(Ticket, const Answer&)> callback);
  /// Once a tick, in order, when all of it or something newer has come.
  void on_tick(std::function<void(Tick)> callback);
  /// The server began anew: bodies are forgotten, pending commands answered world_restarted, and we
  /// have said hello again.
  void on_restart(std::function<void(std::int64_t epoch)> callback);

  /// Text of the last exception that a callback threw.
  const std::string& last_callback_error() const;

  ClientStatistics statistics() const;

  /// For the library itself: client/src/client_impl.h.
  struct __attribute__((visibility("hidden"))) Impl;
  explicit Client(std::unique_ptr<Impl> impl);

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace cradle
