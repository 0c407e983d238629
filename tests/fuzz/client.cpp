// What a client believes of a world that lies: whole and damaged messages of the server, commands
// of its own, and time, in any order. It must keep its books: every ticket answered once, bodies in
// order and each the one it says, ticks finished in order.
#include <cradle/limits.h>
#include <cradle/version.h>

#include <limits>
#include <set>

#include "client/src/client_core.h"
#include "protocol/transport/in_process.h"
#include "tests/fuzz/input.h"

namespace cradle::fuzz {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kNumber = 7;  // of this client
constexpr int kTurnsMax = 512;
const Channels kChannels("w");

/// Messages of a server: mostly plausible ones.
class Liar {
 public:
  explicit Liar(Input& input) : in_(input) {}

  std::pair<MessageKind, Bytes> message() {
    switch (in_.below(4)) {
      case 0:
        return {MessageKind::status, encode(status())};
      case 1:
        return {MessageKind::receipts,
                encode(Receipts{epoch(), list([this] { return receipt(); })})};
      case 2:
        return {MessageKind::states, encode(chunk())};
      default:
        return {MessageKind::events,
                encode(Events{epoch(), small(), list([this] { return event(); })})};
    }
  }

 private:
  template <class Make>
  std::vector<std::invoke_result_t<Make>> list(Make make) {
    std::vector<std::invoke_result_t<Make>> items(in_.below(4));
    for (auto& item : items) item = make();
    return items;
  }

  std::int64_t small(std::size_t end = 16) {
    if (in_.one_in(32)) return in_.any<std::int64_t>() & limits::kIntegerMax;
    return static_cast<std::int64_t>(in_.below(end));
  }
  std::int64_t epoch() { return 1 + static_cast<std::int64_t>(in_.one_in(16) ? in_.below(12) : 0); }
  std::int32_t any_int() { return in_.any<std::int32_t>() & std::numeric_limits<int>::max(); }
  std::string name() {
    return in_.one_in(2) ? "" : std::string(1, static_cast<char>('a' + in_.below(3)));
  }

  WorldStatus status() {
    WorldStatus s;
    s.protocol_version = in_.one_in(16) ? any_int() : kProtocolVersion;
    s.epoch = epoch();
    s.tick = small();
    s.tick_time_us = small();
    s.rate_hz = in_.one_in(4) ? in_.any<double>() : 60;
    s.state_port = in_.one_in(16) ? any_int() : 7668;
    s.datagram_bytes = in_.one_in(16) ? any_int() : limits::kNetworkDatagramBytes;
    return s;
  }
  Receipt receipt() {
    Receipt r;
    r.client = in_.one_in(8) ? small() : kNumber;
    r.sequence = small();
    r.tick = small();
    r.outcome = {static_cast<Result>(in_.one_in(4) ? in_.below(42) : in_.below(2)), {small()}, 0};
    return r;
  }
  StateChunk chunk() {
    StateChunk c;
    c.epoch = epoch();
    c.tick = small();
    c.tick_time_us = small();
    c.chunks = in_.one_in(16) ? any_int() : 1 + static_cast<std::int32_t>(in_.below(3));
    c.chunk = in_.one_in(16) ? any_int() : static_cast<std::int32_t>(in_.below(3));
    c.first_body = {1 + small(4)};
    c.last_body = {small() + c.first_body.value};
    std::int64_t id = c.first_body.value - 1;
    c.states = list([&] {
      BodyState s;
      s.body = {id += 1 + small(3)};
      s.p_WBo.x = in_.any<std::int8_t>();
      return s;
    });
    return c;
  }
  Event event() {
    Event e;
    e.kind = static_cast<EventKind>(in_.below(6));
    e.body = {1 + small()};
    e.name = name();
    return e;
  }

