#include "server/command_desk.h"

#include <cradle/limits.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "protocol/validate.h"

namespace cradle {
namespace {

constexpr std::int64_t kSilence_us = 10'000'000;  // a client that lives is heard every two seconds

/// What stands for a command that cannot be decoded, so that its client's sequence goes on: an
/// empty list, which is answered `malformed` when its turn comes.
Command unreadable(const CommandHeader& header) {
  return {{header.client, header.sequence, header.epoch, 0}, Despawn{}};
}

/// A step may be what a full world waits for.
bool may_find_no_room(const CommandBody& body) {
  return !std::holds_alternative<Hello>(body) && !std::holds_alternative<Control>(body);
}

}  // namespace

void CommandDesk::admit(Inbox::Contents&& contents, Tick coming_tick, std::int64_t now_us) {
  for (const CommandHeader& header : contents.overflow) refuse(header, Result::busy);
  for (const RawCommand& raw : contents.commands) {
    auto command = decode_command(raw.kind, raw.payload);
    if (command) {
      admit_one(std::move(*command), coming_tick, now_us);
    } else {
      ++malformed_;
      const auto header = peek_header(raw.kind, raw.payload);
      if (header && sessions_.contains(header->client)) {
        admit_one(unreadable(*header), coming_tick, now_us);
      }
    }
  }
}

void CommandDesk::admit_one(Command&& command, Tick coming_tick, std::int64_t now_us) {
  const CommandHeader header = command.header;
  const bool is_hello = std::holds_alternative<Hello>(command.body);
  const bool is_welcome_anywhere = is_hello && header.epoch == 0;
  if (header.epoch != epoch_ && !is_welcome_anywhere) return refuse(header, Result::wrong_epoch);
  auto found = sessions_.find(header.client);
  if (found == sessions_.end()) {
    return is_hello ? greet(std::move(command), now_us) : refuse(header, Result::unknown_client);
  }
  Session& session = found->second;
  if (is_hello && session.window.is_beyond(header.sequence)) begin_anew(session, command);
  session.heard_us = now_us;
  if (session.window.is_new(header.sequence)) {
    const std::int64_t bytes = encoded_size(command.body);
    const bool has_room = waiting_bytes_ + bytes <= limits::kWaitingBytes;
    if (!has_room && may_find_no_room(command.body)) return refuse(header, Result::busy);
    waiting_bytes_ += bytes;
  }
  const auto verdict = session.window.arrive(std::move(command));
  using Kind = ReceiveWindow::Verdict::Kind;
  if (verdict.kind == Kind::answered) {
    const Result result = verdict.receipt.outcome.result;
    if (result == Result::gap || result == Result::expired) {
      refuse(header, result);
    } else {
      ++repeated_;
      outgoing_.push_back(verdict.receipt);
    }
  }
  if (verdict.kind == Kind::held && header.sequence > session.window.next()) {
    count(Result::held);
    outgoing_.push_back({header.client, header.sequence, 0, {Result::held, {}, 0}});
  }
  while (auto next = session.window.take_next()) accept(session, std::move(*next), coming_tick);
}

/// A hello opens a session, whose first command it is.
void CommandDesk::greet(Command&& command, std::int64_t now_us) {
  const CommandHeader header = command.header;
  const auto& hello = std::get<Hello>(command.body);
  const Result fault = validate(command.body).result;
  if (fault != Result::ok) return refuse(header, fault);
  if (!make_room(now_us)) {
    turned_away_.push_back(hello.name);
    return refuse(header, Result::over_quota);
  }
  newcomers_.push_back(hello.name);
  waiting_bytes_ += encoded_size(command.body);
  Session session{hello.name, ReceiveWindow(header.sequence), now_us, 0};
  session.window.arrive(std::move(command));
  waiting_.emplace(Key{0, header.client, header.sequence}, *session.window.take_next());
  sessions_.emplace(header.client, std::move(session));
}

/// The client's program was started again and keeps its number: its earlier run's commands for
/// later ticks still happen, those behind a gap will never be complete.
void CommandDesk::begin_anew(Session& session, const Command& hello) {
  forget_held(session);
  session.name = std::get<Hello>(hello.body).name;
  session.window = ReceiveWindow(hello.header.sequence);
  newcomers_.push_back(session.name);
}

void CommandDesk::forget_held(const Session& session) {
  for (const auto& [sequence, command] : session.window.held()) {
    waiting_bytes_ -= encoded_size(command.body);
  }
}

/// The command's turn in its client's sequence has come: it waits for its tick, or is refused.
void CommandDesk::accept(Session& session, Command&& command, Tick coming_tick) {
  const CommandHeader header = command.header;
  const Tick target = header.target_tick;
  const auto fault = [&] {
    if (target == 0) return Result::ok;
    if (target < coming_tick) return Result::late;
    if (target > coming_tick + limits::kTicksAhead) return Result::too_far_ahead;
    return session.queued < limits::kQueuedCommands ? Result::ok : Result::over_quota;
  }();
  if (fault != Result::ok) {
    waiting_bytes_ -= encoded_size(command.body);
    return answer(header, {fault, {}, 0}, 0);
  }
  if (target != 0) {
    ++session.queued;
    answer(header, {Result::queued, {}, 0}, target);
  }
  waiting_.emplace(Key{target, header.client, header.sequence}, std::move(command));
}

std::vector<Command> CommandDesk::take_due(Tick coming_tick, bool is_stepping) {
  std::vector<Command> due;
  const auto take = [&](auto begin, auto end) {
    for (auto entry = begin; entry != end; ++entry) {
      if (std::get<0>(entry->first) != 0) --sessions_.at(entry->second.header.client).queued;
      waiting_bytes_ -= encoded_size(entry->second.body);
      due.push_back(std::move(entry->second));
    }
    return waiting_.erase(begin, end);
  };
  const auto targeted = take(waiting_.begin(), waiting_.lower_bound(Key{1, 0, 0}));
  if (is_stepping) take(targeted, waiting_.lower_bound(Key{coming_tick + 1, 0, 0}));
  std::sort(due.begin(), due.end(), [](const Command& a, const Command& b) {
    return std::pair(a.header.client, a.header.sequence) <
           std::pair(b.header.client, b.header.sequence);
  });
  return due;
}

void CommandDesk::answer(const CommandHeader& header, const Outcome& outcome, Tick tick) {
  count(outcome.result);
  const Receipt receipt{header.client, header.sequence, tick, outcome};
  outgoing_.push_back(receipt);
  const auto session = sessions_.find(header.client);
  if (session != sessions_.end()) session->second.window.keep(receipt);
}

/// Refused without being taken: its sequence number stays free.
void CommandDesk::refuse(const CommandHeader& header, Result result) {
  count(result);
  outgoing_.push_back({header.client, header.sequence, 0, {result, {}, 0}});
}

/// Room for one more session, if need be that of the client that has been silent longest, of those
/// for whom nothing is queued.
bool CommandDesk::make_room(std::int64_t now_us) {
  if (sessions_.size() < static_cast<std::size_t>(limits::kClients)) return true;
  const auto rank = [](const Session& s) { return std::pair(s.queued > 0, s.heard_us); };
  const auto oldest = std::min_element(
      sessions_.begin(), sessions_.end(),
      [&](const auto& a, const auto& b) { return rank(a.second) < rank(b.second); });
  if (now_us - oldest->second.heard_us < kSilence_us || oldest->second.queued > 0) return false;
  forget_held(oldest->second);
  sessions_.erase(oldest);
  return true;
}

std::int64_t CommandDesk::refused() const {
  const std::int64_t all = std::accumulate(answered_.begin(), answered_.end(), std::int64_t{0});
  return all - answered(Result::ok) - answered(Result::queued) - answered(Result::held);
}

std::int64_t CommandDesk::clients(std::int64_t now_us) const {
  return std::count_if(sessions_.begin(), sessions_.end(), [&](const auto& entry) {
    return now_us - entry.second.heard_us <= kSilence_us;
  });
}

}  // namespace cradle
