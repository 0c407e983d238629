/// Exactly once and in order, over a wire that loses, doubles and reorders: the two ends of one
/// client's sequence of commands. No clock, no wire: time is what the caller says it is.
///
/// The client numbers its commands 1, 2, 3, ... and sends each again until its receipt has come.
/// The server takes them strictly in that order, holds back what arrives behind a gap, and answers
/// a repeated command with the receipt it gave the first time.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "protocol/codec.h"
#include "protocol/command.h"

namespace cradle {

/// The server's end, for one client.
class ReceiveWindow {
 public:
  /// `first` is the sequence of the client's hello.
  explicit ReceiveWindow(std::int64_t first) : next_(first) {}

  /// What to do with an arriving command.
  struct Verdict {
    enum class Kind {
      in_order,  ///< take it now, then all that take_next() yields
      held,      ///< no answer yet: kept until the gap before it is filled, or taken already
      answered,  ///< `receipt` is the answer
    } kind;
    Receipt receipt;
  };
  Verdict arrive(Command&& command);

  /// The command whose turn it is, once; nothing if it has not arrived. It must be answered.
  std::optional<Command> take_next();

  /// Keeps the answer for repetitions; the final one replaces `queued`.
  void keep(const Receipt& receipt);

  std::int64_t next() const { return next_; }
  std::size_t held() const { return held_.size(); }

 private:
  std::int64_t next_;                     ///< sequence that is to be taken next
  std::map<std::int64_t, Command> held_;  ///< arrived, next_ <= sequence
  /// Taken, without a final answer; the receipt, if any, says `queued`.
  std::map<std::int64_t, std::optional<Receipt>> open_;
  std::map<std::int64_t, Receipt> receipts_;  ///< the last kReceiptsKept final answers,
  std::deque<std::int64_t> answered_;         ///< their sequences, in the order of answering
};

/// The client's end: what is not answered yet, and when to send it again.
class SendWindow {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  /// A command on its way.
  struct Pending {
    MessageKind kind = MessageKind::hello;
    Bytes payload;
    Time first_sent{};
    Time next_send{};
    Duration pause{};        ///< until the next resend
    bool is_queued = false;  ///< the server has it and will answer at `answer_tick`
    Tick answer_tick = 0;    ///< 0: not queued, or that tick has passed
    int sends = 0;
  };

  std::int64_t next_sequence() const { return next_; }

  /// False if limits::kHeldCommands are waiting for their answer already.
  bool has_room() const;

  /// Adds the command numbered next_sequence(); it is due at once.
  void add(MessageKind kind, Bytes payload, Time now);

  /// Calls `send(kind, payload)` for everything due, oldest first; how many were sent again.
  template <class Send>
  int send_due(Time now, Send&& send) {
    int resends = 0;
    for (auto& [sequence, pending] : pending_) {
      if (pending.next_send > now) continue;
      if (pending.sends > 0) ++resends;
      send(pending.kind, ByteView(pending.payload));
      schedule(pending, now);
    }
    return resends;
  }

  /// The world has come to `tick`: the answer of what was queued for it should have come, and is
  /// asked for again soon.
  void note_tick(Tick tick, Time now);

  /// Takes a receipt; the time since the first sending if it answers something pending for good.
  /// `queued` slows the resending, `gap` and `busy` leave it pending.
  std::optional<Duration> answer(const Receipt& receipt, Time now);

  bool is_pending(std::int64_t sequence) const { return pending_.contains(sequence); }
  std::size_t size() const { return pending_.size(); }

  /// Forgets everything pending and starts again from sequence 1: the server is a new one.
  std::vector<std::int64_t> restart();

 private:
  static void schedule(Pending& pending, Time now);

  std::int64_t next_ = 1;
  std::map<std::int64_t, Pending> pending_;
};

}  // namespace cradle
