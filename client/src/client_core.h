/// The client library without its clock and its sockets: time is what the caller says it is, and
/// transports are handed in. Client wraps this; tests and games that host their own world use it
/// with an InProcessBus.
#pragma once

#include <cradle/client_values.h>
#include <cradle/world_view.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <variant>

#include "client/src/world_mirror.h"
#include "protocol/channels.h"
#include "protocol/command_window.h"
#include "protocol/transport/transport.h"

namespace cradle {

class ClientCore {
 public:
  using Time = SendWindow::Time;
  using Duration = SendWindow::Duration;

  /// Opens the port of states that the world names in its heartbeat.
  using OpenStates = std::function<OpenedTransport(int port)>;

  /// As the functions of Client of the same names.
  struct Callbacks {
    std::function<void(const Event&)> on_event;
    std::function<void(Ticket, const Answer&)> on_answer;
    std::function<void(Tick)> on_tick;
    std::function<void(std::int64_t epoch)> on_restart;
  };

  /// How far we have come with the world: from the first heartbeat on, this goes by itself.
  enum class Welcome {
    unseen,    ///< no heartbeat yet, or one of another protocol version
    asked,     ///< hello is on its way
    given,     ///< commands are welcome
    forgotten  ///< refused, or not known any more: the next command says hello first
  };

  /// Who we are to the world. A client that keeps its number begins anew with a higher sequence
  /// than any before.
  struct Identity {
    std::int64_t number = 0;  ///< as in ClientOptions
    std::int64_t first_sequence = 1;
    bool is_spectator = false;  ///< as in ClientOptions
  };

  /// `world` must satisfy is_world_name(), `name` is_name().
  /// Without `open_states` the world is a recording: everything comes over `control`, nothing is
  /// sent, and commands are refused.
  ClientCore(const std::string& world, std::string name, std::unique_ptr<Transport> control,
             OpenStates open_states, const Identity& identity = {0, 1, false});

  /// Checks, stamps and sends. See Client's commands.
  Ticket submit(CommandBody body, Tick target_tick, Time now);

  /// Receives what has come, sends what is due, runs callbacks. How many messages for us came.
  int poll(Time now);

  std::optional<Answer> answer(Ticket ticket) const;
  BatchLimits batch_limits() const;

  const WorldMirror& mirror() const { return mirror_; }
  const WorldStatus& status() const { return status_; }
  std::int64_t epoch() const { return epoch_; }
  Tick tick() const { return std::max(mirror_.tick(), status_.tick); }
  bool is_alive() const;
  /// Two servers that live claim this world: no commands are sent.
  bool is_contested() const { return has_rival_ && now_ - rival_heard_at_ < kHeartbeatTimeout; }
  bool is_recording() const { return !open_states_; }
  Time polled_at() const { return now_; }
  bool is_in_callback() const { return is_in_callback_; }
  ClientStatistics statistics() const;
  const std::string& last_callback_error() const { return last_callback_error_; }

  Callbacks callbacks;

  // For whoever connects or waits.
  Welcome welcome() const { return welcome_; }
  Result hello_result() const { return hello_result_; }  ///< of the last hello answered
  const std::string& states_fault() const { return states_fault_; }
  bool has_heard_other_protocol() const { return has_heard_other_protocol_; }
  const std::set<std::string>& other_worlds() const { return other_worlds_; }
  const Transport& control() const { return *control_; }
  const Transport* states() const { return states_.get(); }

 private:
  static constexpr Duration kHeartbeatTimeout = std::chrono::seconds(3);  ///< six heartbeats

  struct Restarted {
    std::int64_t epoch = 0;
  };
  struct Answered {
    Ticket ticket;
    Answer answer;
  };
  struct FinishedTick {
    Tick tick = 0;
  };
  using Notice = std::variant<Event, Answered, FinishedTick, Restarted>;

  /// A sent command that is not answered yet.
  struct Sent {
    std::int64_t ticket = 0;  ///< 0: our own hello
    bool is_for_later = false;
  };

  void receive_control(std::string_view channel, ByteView payload);
  void receive_states(std::string_view channel, ByteView payload);
  void take(const WorldStatus& status);
  void take(const Receipts& receipts);
  void take(const Receipt& receipt);
  bool is_new_run(std::int64_t epoch) const;
  void take(const Events& batch);
  void take_states(ByteView payload);
  bool is_past(std::int64_t epoch) const;
  void note_rival();
  void meet(std::int64_t epoch);
  void enter(std::int64_t epoch);
  void ask_whether_gone();
  void leave();
  void open_states_at(int port);
  void note_other_world(std::string_view channel);

  Outcome check(const CommandBody& body, Tick target_tick) const;
  void say_hello();
  void keep_alive();
  void repeat_hello();
  void enqueue(std::int64_t ticket, CommandBody body, Tick target_tick);
  void transmit();
  void resolve(Ticket ticket, const Answer& answer);

  void run_callbacks();
  void run(const Notice& notice);

  Channels channels_;
  std::int64_t fixed_number_;  ///< 0: a random one
  bool is_spectator_;
  std::string name_;
  std::unique_ptr<Transport> control_;
  std::unique_ptr<Transport> states_;
  OpenStates open_states_;
  int state_port_ = 0;
  std::string states_fault_;

  std::int64_t client_ = 0;               ///< our number in this epoch
  std::int64_t epoch_ = 0;                ///< 0: none yet
  std::deque<std::int64_t> past_epochs_;  ///< the last few before
  bool has_rival_ = false;                ///< one of the past has answered us
  Time rival_heard_at_{};
  Welcome welcome_ = Welcome::unseen;
  std::int64_t hello_sequence_ = 0;
  Result hello_result_ = Result::ok;

  SendWindow window_;
  std::map<std::int64_t, Sent> sent_;  ///< by sequence
  std::int64_t last_ticket_ = 0;
  std::unordered_map<std::int64_t, Answer> answers_;  ///< by ticket
  std::deque<std::int64_t> answered_;                 ///< tickets, oldest first
  Time sent_at_{};                                    ///< the last time we sent anything
  Time asked_at_{};                                   ///< and asked whether our epoch is over

  WorldMirror mirror_;
  WorldStatus status_;
  Time heartbeat_at_{};
  Time now_{};
  int messages_ = 0;  ///< for us, in this poll
  bool has_heard_other_protocol_ = false;
  std::set<std::string> other_worlds_;

  std::deque<Notice> notices_;
  bool is_in_callback_ = false;
  std::string last_callback_error_;
  ClientStatistics counted_;  ///< what is not counted elsewhere
};

}  // namespace cradle
