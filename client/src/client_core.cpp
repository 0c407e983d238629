#include "client/src/client_core.h"

#include <cradle/limits.h>
#include <cradle/version.h>

#include <random>
#include <utility>

#include "protocol/validate.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;

constexpr ClientCore::Duration kKeepAlive = 2s;  // the server forgets a client after 10 s
constexpr ClientCore::Duration kPerhapsForgotten = 5s;
constexpr ClientCore::Duration kAskPause = 250ms;
constexpr std::size_t kAnswersKept = 4096;
constexpr std::size_t kPastEpochsKept = 8;
constexpr std::size_t kOtherWorldsKept = 8;

std::int64_t random_client_number() {
  std::random_device device;
  return std::uniform_int_distribution<std::int64_t>(1, limits::kIntegerMax)(device);
}

}  // namespace

ClientCore::ClientCore(const std::string& world, std::string name,
                       std::unique_ptr<Transport> control, OpenStates open_states,
                       const Identity& identity)
    : channels_(world),
      fixed_number_(identity.number),
      is_spectator_(identity.is_spectator),
      name_(std::move(name)),
      control_(std::move(control)),
      open_states_(std::move(open_states)),
      window_(identity.first_sequence) {}

// --- sending ----------------------------------------------------------------------------------

Ticket ClientCore::submit(CommandBody body, Tick target_tick, Time now) {
  now_ = now;
  Ticket ticket{++last_ticket_, Result::ok};
  const Outcome fault = check(body, target_tick);
  if (fault.result != Result::ok) {
    ticket.refused = fault.result;
    resolve(ticket, {fault.result, {}, fault.item, 0});
    return ticket;
  }
  const bool is_perhaps_forgotten = now_ - sent_at_ >= kPerhapsForgotten;
  if (welcome_ == Welcome::forgotten || (welcome_ == Welcome::given && is_perhaps_forgotten)) {
    say_hello();
  }
  enqueue(ticket.number, std::move(body), target_tick);
  transmit();
  return ticket;
}

Outcome ClientCore::check(const CommandBody& body, Tick target_tick) const {
  const auto refused = [](Result result) { return Outcome{result, {}, 0}; };
  if (is_recording()) return refused(Result::recording);
  if (is_spectator_) return refused(Result::not_allowed);
  if (epoch_ == 0) return refused(Result::no_world);
  if (welcome_ == Welcome::unseen) return refused(Result::bad_version);
  if (is_contested()) return refused(Result::contested);
  if (target_tick < 0 || target_tick > limits::kIntegerMax) return refused(Result::out_of_range);
  if (const Outcome fault = validate(body); fault.result != Result::ok) return fault;
  const int room = items_per_datagram(kind_of(body), status_.datagram_bytes);
  if (item_count(body) > room) return refused(Result::too_large);
  return refused(window_.has_room() ? Result::ok : Result::over_window);
}

void ClientCore::say_hello() {
  welcome_ = Welcome::asked;
  hello_sequence_ = window_.next_sequence();
  enqueue(0, Hello{kProtocolVersion, name_}, 0);
}

void ClientCore::enqueue(std::int64_t ticket, CommandBody body, Tick target_tick) {
  const MessageKind kind = kind_of(body);
  const std::int64_t sequence = window_.next_sequence();
  sent_[sequence] = {ticket, false};
  window_.add(kind, encode({{client_, sequence, epoch_, target_tick}, std::move(body)}), now_);
  ++counted_.commands_sent;
}

void ClientCore::transmit() {
  window_.note_tick(tick(), now_);
  counted_.resends += window_.send_due(now_, [this](MessageKind kind, ByteView payload) {
    control_->send(channels_.name(kind), payload);
    sent_at_ = now_;
  });
}

void ClientCore::keep_alive() {
  const bool is_known = welcome_ == Welcome::given && !is_spectator_;
  if (is_known && now_ - sent_at_ >= kKeepAlive) repeat_hello();
}

