#include <catch2/catch.hpp>

#include "tests/unit/client_fake_server.h"

using namespace cradle;
using namespace cradle::test;
using namespace std::chrono_literals;

TEST_CASE("a new epoch ends what was pending, forgets the bodies, and begins with a new hello") {
  Visit visit;
  const std::int64_t first_client = visit.be_welcomed().client;
  const std::int64_t first_epoch = visit.server.status.epoch;
  std::vector<std::int64_t> restarts;
  visit.core.callbacks.on_restart = [&](std::int64_t epoch) { restarts.push_back(epoch); };
  visit.server.status.tick = 500;
  visit.server.heartbeat();
  visit.server.chunk(chunk_of(501, 1, 9, {state_of(1)}));
  visit.poll();
  const Ticket lost = visit.submit_gravity();
  visit.server.heard();

  visit.server.status.epoch = first_epoch + 1;
  visit.server.status.tick = 3;
  SECTION("told by a heartbeat, and by the answer to the command that it makes us repeat") {
    visit.server.heartbeat();
    visit.poll();
    CHECK(visit.core.epoch() == first_epoch);
    const Command asked = visit.server.heard().at(0);
    CHECK(asked.header == CommandHeader{first_client, 2, first_epoch, 0});
    visit.server.answer(asked.header, {Result::wrong_epoch, {}, 0});
  }
  SECTION("told by the receipt of a command that came too late") {
    visit.server.answer({first_client, 2, 0, 0}, {Result::wrong_epoch, {}, 0});
  }
  visit.poll();

  CHECK(visit.core.answer(lost) == Answer{Result::world_restarted, {}, 0, 0});
  CHECK(visit.core.mirror().bodies().empty());
  CHECK(visit.core.tick() <= 3);
  CHECK(visit.core.epoch() == first_epoch + 1);
  CHECK(restarts == std::vector{first_epoch + 1});
  CHECK(visit.core.statistics().restarts == 1);

  const auto heard = visit.server.heard();
  REQUIRE(heard.size() == 1);
  CHECK(std::holds_alternative<Hello>(heard[0].body));
  CHECK(heard[0].header.sequence == 3);  // numbers go on
  CHECK(heard[0].header.client != first_client);

  const Ticket next = visit.submit_gravity();
  const Command command = visit.server.heard().at(0);
  CHECK(command.header == CommandHeader{heard[0].header.client, 4, first_epoch + 1, 0});
  visit.server.answer(heard[0].header, {});
  visit.server.answer(command.header, {});
  visit.poll();
  CHECK(visit.core.answer(next) == Answer{});
  CHECK(visit.core.answer(lost)->result == Result::world_restarted);
}

TEST_CASE("stragglers of a past epoch are ignored while the present server lives") {
  Visit visit;
  visit.be_welcomed();
  const std::int64_t old_epoch = visit.server.status.epoch;
  const std::int64_t new_epoch = old_epoch + 1;
  visit.server.status.epoch = new_epoch;
  visit.poll(3s);
  visit.server.heartbeat();
  visit.poll();  // the old one has been silent for so long that nobody is asked
  CHECK(visit.core.epoch() == new_epoch);
  visit.server.status.epoch = old_epoch;
  visit.server.heartbeat();
  visit.server.receipts({{1, 1, 0, {}}});
  visit.poll(200ms);
  CHECK(visit.core.epoch() == new_epoch);
  CHECK_FALSE(visit.core.is_contested());
  CHECK(visit.core.statistics().strangers == 1);
  visit.server.heartbeat();
  visit.poll(3s);  // the new one has been silent all the time
  CHECK(visit.core.epoch() == old_epoch);
}

