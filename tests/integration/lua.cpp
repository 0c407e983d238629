// A second language on the wire: client/examples/hello.lua, as a process, through lcm-gen's Lua.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <map>
#include <regex>
#include <thread>

#include "protocol/transport/lcm_transport.h"
#include "tests/integration/daemon.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

std::vector<std::string> hello_lua() {
  ::setenv("CRADLE_LCM_URL", own_url().c_str(), 1);
  ::setenv("CRADLE_WORLD", "test", 1);
  ::setenv("LUA_PATH", CRADLE_BIN_DIR "/../generated/lua/?.lua;;", 1);
  return {"/usr/bin/lua5.2", CRADLE_SOURCE_DIR "/client/examples/hello.lua"};
}

/// What the lines that `pattern` matches have in its groups.
std::vector<std::vector<double>> numbers_in(const std::string& text, const std::string& pattern) {
  const std::regex line(pattern);
  std::vector<std::vector<double>> rows;
  for (std::sregex_iterator it(text.begin(), text.end(), line), end; it != end; ++it) {
    rows.emplace_back();
    for (std::size_t i = 1; i < it->size(); ++i) rows.back().push_back(std::stod((*it)[i]));
  }
  return rows;
}

/// The server's end of the wire, hard of hearing: it answers a command only when that has come so
/// many times, and with other words first.
class HardOfHearing {
 public:
  /// Answers until `is_over`.
  void serve(const std::function<bool()>& is_over) {
    while (!is_over()) {
      if (tick_ % 100 == 0) control_->send(channels_.name(MessageKind::status), encode(status()));
      std::this_thread::sleep_for(5ms);
      control_->receive(0ms, [this](auto channel, auto payload) { hear(channel, payload); });
      StateChunk chunk;
      chunk.epoch = kEpoch;
      chunk.tick = ++tick_;
      chunk.first_body = {1};
      chunk.last_body = {kLastId};
      if (has_body_) chunk.states.emplace_back().body = {kBody};
      states_->send(channels_.name(MessageKind::states), encode(chunk));
    }
  }

  struct Heard {
    Command command;
    Bytes bytes;
    int times = 0;
  };
  std::map<std::int64_t, Heard> heard;  ///< by sequence
  bool has_changed = false;             ///< a repetition was not the same

  static constexpr std::int64_t kEpoch = 9'007'199'254'740'991;  // 2^53 - 1
  static constexpr std::int64_t kBody = 9'007'199'254'740'990;
  static constexpr int kTimes = 4;

 private:
  static constexpr std::int64_t kLastId = 9'007'199'254'740'991;

  static OpenedTransport open(int ports_further) {
    LcmUrl url = *parse_lcm_url(own_url());
    url.port += ports_further;
    return open_lcm_transport(url, Lane::send_and_receive);
  }

  static WorldStatus status() {
    WorldStatus status;
    status.protocol_version = 2;
    status.epoch = kEpoch;
    status.rate_hz = 60;
    status.state_port = parse_lcm_url(own_url())->port + 1;
    status.datagram_bytes = 1400;
    status.name = "test";
    return status;
  }

  void say(std::int64_t epoch, const CommandHeader& to, Result result, BodyId body = {}) {
    const Receipt receipt{to.client, to.sequence, tick_, {result, body, 0}};
    control_->send(channels_.name(MessageKind::receipts), encode(Receipts{epoch, {receipt}}));
  }

  void hear(std::string_view channel, ByteView payload) {
    const auto kind = channels_.kind(channel);
    if (!kind || !is_command(*kind)) return;
    const auto command = decode_command(*kind, payload);
    if (!command) return void(has_changed = true);
    const CommandHeader& header = command->header;
    Heard& known = heard[header.sequence];
    if (known.times == 0) known = {*command, {payload.begin(), payload.end()}, 0};
    has_changed |=
        !std::equal(known.bytes.begin(), known.bytes.end(), payload.begin(), payload.end());
    ++known.times;
    if (known.times == 2) say(kEpoch, header, Result::busy);
    if (known.times == 3) {
      say(kEpoch - 1, header, Result::not_allowed);  // of another run of the server
      say(kEpoch, {header.client - 1, header.sequence, 0, 0}, Result::not_allowed);
      say(kEpoch, header, Result::queued);
    }
    if (known.times != kTimes) return;
    if (kind == MessageKind::spawn) has_body_ = true;
    if (kind == MessageKind::despawn) has_body_ = false;
    say(kEpoch, header, Result::ok, {kind == MessageKind::spawn ? kBody : 0});
  }