/// Says hello once more under the last number used: to a server that knows us a repetition, to one
/// that has forgotten us a beginning from which our next number follows.
void ClientCore::repeat_hello() {
  const std::int64_t last = window_.next_sequence() - 1;
  if (window_.is_pending(last)) return window_.ask_again(last, now_);  // that says as much
  const CommandHeader header{client_, last, epoch_, 0};
  control_->send(channels_.name(MessageKind::hello),
                 encode({header, Hello{kProtocolVersion, name_}}));
  sent_at_ = now_;
}

/// Another epoch is heard. It may be the server's next run, which answers that ours is over, or a
/// recording played back, or a second server, which do not.
void ClientCore::ask_whether_gone() {
  ++counted_.strangers;
  if (welcome_ != Welcome::given || is_spectator_ || now_ - asked_at_ < kAskPause) return;
  asked_at_ = now_;
  repeat_hello();
}

// --- receiving --------------------------------------------------------------------------------

int ClientCore::poll(Time now) {
  if (is_in_callback_) return 0;
  now_ = now;
  messages_ = 0;
  control_->receive(0us, [this](auto channel, auto payload) { receive_control(channel, payload); });
  if (states_) {
    states_->receive(0us, [this](auto channel, auto payload) { receive_states(channel, payload); });
  }
  transmit();
  keep_alive();
  for (Tick tick : mirror_.take_finished_ticks()) {
    if (callbacks.on_tick) notices_.push_back(FinishedTick{tick});
  }
  run_callbacks();
  return messages_;
}

void ClientCore::receive_control(std::string_view channel, ByteView payload) {
  const auto take_if_whole = [this](const auto& message) {
    message ? take(*message) : void(++counted_.datagrams_rejected);
  };
  const auto kind = channels_.kind(channel);
  if (kind == MessageKind::status) {
    const auto status = decode_status(payload);
    has_heard_other_protocol_ |= !status || status->protocol_version != kProtocolVersion;
    take_if_whole(status);
  } else if (kind == MessageKind::receipts) {
    take_if_whole(decode_receipts(payload));
  } else if (kind == MessageKind::events) {
    take_if_whole(decode_events(payload));
  } else if (kind == MessageKind::states && is_recording()) {
    take_states(payload);
  } else if (!kind) {
    note_other_world(channel);
  }
}

void ClientCore::receive_states(std::string_view channel, ByteView payload) {
  if (channels_.kind(channel) == MessageKind::states) take_states(payload);
}

void ClientCore::take_states(ByteView payload) {
  const auto chunk = decode_states(payload);
  if (chunk && chunk->epoch != epoch_) {
    if (!is_recording() || is_past(chunk->epoch)) return;
    meet(chunk->epoch);  // the recording of a state port alone tells no other way
  }
  if (!chunk || !mirror_.take(*chunk, now_)) {
    ++counted_.datagrams_rejected;
    return;
  }
  if (is_recording()) heartbeat_at_ = now_;
  ++messages_;
}

void ClientCore::note_other_world(std::string_view channel) {
  constexpr std::string_view kBefore = "CRADLE_", kAfter = "_STATUS";
  if (!channel.starts_with(kBefore) || !channel.ends_with(kAfter)) return;
  if (other_worlds_.size() >= kOtherWorldsKept || channel.size() < kBefore.size() + kAfter.size()) {
    return;
  }
  channel.remove_prefix(kBefore.size());
  channel.remove_suffix(kAfter.size());
  if (is_world_name(channel)) other_worlds_.emplace(channel);
}

void ClientCore::take(const WorldStatus& status) {
  const bool is_stranger = status.epoch != epoch_ && is_alive();
  if (is_stranger && !is_recording()) return ask_whether_gone();
  if (is_stranger && is_past(status.epoch)) return;
  ++messages_;
  status_ = status;
  heartbeat_at_ = now_;
  if (!is_recording()) open_states_at(status.state_port);  // before hello, to miss nothing
  if (status.epoch != epoch_) enter(status.epoch);
}

