/// `cradled serve`: a world on the network.
///
/// A tick drains the inbox, journals and applies what is due, steps, and publishes; at its own
/// pace, never in reaction to a packet. The daemon is the only reader of a clock. Three threads
/// and those that help to step:
/// the tick, a receiver that only fills the inbox, a publisher that only sends states. The metrics
/// page, if there is one, has its own and gets copies.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "protocol/transport/transport.h"
#include "server/command_desk.h"
#include "server/commands.h"
#include "server/inbox.h"
#include "server/journal.h"
#include "server/log_places.h"
#include "server/pacer.h"
#include "server/publisher.h"
#include "server/readings.h"
#include "server/simulate.h"
#include "server/supervisor.h"

namespace cradle {

/// The daemon cannot start: one line for the operator, and the process's exit code.
struct StartupError : std::runtime_error {
  StartupError(int code, const std::string& line) : std::runtime_error(line), exit_code(code) {}
  int exit_code;
};

/// The daemon without process and signals; tests run it on in-process transports.
class Daemon {
 public:
  struct Options {
    std::string world = "default";
    bool lockstep = false;
    Permissions permissions;
    int datagram_bytes = 60000;
    int state_port = 0;  ///< told to clients
    int threads = 1;
    ReadingsBoard* board = nullptr;  ///< kept up to date, if given; outlives the daemon
  };

  Daemon(const Options& options, Scene scene, std::unique_ptr<Transport> control,
         std::unique_ptr<Transport> states);
  ~Daemon();

  /// Whom one hears on the network.
  struct Presence {
    bool hears_itself = false;
    bool has_rival = false;  ///< another daemon that serves a world of this name
  };

  /// Sends heartbeats until one comes back, at most a second; `waits_for_rivals`: at least as long
  /// as a rival may be silent. Before run().
  Presence look_around(bool waits_for_rivals);

  /// Until the supervisor ends it or a client shuts the world down.
  void run(Supervisor& supervisor);
  /// Until `stop_descriptor` is readable, likewise; nobody else looks after it.
  void run(int stop_descriptor);

  /// For the commands that come from now on. Between two rounds of the loop, as in attend().
  void set_permissions(const Permissions& permissions) { options_.permissions = permissions; }

  std::int64_t epoch() const { return epoch_; }
  const World& world() const { return run_.world(); }

 private:
  class PhaseTimer;
  class Receiver;

  /// Wall time, us: of a tick, or summed since the last status.
  struct Times {
    double apply_us = 0, collide_us = 0, solve_us = 0, publish_us = 0;
    std::int64_t ticks = 0;
  };

  /// Why the loop goes on.
  enum class Awoken { supervisor, command, tick, news };

  void tick(bool is_due);
  void send_news();
  bool apply_due(bool is_stepping);
  void step(PhaseTimer& timer);
  /// Keeps an event for sending, and logs what nobody may miss about it.
  void tell(Event&& event);
  void publish_states();
  void answer_finished_steps();
  void send_receipts();
  void send_events();
  void send_status();
  WorldStatus status();
  void put_readings();
  void receive(const std::atomic<bool>& is_ending);
  bool is_rival(ByteView status_message) const;
  void note_rivals();
  Awoken wait();
  Pacer::Clock::time_point news_deadline() const;
  std::int64_t now_us() const;

  Options options_;
  Supervisor* supervisor_ = nullptr;  ///< while run() runs
  std::int64_t epoch_;
  Channels channels_;
  std::unique_ptr<Transport> control_;
  std::unique_ptr<Transport> states_;
  SceneRun run_;
  RunState time_;
  std::unique_ptr<Executor> executor_;
  Inbox inbox_;
  CommandDesk desk_;
  std::unique_ptr<Journal> journal_;
  Publisher publisher_;
  Pacer pacer_;

  Snapshot snapshot_;
  std::deque<Event> events_;
  std::set<ShapeKind> not_colliding_told_;  ///< of these the log has spoken
  std::int64_t next_event_ = 1;
  BodyId described_;  ///< bodies up to this one have been described to the newest client
  std::int64_t next_description_us_ = 0;
  bool has_descriptions_ = false;  ///< more are to follow
  std::int64_t next_status_us_ = 0;
  std::int64_t overruns_told_ = 0;  ///< in the last status
  std::atomic<std::int64_t> unknown_datagrams_ = 0;
  std::atomic<std::int64_t> rival_heard_us_ = 0;  ///< 0: never
  bool is_contested_ = false;
  StepReport last_report_;
  Times times_;
  Readings readings_;

  LogPlaces log_places_;
  LogPlace hello_log_{log_places_, LogLevel::info, "client said hello"};
  LogPlace full_log_{log_places_, LogLevel::warn, "client turned away: the world is full"};
  LogPlace left_out_log_{log_places_, LogLevel::warn,
                         "wrenches of the scene left out: their bodies cannot take them"};
  LogPlace not_colliding_log_{log_places_, LogLevel::warn,
                              "bodies of this shape do not collide yet"};
  LogPlace surfaces_log_{log_places_, LogLevel::warn,
                         "meshes and height fields do not collide with each other yet"};
  LogPlace quarantine_log_{log_places_, LogLevel::warn, "body quarantined"};
  LogPlace springs_log_{log_places_, LogLevel::warn,
                        "springs too stiff for the tick: a part of it by impulses"};
  LogPlace crowd_log_{log_places_, LogLevel::warn,
                      "too many bodies in one place: pairs are left out"};
  LogPlace rival_log_{log_places_, LogLevel::error,
                      "heartbeats of another daemon of this world, or of a recording"};
  LogPlace rival_gone_log_{log_places_, LogLevel::info,
                           "the other heartbeats of this world have ended"};
};

}  // namespace cradle