TEST_CASE("a recording played into the network changes nothing for a client of the live world") {
  Visit visit;
  const std::int64_t client = visit.be_welcomed().client;
  const WorldStatus live = visit.server.status;
  visit.server.chunk(chunk_of(40, 1, 9, {state_of(1, 5)}));
  visit.server.events(1, {});
  visit.poll();
  WorldStatus recorded = live;
  recorded.epoch = live.epoch - 1;
  recorded.tick = 900;
  recorded.state_port = 9999;
  for (int i = 0; i < 8; ++i) {
    visit.server.status = recorded;
    visit.server.heartbeat();
    visit.server.receipts(
        {{client + 1, 1, 0, {}}, {client - 1, 2, 0, {Result::wrong_epoch, {}, 0}}});
    visit.server.chunk(chunk_of(900 + i, 1, 9, {state_of(2)}));
    Event removed;
    removed.kind = EventKind::removed;
    removed.body = {1};
    visit.server.events(1 + i, {removed});
    visit.poll();
    visit.server.status = live;
    visit.server.heartbeat();
    for (const Command& asked : visit.server.heard()) {
      CHECK(asked.header == CommandHeader{client, 1, live.epoch, 0});
      visit.server.answer(asked.header, {});  // a repetition
    }
    visit.poll(500ms);
  }
  CHECK(visit.core.epoch() == live.epoch);
  CHECK(visit.core.tick() == 40);
  CHECK(visit.core.status() == live);
  REQUIRE(visit.core.mirror().bodies().size() == 1);
  CHECK(visit.core.mirror().bodies()[0].state == state_of(1, 5));
  CHECK(visit.core.statistics().restarts == 0);
  CHECK(visit.core.statistics().strangers == 8);
  CHECK(visit.server.opened_ports == std::vector<int>{live.state_port});
}

TEST_CASE("a client that meets a recording first is with the live world once that answers hello") {
  Visit visit;
  const WorldStatus live = visit.server.status;
  visit.server.status.epoch = live.epoch - 1;
  visit.server.heartbeat();
  visit.poll();
  const CommandHeader hello = visit.server.heard().at(0).header;
  CHECK(hello.epoch == live.epoch - 1);
  visit.server.status = live;
  visit.server.answer(hello, {Result::wrong_epoch, {}, 0});
  visit.poll();
  const CommandHeader second = visit.server.heard().at(0).header;
  CHECK(second.epoch == live.epoch);
  visit.server.answer(second, {});
  visit.server.heartbeat();
  visit.poll();
  visit.server.status.epoch = live.epoch - 1;
  visit.server.heartbeat();
  visit.poll(500ms);
  CHECK(visit.core.welcome() == ClientCore::Welcome::given);
  CHECK(visit.core.epoch() == live.epoch);
}

TEST_CASE("while two servers answer for the world, commands are refused") {
  Visit visit;
  visit.be_welcomed();
  const std::int64_t old_epoch = visit.server.status.epoch;
  /// A heartbeat of one server, which answers when it is asked.
  const auto beat = [&](std::int64_t epoch) {
    visit.server.status.epoch = epoch;
    visit.server.heartbeat();
    visit.poll(300ms);
    for (const Command& asked : visit.server.heard()) {
      const bool is_own = asked.header.epoch == epoch;
      visit.server.answer(asked.header, {is_own ? Result::ok : Result::wrong_epoch, {}, 0});
    }
    visit.poll(200ms);
  };
  beat(old_epoch + 1);  // a restart, as far as one can see
  beat(old_epoch + 1);
  CHECK(visit.core.epoch() == old_epoch + 1);
  CHECK_FALSE(visit.core.is_contested());
  beat(old_epoch);
  CHECK(visit.core.epoch() == old_epoch + 1);
  CHECK(visit.core.is_contested());
  CHECK(visit.submit_gravity().refused == Result::contested);
  for (int i = 0; i < 6; ++i) beat(old_epoch + 1);  // the first one has gone
  CHECK_FALSE(visit.core.is_contested());
  CHECK(visit.submit_gravity().refused == Result::ok);
}

TEST_CASE("a world is alive until three seconds have passed without a heartbeat") {
  Visit visit;
  CHECK_FALSE(visit.core.is_alive());
  visit.be_welcomed();
  CHECK(visit.core.is_alive());
  visit.poll(2999ms);
  CHECK(visit.core.is_alive());
  visit.poll(1ms);
  CHECK_FALSE(visit.core.is_alive());
  visit.server.heartbeat();
  visit.poll();
  CHECK(visit.core.is_alive());
}