  Channels channels_{"test"};
  std::unique_ptr<Transport> control_ = open(0).transport;
  std::unique_ptr<Transport> states_ = open(1).transport;
  Tick tick_ = 0;
  bool has_body_ = false;
};

}  // namespace

TEST_CASE("a Lua program spawns a body, pushes it, sees it move, reads its receipts, removes it") {
  const Process daemon(serve_arguments());
  const auto witness = connect();
  REQUIRE(witness);
  std::vector<Event> events;
  witness->on_event([&](const Event& event) {
    if (event.kind != EventKind::described) events.push_back(event);
  });

  Process lua(hello_lua());
  REQUIRE(poll_until(*witness, [&] { return !lua.is_running(); }));
  CAPTURE(lua.output(), lua.errors());
  CHECK(lua.wait(0ms) == 0);
  CHECK(lua.errors().empty());
  REQUIRE(poll_until(*witness, [&] { return events.size() >= 2; }));
  CHECK(events[0].kind == EventKind::spawned);
  CHECK(events[0].name == "Bällchen");
  CHECK(events[0].mass_kg == 3);
  CHECK(events[1].kind == EventKind::removed);
  CHECK(events[1].body == events[0].body);

  const std::string output = lua.output();
  const auto pushed = numbers_in(output, "WRENCH receipt: sequence 3, body 0, tick (\\d+)");
  REQUIRE(pushed.size() == 1);
  CHECK(numbers_in(output, "SPAWN receipt: sequence 2, body 1, tick (\\d+)").at(0).at(0) ==
        static_cast<double>(events[0].tick));
  const auto rows = numbers_in(output, "tick (\\d+): x (\\S+) m, z (\\S+) m, vx (\\S+) m/s");
  REQUIRE(rows.size() >= 4);
  for (const auto& row : rows) {
    // 7 N s on 3 kg, in free flight: v = J / m to the last bit but one, x = v t.
    CHECK(std::abs(row[3] - 7.0 / 3) <= 4.5e-16);
    CHECK(row[1] == Approx(7.0 / 3 * (row[0] - pushed[0][0] + 1) / 60).epsilon(1e-13));
  }
  CHECK(output.find("gone, 0 malformed messages") != std::string::npos);
}

TEST_CASE("a Lua program sends a command again, unchanged, until its last word has come") {
  HardOfHearing server;
  Process lua(hello_lua());
  const auto deadline = Clock::now() + 60s;
  server.serve([&] { return !lua.is_running() || Clock::now() > deadline; });
  CAPTURE(lua.output(), lua.errors());
  CHECK(lua.wait(0ms) == 0);
  CHECK_FALSE(server.has_changed);
  REQUIRE(server.heard.size() == 4);
  std::int64_t sequence = 0;
  for (const auto& [number, heard] : server.heard) {
    CHECK(number == ++sequence);
    CHECK(heard.times >= HardOfHearing::kTimes);
    CHECK(heard.command.header.client == server.heard.at(1).command.header.client);
    CHECK(heard.command.header.epoch == HardOfHearing::kEpoch);
  }
  CHECK(std::get<Hello>(server.heard.at(1).command.body) == Hello{2, "hello.lua"});
  const auto& push = std::get<Push>(server.heard.at(3).command.body);
  CHECK(push.wrenches.at(0).body == BodyId{HardOfHearing::kBody});  // 2^53 - 2, as a double
  CHECK(push.wrenches.at(0).value == Vec3{7, 0, 0});
  CHECK(std::get<Despawn>(server.heard.at(4).command.body).bodies ==
        std::vector{BodyId{HardOfHearing::kBody}});
}

}  // namespace cradle