/// Stragglers: not listened to while the present epoch lives.
bool ClientCore::is_past(std::int64_t epoch) const {
  return is_alive() &&
         std::find(past_epochs_.begin(), past_epochs_.end(), epoch) != past_epochs_.end();
}

/// A server of an epoch that we have left for the present one answers: both live.
void ClientCore::note_rival() {
  has_rival_ = true;
  rival_heard_at_ = now_;
}

/// Enters an epoch that something else than its heartbeat told.
void ClientCore::meet(std::int64_t epoch) {
  status_.tick = 0;
  status_.tick_time_us = 0;
  enter(epoch);
}

void ClientCore::enter(std::int64_t epoch) {
  if (epoch_ != 0) {
    leave();
    if (callbacks.on_restart) notices_.push_back(Restarted{epoch});
  }
  epoch_ = epoch;
  if (is_recording()) return;
  if (is_spectator_) {
    welcome_ = Welcome::given;
    return;
  }
  client_ = fixed_number_ != 0 ? fixed_number_ : random_client_number();
  welcome_ = Welcome::unseen;
  if (status_.protocol_version == kProtocolVersion) say_hello();
}

void ClientCore::leave() {
  past_epochs_.push_back(epoch_);
  if (past_epochs_.size() > kPastEpochsKept) past_epochs_.pop_front();
  for (const auto& [sequence, sent] : std::exchange(sent_, {})) {
    if (sent.ticket != 0) resolve({sent.ticket, Result::ok}, {Result::world_restarted, {}, 0, 0});
  }
  window_.restart();
  mirror_.clear();
  ++counted_.restarts;
}

void ClientCore::open_states_at(int port) {
  if (states_ && port == state_port_) return;
  OpenedTransport opened = open_states_(port);
  states_ = std::move(opened.transport);
  states_fault_ = std::move(opened.message);
  state_port_ = port;
}

void ClientCore::take(const Receipts& receipts) {
  if (epoch_ == 0 || is_recording()) return;
  for (const Receipt& receipt : receipts.receipts) {
    if (receipt.client != client_) continue;
    if (receipts.epoch == epoch_) {
      take(receipt);
    } else if (is_past(receipts.epoch) && fixed_number_ == 0) {
      note_rival();
    } else if (is_new_run(receipts.epoch)) {
      return meet(receipts.epoch);
    }
  }
}

/// True if a receipt of that epoch, for our number, shows that the server runs anew: nobody else
/// knows a random number. A fixed one may be in a recording, too.
bool ClientCore::is_new_run(std::int64_t epoch) const {
  return fixed_number_ == 0 || !is_alive() || (welcome_ != Welcome::given && !is_past(epoch));
}

void ClientCore::take(const Receipt& receipt) {
  ++messages_;
  const Result result = receipt.outcome.result;
  if (result == Result::unknown_client) {
    // It overtook our hello: no answer, it will be sent again.
    if (welcome_ == Welcome::asked && receipt.sequence > hello_sequence_) return;
    if (welcome_ == Welcome::given) say_hello();
  }
  const auto found = sent_.find(receipt.sequence);
  if (found == sent_.end()) return;  // a repetition
  if (result == Result::queued) found->second.is_for_later = true;
  const auto round_trip = window_.answer(receipt, now_);
  if (!round_trip) return;

  const Sent sent = found->second;
  sent_.erase(found);
  ++counted_.answers;
  if (!sent.is_for_later) {
    counted_.round_trip_last_s = std::chrono::duration<double>(*round_trip).count();
    counted_.round_trip_max_s = std::max(counted_.round_trip_max_s, counted_.round_trip_last_s);
  }
  if (sent.ticket == 0) {
    hello_result_ = result;
    welcome_ = result == Result::ok ? Welcome::given : Welcome::forgotten;
  } else {
    resolve({sent.ticket, Result::ok},
            {result, receipt.outcome.body, receipt.outcome.item, receipt.tick});
  }
}

