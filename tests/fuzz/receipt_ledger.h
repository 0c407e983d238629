/// What CommandDesk must answer, told a second time and more simply: every receipt is foreseen, and
/// every command taken is answered for good once.
#pragma once

#include <cradle/limits.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "protocol/validate.h"
#include "tests/fuzz/input.h"

namespace cradle::fuzz {

class ReceiptLedger {
 public:
  explicit ReceiptLedger(std::int64_t epoch) : epoch_(epoch) {}

  /// A datagram is handed to the desk.
  void arrives(MessageKind kind, ByteView payload, Tick coming_tick) {
    if (const auto command = decode_command(kind, payload)) {
      take(*command, coming_tick);
    } else if (const auto header = peek_header(kind, payload);
               header && clients_.contains(header->client)) {
      // It has its turn as any other, and is answered `malformed` then.
      take({{header->client, header->sequence, header->epoch, 0}, Despawn{}}, coming_tick);
    }
  }

  /// The desk has handed it out: it must be one whose turn it is, and which has no answer yet.
  void is_due(const CommandHeader& header, Tick coming_tick, bool is_stepping) {
    Client& client = clients_.at(header.client);
    const auto open = client.open.find(header.sequence);
    require(open != client.open.end(), "what is due was taken, and has no final answer");
    const bool is_time =
        open->second.target == 0 || (is_stepping && open->second.target <= coming_tick);
    require(is_time && !open->second.is_due, "a command is due once, in its tick");
    open->second.is_due = true;
  }

  /// The answer that the world gave.
  void is_answered(const CommandHeader& header, const Outcome& outcome, Tick tick) {
    foresee_answer(header, outcome, tick);
  }

  /// All of what was foreseen has been sent, and nothing else.
  void compare(std::vector<Receipt> sent) {
    const auto key = [](const Receipt& r) {
      return std::tuple(r.client, r.sequence, r.outcome.result, r.tick, r.outcome.body,
                        r.outcome.item);
    };
    const auto order = [&](const Receipt& a, const Receipt& b) { return key(a) < key(b); };
    std::sort(sent.begin(), sent.end(), order);
    std::sort(foreseen_.begin(), foreseen_.end(), order);
    require(sent == foreseen_, "the receipts sent are those foreseen");
    foreseen_.clear();
  }

  /// After the due ones have been answered, only those wait that must.
  void check_waiting(Tick tick) const {
    for (const auto& [number, client] : clients_) {
      for (const auto& [sequence, open] : client.open) {
        require(open.is_due ? open.is_step : open.target > tick,
                "only commands for later ticks, and steps, wait for their answer");
      }
    }
  }

 private:
  struct Open {
    Tick target = 0;
    bool is_due = false;
    bool is_step = false;            ///< its steps are being made
    std::optional<Receipt> receipt;  ///< `queued`
  };
  struct Client {
    std::int64_t first = 0;  ///< of its hello
    std::int64_t next = 0;
    std::map<std::int64_t, Command> held;
    std::map<std::int64_t, Open> open;  ///< taken, without a final answer
    std::map<std::int64_t, Receipt> final;
  };

  void foresee(const CommandHeader& header, Result result) {
    foreseen_.push_back({header.client, header.sequence, 0, {result, {}, 0}});
  }

  void take(const Command& command, Tick coming) {
    const CommandHeader& header = command.header;
    const bool is_hello = std::holds_alternative<Hello>(command.body);
    const bool is_for_any = is_hello && header.epoch == 0;
    if (header.epoch != epoch_ && !is_for_any) return foresee(header, Result::wrong_epoch);
    const auto known = clients_.find(header.client);
    if (known == clients_.end()) {
      return is_hello ? greet(command) : foresee(header, Result::unknown_client);
    }
    Client& client = known->second;
    const bool is_beyond = header.sequence >= client.next + limits::kHeldCommands;
    if (is_hello && is_beyond) begin_anew(client, header.sequence);
    if (header.sequence < client.next) return repeat(client, header);
    if (is_beyond && !is_hello) return foresee(header, Result::gap);
    if (header.sequence > client.next) foresee(header, Result::held);
    client.held.emplace(header.sequence, command);
    for (auto first = client.held.find(client.next); first != client.held.end();
         first = client.held.find(++client.next)) {
      open(client, first->second.header, coming);
      client.held.erase(first);
    }
  }

  void greet(const Command& command) {
    const Result fault = validate(command.body).result;
    if (fault != Result::ok) return foresee(command.header, fault);
    if (clients_.size() >= static_cast<std::size_t>(limits::kClients)) {
      return foresee(command.header, Result::over_quota);
    }
    Client& client = clients_[command.header.client];
    client.first = command.header.sequence;
    client.next = command.header.sequence + 1;
    client.open[command.header.sequence] = {};  // whatever its target
  }

  /// Its program was started again under its number: what waits still happens, but answers given
  /// before are not repeated.
  static void begin_anew(Client& client, std::int64_t sequence) {
    client.first = client.next = sequence;
    client.held.clear();
    client.final.clear();
  }

  void repeat(const Client& client, const CommandHeader& header) {
    if (header.sequence < client.first) return foresee(header, Result::superseded);
    if (const auto found = client.final.find(header.sequence); found != client.final.end()) {
      foreseen_.push_back(found->second);
    } else if (const auto& waits = client.open.at(header.sequence); waits.receipt) {
      foreseen_.push_back(*waits.receipt);
    }
  }

  void open(Client& client, const CommandHeader& header, Tick coming) {
    const Tick target = header.target_tick;
    client.open[header.sequence] = {target, false, false, std::nullopt};
    if (target == 0) return;
    if (target < coming) return foresee_answer(header, {Result::late, {}, 0}, 0);
    if (target > coming + limits::kTicksAhead) {
      return foresee_answer(header, {Result::too_far_ahead, {}, 0}, 0);
    }
    foresee_answer(header, {Result::queued, {}, 0}, target);
  }

  void foresee_answer(const CommandHeader& header, const Outcome& outcome, Tick tick) {
    Client& client = clients_.at(header.client);
    const Receipt receipt{header.client, header.sequence, tick, outcome};
    foreseen_.push_back(receipt);
    const auto waits = client.open.find(header.sequence);
    require(waits != client.open.end(), "a command is answered for good once");
    if (outcome.result == Result::queued) {
      waits->second.is_step = waits->second.is_due;
      waits->second.receipt = receipt;
    } else {
      client.open.erase(waits);
      client.final.emplace(header.sequence, receipt);
    }
  }

  std::int64_t epoch_;
  std::map<std::int64_t, Client> clients_;
  std::vector<Receipt> foreseen_;
};

}  // namespace cradle::fuzz
