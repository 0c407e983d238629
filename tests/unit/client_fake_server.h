/// The server's side of the wire, played by a test through the real codec: it says what the test
/// tells it to say, and shows what the client sent. Time stands still unless the test moves it.
#pragma once

#include <cradle/limits.h>
#include <cradle/version.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/src/client_impl.h"
#include "protocol/transport/in_process.h"

namespace cradle::test {

class FakeServer {
 public:
  FakeServer() {
    status.protocol_version = kProtocolVersion;
    status.epoch = 7001;
    status.rate_hz = 100;
    status.datagram_bytes = 1400;
    status.state_port = 7668;
    status.name = "arena";
  }

  WorldStatus status;
  std::vector<int> opened_ports;  ///< of states, by clients

  std::unique_ptr<Transport> control_end() { return control_bus_.join(); }
  ClientCore::OpenStates states_opener() {
    return [this](int port) {
      opened_ports.push_back(port);
      return OpenedTransport{state_bus_.join(), Result::ok, ""};
    };
  }

  void heartbeat() { say(MessageKind::status, encode(status)); }
  void answer(const CommandHeader& to, const Outcome& outcome, Tick tick = 0) {
    receipts({{to.client, to.sequence, tick, outcome}});
  }
  void receipts(std::vector<Receipt> list) {
    say(MessageKind::receipts, encode(Receipts{status.epoch, std::move(list)}));
  }
  void events(std::int64_t first, std::vector<Event> list) {
    say(MessageKind::events, encode(Events{status.epoch, first, std::move(list)}));
  }
  void chunk(StateChunk chunk) {
    chunk.epoch = status.epoch;
    states_->send(channels_.name(MessageKind::states), encode(chunk));
  }
  void say(MessageKind kind, const Bytes& payload) {
    control_->send(channels_.name(kind), payload);
  }
  void say_on(const std::string& channel) { control_->send(channel, encode(status)); }

  /// What clients have sent since the last call.
  std::vector<Command> heard() {
    std::vector<Command> commands;
    control_->receive(std::chrono::microseconds(0), [&](auto channel, auto payload) {
      const auto kind = channels_.kind(channel);
      if (!kind || !is_command(*kind)) return;
      auto command = decode_command(*kind, payload);
      commands.push_back(std::move(command.value()));
    });
    return commands;
  }

 private:
  InProcessBus control_bus_;
  InProcessBus state_bus_;
  std::unique_ptr<Transport> control_ = control_bus_.join();
  std::unique_ptr<Transport> states_ = state_bus_.join();
  Channels channels_{"arena"};
};

/// A client of the fake server's world "arena", on a clock of its own.
struct Visit {
  FakeServer server;
  ClientCore core{"arena", "tester", server.control_end(), server.states_opener()};
  ClientCore::Time now{std::chrono::hours(1)};

  int poll(std::chrono::milliseconds later = std::chrono::milliseconds(0)) {
    now += later;
    return core.poll(now);
  }

  /// As the server does while it lives: a heartbeat every half second.
  void live_for(std::chrono::milliseconds duration) {
    for (; duration > std::chrono::milliseconds(0); duration -= std::chrono::milliseconds(500)) {
      server.heartbeat();
      poll(std::chrono::milliseconds(500));
    }
  }

  /// Heartbeat, hello, and its receipt; gives the hello.
  CommandHeader be_welcomed() {
    server.heartbeat();
    poll();
    const CommandHeader hello = server.heard().at(0).header;
    server.answer(hello, {});
    poll();
    return hello;
  }

  Ticket submit(CommandBody body, Tick target = 0) {
    return core.submit(std::move(body), target, now);
  }
  Ticket submit_gravity() { return submit(SetGravity{{0, 0, -1}}); }

  /// Submits a command that the server hears; gives its header.
  CommandHeader send() {
    submit_gravity();
    return server.heard().at(0).header;
  }
};

/// What games hold: a client of `server` on the real clock, welcomed.
inline std::unique_ptr<Client> connected_client(FakeServer& server) {
  auto impl = std::make_unique<Client::Impl>("arena", "tester", server.control_end(),
                                             server.states_opener());
  server.heartbeat();
  impl->poll(std::chrono::milliseconds(0));
  server.answer(server.heard().at(0).header, {});
  return introduce(std::move(impl), "arena", "the test", std::chrono::seconds(10)).client;
}

inline BodySpec ball() {
  BodySpec spec;
  spec.shape = Shape::sphere(0.5);
  return spec;
}

inline BodyState state_of(std::int64_t body, double x = 0) {
  BodyState state;
  state.body = {body};
  state.p_WBo.x = x;
  return state;
}

/// A chunk about the ids `first` .. `last`; the only one of its tick unless told otherwise.
inline StateChunk chunk_of(Tick tick, std::int64_t first, std::int64_t last,
                           std::vector<BodyState> states, int chunk = 0, int chunks = 1) {
  StateChunk all;
  all.tick = tick;
  all.tick_time_us = tick * 10'000;
  all.chunk = chunk;
  all.chunks = chunks;
  all.first_body = {first};
  all.last_body = {last};
  all.states = std::move(states);
  return all;
}

}  // namespace cradle::test
