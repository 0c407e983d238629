/// Exactly once and in order, over a wire that loses, doubles and reorders: the two ends of one
/// client's sequence of commands. No clock, no wire: time is what the caller says it is.
///
/// The client numbers its commands without gaps and sends each again until its receipt has come.
/// The server takes them strictly in that order, holds back what arrives behind a gap, and answers
/// a repeated command with the receipt it gave the first time.
#pragma once

#include <cradle/limits.h>

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
  explicit ReceiveWindow(std::int64_t first) : first_(first), next_(first) {}

  /// What to do with an arriving command.
  struct Verdict {
    enum class Kind {
      in_order,  ///< take it now, then all that take_next() yields
      held,      ///< kept until the gap before it is filled, or taken already without an answer
      answered,  ///< `receipt` is the answer
    } kind;
    Receipt receipt;
  };
  Verdict arrive(Command&& command);

  /// True if commands before this number are missing, more than are held back.
  bool is_beyond(std::int64_t sequence) const;

  /// True if arrive() would keep a command of this number: neither seen before nor too far ahead.
  bool is_new(std::int64_t sequence) const;

  /// The command whose turn it is, once; nothing if it has not arrived. It must be answered.
  std::optional<Command> take_next();

  /// Keeps the answer for repetitions; the final one replaces `queued`.
  void keep(const Receipt& receipt);

  std::int64_t next() const { return next_; }
  /// What has arrived behind a gap, by sequence.
  const std::map<std::int64_t, Command>& held() const { return held_; }

 private:
  std::int64_t first_;                    ///< lower ones are of an earlier client of this number
  std::int64_t next_;                     ///< sequence that is to be taken next
  std::map<std::int64_t, Command> held_;  ///< arrived, next_ <= sequence
  /// Taken, without a final answer; the receipt, if any, says `queued`.
  std::map<std::int64_t, std::optional<Receipt>> open_;
  std::map<std::int64_t, Receipt> receipts_;  ///< the last kReceiptsKept final answers,
  std::deque<std::int64_t> answered_;         ///< their sequences, in the order of answering
};

/// The client's end: what is not answered yet, and when to send it again.
///
/// A command is lost when one sent no earlier has been answered, and its own answer is overdue by
/// that one's round trip (Cheng et al. 2021, RFC 8985, section 6.2). If nothing is answered, a
/// timer that follows the round trips (Paxson et al. 2011, RFC 6298, section 2; commands sent twice
/// are no measure) sends the oldest again, and doubles. So a lost datagram costs a round trip, a
/// dead server little.
class SendWindow {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  /// Numbers begin with `first`.
  explicit SendWindow(std::int64_t first = 1) : next_(first) {}

  std::int64_t next_sequence() const { return next_; }

  /// False if limits::kHeldCommands are waiting for their answer already.
  bool has_room() const;

  /// Adds the command numbered next_sequence(); it is due at once.
  void add(MessageKind kind, Bytes payload, Time now);

  /// Calls `send(kind, payload)` for everything due, oldest first; how many were sent again.
  template <class Send>
  int send_due(Time now, Send&& send) {
    int resends = 0;
    const int resends_max = pause_ > patience() ? kProbes : limits::kQueuedCommands;
    bool has_gap = false;  // the server may be waiting for a command before this one
    for (auto& [sequence, pending] : pending_) {
      has_gap = has_gap || (sequence > taken_ && !pending.is_held);
      const bool is_safe = pending.answer_tick != 0 || (pending.is_held && has_gap);
      const bool is_resend = pending.sends > 0;
      if (due(pending, is_safe) > now || (is_resend && resends == resends_max)) continue;
      if (is_resend) ++resends;
      send(pending.kind, ByteView(pending.payload));
      pending.last_sent = now;
      pending.next_send = now + pause_;
      ++pending.sends;
    }
    if (resends > 0) slow_down(now);
    return resends;
  }

  /// Sends what is pending under this number again with the next send_due().
  void ask_again(std::int64_t sequence, Time now);

  /// The world has come to `tick`: the answer of what was queued for it should have come, and is
  /// asked for again soon.
  void note_tick(Tick tick, Time now);

  /// Takes a receipt; the time since the first sending if it answers something pending for good.
  /// `queued` and `held` slow the resending, `gap` and `busy` leave it pending.
  std::optional<Duration> answer(const Receipt& receipt, Time now);

  bool is_pending(std::int64_t sequence) const { return pending_.contains(sequence); }
  std::size_t size() const { return pending_.size(); }

  /// Moving mean of the round trips of commands that were sent once and not for later.
  Duration round_trip() const { return round_trip_; }

  /// Forgets everything pending: the server is a new one. Numbers go on.
  void restart();

 private:
  /// A command on its way.
  struct Pending {
    MessageKind kind = MessageKind::hello;
    Bytes payload;
    Time first_sent{};
    Time last_sent{};
    Time next_send{};  ///< at the latest, unless the server is known to have it
    int sends = 0;
    bool is_held = false;    ///< the server has it, but not all before it
    bool is_queued = false;  ///< the server has it and will answer at `answer_tick`
    Tick answer_tick = 0;    ///< 0: not queued, or that tick has passed
  };

  static constexpr Duration kFirstPause = std::chrono::milliseconds(40);  ///< nothing measured yet
  static constexpr Duration kShortestPause = std::chrono::milliseconds(10);
  static constexpr Duration kLongestPause = std::chrono::milliseconds(125);
  static constexpr Duration kReordering = std::chrono::milliseconds(2);  ///< more delay is loss
  static constexpr Duration kSafePause = std::chrono::seconds(2);        ///< the server has it
  static constexpr int kProbes = 16;  ///< sent again together in silence

  Time due(const Pending& pending, bool is_safe) const;
  void slow_down(Time now);
  void learn(const Pending& answered, Time now);
  Duration patience() const;

  std::int64_t next_;
  std::map<std::int64_t, Pending> pending_;
  std::int64_t taken_ = 0;  ///< the server has taken all up to this number
  Time answered_sent_{};    ///< when the command answered last, in the order of sending, was sent,
  Duration answered_in_{};  ///< and how long ago that was when its answer came
  Duration round_trip_{};
  Duration variation_{};
  Duration pause_ = kFirstPause;  ///< until what is sent now is sent again
  Time slower_after_{};           ///< the pause has been doubled, and not a second time before
};

}  // namespace cradle