void ClientCore::take(const Events& batch) {
  if (batch.epoch != epoch_) {
    if (!is_recording() || is_past(batch.epoch)) return;
    meet(batch.epoch);
  }
  ++messages_;
  const auto fresh = mirror_.take(batch);
  if (callbacks.on_event) notices_.insert(notices_.end(), fresh.begin(), fresh.end());
}

// --- answers, callbacks, counters -------------------------------------------------------------

void ClientCore::resolve(Ticket ticket, const Answer& answer) {
  answers_.emplace(ticket.number, answer);
  answered_.push_back(ticket.number);
  if (answered_.size() > kAnswersKept) {
    answers_.erase(answered_.front());
    answered_.pop_front();
  }
  if (callbacks.on_answer) notices_.push_back(Answered{ticket, answer});
}

std::optional<Answer> ClientCore::answer(Ticket ticket) const {
  const auto found = answers_.find(ticket.number);
  return found == answers_.end() ? std::nullopt : std::optional(found->second);
}

/// Only what there was at the start: a callback whose command is refused would never let us end.
void ClientCore::run_callbacks() {
  is_in_callback_ = true;
  for (std::size_t left = notices_.size(); left > 0; --left) {
    const Notice notice = std::move(notices_.front());
    notices_.pop_front();
    try {
      run(notice);
    } catch (const std::exception& error) {
      ++counted_.callback_exceptions;
      last_callback_error_ = error.what();
    } catch (...) {
      ++counted_.callback_exceptions;
      last_callback_error_ = "an exception that is not a std::exception";
    }
  }
  is_in_callback_ = false;
}

void ClientCore::run(const Notice& notice) {
  if (const auto* event = std::get_if<Event>(&notice)) {
    callbacks.on_event(*event);
  } else if (const auto* answered = std::get_if<Answered>(&notice)) {
    callbacks.on_answer(answered->ticket, answered->answer);
  } else if (const auto* finished = std::get_if<FinishedTick>(&notice)) {
    callbacks.on_tick(finished->tick);
  } else {
    callbacks.on_restart(std::get<Restarted>(notice).epoch);
  }
}

bool ClientCore::is_alive() const {
  return epoch_ != 0 && now_ - heartbeat_at_ < kHeartbeatTimeout;
}

BatchLimits ClientCore::batch_limits() const {
  const auto limit = [this](MessageKind kind) {
    return items_per_datagram(kind, status_.datagram_bytes);
  };
  return {limit(MessageKind::spawn), limit(MessageKind::despawn), limit(MessageKind::push),
          limit(MessageKind::clear_wrenches), limit(MessageKind::set_motion)};
}

ClientStatistics ClientCore::statistics() const {
  ClientStatistics all = counted_;
  all.round_trip_smoothed_s = std::chrono::duration<double>(window_.round_trip()).count();
  const auto add = [&all](const TransportStats& port) {
    all.datagrams_received += port.received;
    all.datagrams_rejected += port.rejected();
    all.datagrams_dropped += port.dropped_by_kernel;
    all.send_failures += port.send_failures;
  };
  add(control_->stats());
  if (states_) {
    add(states_->stats());
    all.receive_buffer_bytes = states_->stats().receive_buffer_bytes;
  }
  const auto& seen = mirror_.counters();
  all.chunks_received = seen.chunks_received;
  all.chunks_lost = seen.chunks_lost;
  all.chunks_stale = seen.chunks_stale;
  all.events_received = seen.events_received;
  all.events_lost = seen.events_lost;
  all.tick_jitter_s = seen.tick_jitter_s;
  return all;
}

}  // namespace cradle
