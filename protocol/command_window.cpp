#include "protocol/command_window.h"

#include <cradle/limits.h>

#include <algorithm>

namespace cradle {
namespace {

using namespace std::chrono_literals;

// A round trip takes a tick and some microseconds; commands wait for the next tick anyway.
constexpr SendWindow::Duration kFirstPause = 40ms;
constexpr SendWindow::Duration kLongestPause = 250ms;
constexpr SendWindow::Duration kQueuedPause = 2s;  // it is in good hands

Receipt refusal(const CommandHeader& header, Result result) {
  return {header.client, header.sequence, 0, {result, {}, 0}};
}

}  // namespace

ReceiveWindow::Verdict ReceiveWindow::arrive(Command&& command) {
  using Kind = Verdict::Kind;
  const CommandHeader header = command.header;
  if (header.sequence < next_) {
    if (const auto open = open_.find(header.sequence); open != open_.end()) {
      return open->second ? Verdict{Kind::answered, *open->second} : Verdict{Kind::held, {}};
    }
    const auto kept = receipts_.find(header.sequence);
    if (kept != receipts_.end()) return {Kind::answered, kept->second};
    return {Kind::answered, refusal(header, Result::expired)};
  }
  if (header.sequence >= next_ + limits::kHeldCommands) {
    return {Kind::answered, refusal(header, Result::gap)};
  }
  held_.emplace(header.sequence, std::move(command));
  return {header.sequence == next_ ? Kind::in_order : Kind::held, {}};
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
  pending_.emplace(next_++, Pending{kind, std::move(payload), now, now, kFirstPause, false, 0, 0});
}

void SendWindow::schedule(Pending& pending, Time now) {
  pending.next_send = now + pending.pause;
  pending.pause =
      pending.pause == kQueuedPause ? kQueuedPause : std::min(2 * pending.pause, kLongestPause);
  ++pending.sends;
}

void SendWindow::note_tick(Tick tick, Time now) {
  for (auto& [sequence, pending] : pending_) {
    if (pending.answer_tick == 0 || pending.answer_tick > tick) continue;
    pending.answer_tick = 0;
    pending.pause = kFirstPause;
    pending.next_send = now + kFirstPause;
  }
}

std::optional<SendWindow::Duration> SendWindow::answer(const Receipt& receipt, Time now) {
  const auto found = pending_.find(receipt.sequence);
  if (found == pending_.end() || is_retry(receipt.outcome.result)) return std::nullopt;
  if (receipt.outcome.result == Result::queued) {
    Pending& pending = found->second;
    if (pending.is_queued && pending.answer_tick == 0) return std::nullopt;  // overdue already
    pending.is_queued = true;
    pending.answer_tick = receipt.tick;
    pending.pause = kQueuedPause;
    pending.next_send = now + kQueuedPause;
    return std::nullopt;
  }
  const Duration round_trip = now - found->second.first_sent;
  pending_.erase(found);
  return round_trip;
}

std::vector<std::int64_t> SendWindow::restart() {
  std::vector<std::int64_t> lost;
  for (const auto& [sequence, pending] : pending_) lost.push_back(sequence);
  pending_.clear();
  next_ = 1;
  return lost;
}

}  // namespace cradle
