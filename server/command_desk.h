/// Takes commands in, says when each is due, and keeps the answers: sessions of clients, sequences,
/// target ticks. No wire, no clock: time is what the caller says it is.
///
/// What is due together is handed out sorted by (client, sequence): never by arrival.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "protocol/command_window.h"
#include "server/inbox.h"

namespace cradle {

class CommandDesk {
 public:
  explicit CommandDesk(std::int64_t epoch) : epoch_(epoch) {}

  /// Takes in what has come before the step of `coming_tick`. `now_us` is a monotonic time, us.
  void admit(Inbox::Contents&& contents, Tick coming_tick, std::int64_t now_us);

  /// Hands out what is due: commands without a target at once; when the world `is_stepping`, those
  /// for `coming_tick` too. Each must be answered, now or later.
  std::vector<Command> take_due(Tick coming_tick, bool is_stepping);

  /// The answer to a command that take_due() gave: kept for repetitions, and sent.
  /// `tick` is the first one whose state shows the effect; for `queued`, the one waited for.
  void answer(const CommandHeader& header, const Outcome& outcome, Tick tick);

  /// What is to be sent, since the last call.
  std::vector<Receipt> take_receipts() { return std::exchange(outgoing_, {}); }

  /// Of commands held behind a gap or queued, as messages; at most limits::kWaitingBytes of lists.
  std::int64_t waiting_bytes() const { return waiting_bytes_; }

  std::int64_t clients(std::int64_t now_us) const;  ///< heard within the last kSilence_us
  /// Answers since the start, by what they said; repetitions of an answer are not among them.
  /// `queued` and `held` are no final ones: their commands count again when they take effect.
  const std::array<std::int64_t, kServerResults>& answered() const { return answered_; }
  std::int64_t answered(Result result) const {
    return answered_.at(static_cast<std::size_t>(result));
  }
  std::int64_t applied() const { return answered(Result::ok); }
  std::int64_t refused() const;                          ///< all but `ok`, `queued` and `held`
  std::int64_t repeated() const { return repeated_; }    ///< answers given once more
  std::int64_t malformed() const { return malformed_; }  ///< payloads that are no command

  /// Clients that have said hello since the last call.
  std::vector<std::string> take_newcomers() { return std::exchange(newcomers_, {}); }
  /// Those that found no room.
  std::vector<std::string> take_turned_away() { return std::exchange(turned_away_, {}); }

 private:
  struct Session {
    std::string name;
    ReceiveWindow window;
    std::int64_t heard_us = 0;
    int queued = 0;
  };
  using Key = std::tuple<Tick, std::int64_t, std::int64_t>;  ///< target tick, client, sequence

  void admit_one(Command&& command, Tick coming_tick, std::int64_t now_us);
  void greet(Command&& command, std::int64_t now_us);
  void accept(Session& session, Command&& command, Tick coming_tick);
  void begin_anew(Session& session, const Command& hello);
  void forget_held(const Session& session);
  bool make_room(std::int64_t now_us);
  void refuse(const CommandHeader& header, Result result);
  void count(Result result) { ++answered_.at(static_cast<std::size_t>(result)); }

  std::int64_t epoch_;
  std::map<std::int64_t, Session> sessions_;  ///< by client
  std::map<Key, Command> waiting_;            ///< target 0: due at once
  std::int64_t waiting_bytes_ = 0;            ///< of those and of what the sessions hold
  std::vector<Receipt> outgoing_;
  std::vector<std::string> newcomers_;
  std::vector<std::string> turned_away_;
  std::array<std::int64_t, kServerResults> answered_{};  ///< by Result
  std::int64_t repeated_ = 0;
  std::int64_t malformed_ = 0;
};

}  // namespace cradle