  Input& in_;
};

class Run {
 public:
  explicit Run(Input input)
      : in_(input),
        core_("w", "fuzzer", control_.join(), [this](int port) { return open_states(port); },
              {kNumber, 1}) {
    core_.callbacks.on_answer = [this](Ticket ticket, const Answer&) {
      require(waiting_.erase(ticket.number) == 1, "every ticket is answered once");
    };
    core_.callbacks.on_tick = [this](Tick tick) {
      require(tick >= 0, "a tick is one");
      ++callbacks_;
    };
    core_.callbacks.on_event = [this](const Event&) { ++callbacks_; };
    core_.callbacks.on_restart = [this](std::int64_t) { ++callbacks_; };
  }

  void go() {
    for (int i = 0; i < kTurnsMax && !in_.is_empty(); ++i) {
      switch (in_.below(8)) {
        case 0:
        case 1:
          poll();
          break;
        case 2:
          submit();
          break;
        case 3:
          answer_honestly();
          break;
        default:
          lie();
      }
    }
    poll();
  }

 private:
  OpenedTransport open_states(int port) {
    if (port < 1024 || port > 65535) return {nullptr, Result::no_network, "no such port"};
    return {states_.join(), Result::ok, ""};
  }

  void lie() {
    auto [kind, payload] = liar_.message();
    if (in_.one_in(8)) payload[in_.any<std::uint16_t>() % payload.size()] = in_.any<std::uint8_t>();
    if (in_.one_in(16)) payload.resize(in_.any<std::uint8_t>());
    Transport& port = kind == MessageKind::states ? *server_states_ : *server_control_;
    port.send(kChannels.name(kind), payload);
  }

  /// What the client has sent is answered with ok.
  void answer_honestly() {
    Receipts receipts{core_.epoch(), {}};
    server_control_->receive(0us, [&](std::string_view channel, ByteView payload) {
      const auto kind = kChannels.kind(channel);
      const auto header = kind ? peek_header(*kind, payload) : std::nullopt;
      if (header) receipts.receipts.push_back({header->client, header->sequence, 1, {}});
    });
    if (core_.epoch() != 0)
      server_control_->send(kChannels.name(MessageKind::receipts), encode(receipts));
  }

  void submit() {
    CommandBody body = Despawn{{{1 + static_cast<std::int64_t>(in_.below(8))}}};
    if (in_.one_in(2)) body = SetGravity{{0, 0, in_.any<double>()}};
    const Tick target = in_.one_in(4) ? in_.any<std::int64_t>() : 0;
    // Told in the next poll, but refused ones are known at once.
    waiting_.insert(++tickets_);
    const Ticket ticket = core_.submit(std::move(body), target, now_);
    require(ticket.number == tickets_, "tickets are numbered");
  }

  void poll() {
    now_ += std::chrono::milliseconds(in_.one_in(8) ? 40 * in_.any<std::uint8_t>() : 17);
    core_.poll(now_);
    server_control_->receive(0us, [](auto, auto) {});
    server_states_->receive(0us, [](auto, auto) {});
    for (const std::int64_t ticket : waiting_) {
      require(!core_.answer({ticket, Result::ok}), "an answer is told");
    }
    check_bodies();
  }

  void check_bodies() const {
    std::int64_t last = 0;
    for (const BodyView& view : core_.mirror().bodies()) {
      require(view.state.body.value > last, "bodies are in the order of ids, each once");
      last = view.state.body.value;
      require(core_.mirror().find(view.state.body) == &view, "a body is found");
    }
    for (const char* name : {"a", "b", "c"}) {
      const BodyId body = core_.mirror().find_by_name(name);
      const Event* const about = body ? core_.mirror().about(body) : nullptr;
      require(!body || (about != nullptr && about->name == name), "a name is that of its body");
    }
  }

  Input in_;
  Liar liar_{in_};
  InProcessBus control_, states_;
  std::unique_ptr<Transport> server_control_ = control_.join();
  std::unique_ptr<Transport> server_states_ = states_.join();
  ClientCore core_;
  ClientCore::Time now_{};
  std::set<std::int64_t> waiting_;  ///< tickets
  std::int64_t tickets_ = 0;
  std::int64_t callbacks_ = 0;
};

}  // namespace
}  // namespace cradle::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cradle::fuzz::Run(cradle::fuzz::Input({data, size})).go();
  return 0;
}
