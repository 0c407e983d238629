#include "protocol/command_window.h"

#include <cradle/limits.h>

#include <algorithm>

namespace cradle {
namespace {

using namespace std::chrono_literals;

Receipt refusal(const CommandHeader& header, Result result) {
  return {header.client, header.sequence, 0, {result, {}, 0}};
}

}  // namespace

ReceiveWindow::Verdict ReceiveWindow::arrive(Command&& command) {
  using Kind = Verdict::Kind;
  const CommandHeader header = command.header;
  if (header.sequence < first_) return {Kind::answered, refusal(header, Result::superseded)};
  if (header.sequence < next_) {
    if (const auto open = open_.find(header.sequence); open != open_.end()) {
      return open->second ? Verdict{Kind::answered, *open->second} : Verdict{Kind::held, {}};
    }
    const auto kept = receipts_.find(header.sequence);
    if (kept != receipts_.end()) return {Kind::answered, kept->second};
    return {Kind::answered, refusal(header, Result::expired)};
  }
  if (is_beyond(header.sequence)) return {Kind::answered, refusal(header, Result::gap)};
  held_.emplace(header.sequence, std::move(command));
  return {header.sequence == next_ ? Kind::in_order : Kind::held, {}};
}

bool ReceiveWindow::is_beyond(std::int64_t sequence) const {
  return sequence >= next_ + limits::kHeldCommands;
}

bool ReceiveWindow::is_new(std::int64_t sequence) const {
  return sequence >= next_ && !is_beyond(sequence) && !held_.contains(sequence);
}

std::optional<Command> ReceiveWindow::take_next() {
  const auto first = held_.find(next_);
  if (first == held_.end()) return std::nullopt;
  Command command = std::move(first->second);
  held_.erase(first);
  open_.emplace(next_++, std::nullopt);
  return command;
}

void ReceiveWindow::keep(const Receipt& receipt) {
  if (receipt.outcome.result == Result::queued) {
    open_[receipt.sequence] = receipt;
    return;
  }
  open_.erase(receipt.sequence);
  receipts_[receipt.sequence] = receipt;
  answered_.push_back(receipt.sequence);
  if (answered_.size() > static_cast<std::size_t>(limits::kReceiptsKept)) {
    receipts_.erase(answered_.front());
    answered_.pop_front();
  }
}

bool SendWindow::has_room() const {
  // Counted from the oldest that the server has not taken, as its window is.
  const auto oldest = std::find_if(pending_.begin(), pending_.end(),
                                   [](const auto& entry) { return !entry.second.is_queued; });
  return oldest == pending_.end() || next_ - oldest->first < limits::kHeldCommands;
}

void SendWindow::add(MessageKind kind, Bytes payload, Time now) {
  Pending pending;
  pending.kind = kind;
  pending.payload = std::move(payload);
  pending.first_sent = pending.next_send = now;
  pending_.emplace(next_++, std::move(pending));
}

void SendWindow::ask_again(std::int64_t sequence, Time now) {
  Pending& pending = pending_.at(sequence);
  pending.last_sent = now - kSafePause;
  pending.next_send = now;
}

void SendWindow::note_tick(Tick tick, Time now) {
  for (auto& [sequence, pending] : pending_) {
    if (pending.answer_tick == 0 || pending.answer_tick > tick) continue;
    pending.answer_tick = 0;
    pending.last_sent = now;  // the tick came without its answer, as if it had been asked for now
    pending.next_send = now + pause_;
  }
}

std::optional<SendWindow::Duration> SendWindow::answer(const Receipt& receipt, Time now) {
  const Result result = receipt.outcome.result;
  const auto found = pending_.find(receipt.sequence);
  if (found == pending_.end() || is_retry(result)) return std::nullopt;
  Pending& pending = found->second;
  learn(pending, now);
  if (result != Result::held) taken_ = std::max(taken_, receipt.sequence);
  if (result == Result::held) pending.is_held = true;
  if (result == Result::queued && !pending.is_queued) {
    pending.is_queued = true;
    pending.answer_tick = receipt.tick;
  }
  if (is_interim(result)) return std::nullopt;
  const Duration round_trip = now - pending.first_sent;
  pending_.erase(found);
  return round_trip;
}

void SendWindow::restart() {
  pending_.clear();
  taken_ = next_ - 1;
}

SendWindow::Time SendWindow::due(const Pending& pending, bool is_safe) const {
  if (is_safe) return pending.last_sent + kSafePause;
  const bool may_be_lost = pending.sends > 0 && pending.last_sent <= answered_sent_;
  if (!may_be_lost) return pending.next_send;
  return std::min(pending.next_send, pending.last_sent + answered_in_ + kReordering);
}

/// Something was sent again: more slowly from now on, until an answer comes.
void SendWindow::slow_down(Time now) {
  if (now < slower_after_) return;
  slower_after_ = now + pause_;
  pause_ = std::min(2 * pause_, kLongestPause);
}

/// What an answer tells of the network.
void SendWindow::learn(const Pending& answered, Time now) {
  const Duration round_trip = now - answered.last_sent;
  if (answered.last_sent >= answered_sent_) {
    answered_sent_ = answered.last_sent;
    answered_in_ = round_trip;
  }
  if (answered.sends == 1 && !answered.is_queued && !answered.is_held) {
    const Duration error = round_trip - round_trip_;
    const bool is_first = round_trip_ == Duration{};
    variation_ =
        is_first ? round_trip / 2 : variation_ + (std::chrono::abs(error) - variation_) / 4;
    round_trip_ = is_first ? round_trip : round_trip_ + error / 8;
  }
  pause_ = patience();
}

SendWindow::Duration SendWindow::patience() const {
  if (answered_sent_ == Time{}) return kFirstPause;
  const bool is_measured = round_trip_ != Duration{};
  const Duration overdue = is_measured ? round_trip_ + 4 * variation_ : 4 * answered_in_;
  return std::clamp(overdue, kShortestPause, kLongestPause / 2);
}

}  // namespace cradle
