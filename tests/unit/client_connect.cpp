#include <catch2/catch.hpp>

#include "tests/unit/client_fake_server.h"

using namespace cradle;
using namespace cradle::test;
using namespace std::chrono_literals;
using Welcome = ClientCore::Welcome;

namespace {

/// What Client::connect does after its port is open.
Connection introduce_to(FakeServer& server, std::chrono::milliseconds timeout) {
  return introduce(std::make_unique<Client::Impl>("arena", "tester", server.control_end(),
                                                  server.states_opener()),
                   "arena", "the test", timeout);
}

/// A server whose one word waits in the mailbox of a client that begins to listen.
struct Waiting {
  FakeServer server;
  std::unique_ptr<Client::Impl> impl = std::make_unique<Client::Impl>(
      "arena", "tester", server.control_end(), server.states_opener());

  Connection introduce_within(std::chrono::milliseconds timeout) {
    return introduce(std::move(impl), "arena", "the test", timeout);
  }
};

}  // namespace

TEST_CASE("a client says hello to the first heartbeat and is welcome when it is answered") {
  Visit visit;
  visit.poll();
  CHECK(visit.server.heard().empty());
  CHECK(visit.core.welcome() == Welcome::unseen);

  visit.server.heartbeat();
  visit.poll();
  const auto heard = visit.server.heard();
  REQUIRE(heard.size() == 1);
  CHECK(heard[0].header.sequence == 1);
  CHECK(heard[0].header.epoch == visit.server.status.epoch);
  CHECK(heard[0].header.client >= 1);
  CHECK(std::get<Hello>(heard[0].body) == Hello{kProtocolVersion, "tester"});
  CHECK(visit.core.welcome() == Welcome::asked);

  visit.server.answer(heard[0].header, {});
  visit.poll();
  CHECK(visit.core.welcome() == Welcome::given);
  CHECK(visit.core.epoch() == visit.server.status.epoch);
  CHECK(visit.core.status() == visit.server.status);
}

TEST_CASE("two clients choose different numbers") {
  CHECK(Visit().be_welcomed().client != Visit().be_welcomed().client);
}

TEST_CASE(
    "a client opens the port of states that the heartbeat names, and a new one when it moves") {
  Visit visit;
  visit.be_welcomed();
  visit.live_for(1s);
  CHECK(visit.server.opened_ports == std::vector<int>{7668});
  visit.server.status.state_port = 7700;
  visit.live_for(1s);
  CHECK(visit.server.opened_ports == std::vector<int>{7668, 7700});
}

TEST_CASE("hello is sent again until it is answered") {
  Visit visit;
  visit.server.heartbeat();
  visit.poll();
  const Command hello = visit.server.heard().at(0);
  visit.poll(1s);
  const auto again = visit.server.heard();
  REQUIRE(again.size() == 1);
  CHECK(again[0] == hello);
  visit.server.answer(hello.header, {});
  visit.poll();
  visit.poll(1s);
  CHECK(visit.server.heard().empty());
}

TEST_CASE(
    "a client does not say hello to a world of another protocol version, and refuses commands") {
  Visit visit;
  visit.server.status.protocol_version = kProtocolVersion + 1;
  visit.server.heartbeat();
  visit.poll();
  CHECK(visit.server.heard().empty());
  CHECK(visit.submit_gravity().refused == Result::bad_version);
}

TEST_CASE("before the first heartbeat a command is refused: no_world") {
  Visit visit;
  CHECK(visit.submit_gravity().refused == Result::no_world);
  CHECK(visit.server.heard().empty());
}

TEST_CASE("after a refused hello the next command says hello first") {
  Visit visit;
  visit.server.heartbeat();
  visit.poll();
  visit.server.answer(visit.server.heard().at(0).header, {Result::over_quota, {}, 0});
  visit.poll();
  CHECK(visit.core.hello_result() == Result::over_quota);
  visit.submit_gravity();
  const auto heard = visit.server.heard();
  REQUIRE(heard.size() == 2);
  CHECK(std::holds_alternative<Hello>(heard[0].body));
  CHECK(heard[0].header.sequence == 2);
  CHECK(heard[1].header.sequence == 3);
}

TEST_CASE("connecting gives a client once hello is answered") {
  Waiting waiting;
  waiting.server.heartbeat();
  waiting.impl->poll(0ms);
  waiting.server.answer(waiting.server.heard().at(0).header, {});
  const Connection connection = waiting.introduce_within(10s);
  CHECK(connection.result == Result::ok);
  REQUIRE(connection.client);
  CHECK(connection.client->epoch() == waiting.server.status.epoch);
}

TEST_CASE("connecting without a heartbeat ends with no_world and names the worlds it heard") {
  Waiting waiting;
  waiting.server.say_on("CRADLE_cellar_STATUS");
  waiting.server.say_on("CRADLE_attic_STATUS");
  waiting.server.say_on("CRADLE_no world_STATUS");
  waiting.server.say_on("CRADLE_STATUS");
  const Connection connection = waiting.introduce_within(1ms);
  CHECK_FALSE(connection.client);
  CHECK(connection.result == Result::no_world);
  CHECK(connection.message ==
        "no heartbeat of world 'arena' on the test; heard instead: attic, cellar");
}

TEST_CASE("connecting to silence says how to start the world") {
  FakeServer server;
  const Connection connection = introduce_to(server, 1ms);
  CHECK(connection.result == Result::no_world);
  CHECK(connection.message.ends_with("start it: cradled serve --world arena"));
}

TEST_CASE("connecting to a heartbeat that does not answer hello ends with timed_out") {
  Waiting waiting;
  waiting.server.heartbeat();
  CHECK(waiting.introduce_within(1ms).result == Result::timed_out);
}

TEST_CASE(
    "connecting to another protocol version ends with bad_version, also if it cannot be read") {
  Waiting waiting;
  SECTION("a heartbeat that says so") {
    waiting.server.status.protocol_version = kProtocolVersion + 1;
    waiting.server.heartbeat();
  }
  SECTION("a heartbeat of another type") { waiting.server.say(MessageKind::status, Bytes(20, 0)); }
  CHECK(waiting.introduce_within(10s).result == Result::bad_version);
}

TEST_CASE("connecting to a full world ends with over_quota") {
  Waiting waiting;
  waiting.server.heartbeat();
  waiting.impl->poll(0ms);
  waiting.server.answer(waiting.server.heard().at(0).header, {Result::over_quota, {}, 0});
  const Connection connection = waiting.introduce_within(10s);
  CHECK(connection.result == Result::over_quota);
  CHECK(connection.message == "world 'arena' takes no more clients");
}

TEST_CASE("connecting ends with no_network where the port of states cannot be opened") {
  FakeServer server;
  auto impl = std::make_unique<Client::Impl>("arena", "tester", server.control_end(), [](int) {
    return OpenedTransport{nullptr, Result::no_network, "no such port"};
  });
  server.heartbeat();
  const Connection connection = introduce(std::move(impl), "arena", "the test", 10s);
  CHECK(connection.result == Result::no_network);
  CHECK(connection.message == "no such port");
}

TEST_CASE("options without a meaning are refused before any port is opened") {
  ClientOptions options;
  options.lcm_url = "tcpq://localhost";
  CHECK(Client::connect(options, 1ms).result == Result::bad_url);
  options = {};
  options.world = "two words";
  CHECK(Client::connect(options, 1ms).result == Result::bad_name);
  options = {};
  options.name = std::string(limits::kNameBytes + 1, 'x');
  CHECK(Client::connect(options, 1ms).result == Result::bad_name);
}
