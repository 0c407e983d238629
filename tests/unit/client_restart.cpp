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
  SECTION("told by a heartbeat") { visit.server.heartbeat(); }
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
  visit.server.heartbeat();
  visit.poll();
  visit.server.status.epoch = old_epoch;
  visit.server.heartbeat();
  visit.server.receipts({{1, 1, 0, {}}});
  visit.poll(200ms);
  CHECK(visit.core.epoch() == new_epoch);
  CHECK_FALSE(visit.core.is_contested());
  visit.server.heartbeat();
  visit.poll(3s);  // the new one has been silent all the time
  CHECK(visit.core.epoch() == old_epoch);
}

TEST_CASE("while two servers claim the world, commands are refused, and the statistics say why") {
  Visit visit;
  visit.be_welcomed();
  const std::int64_t old_epoch = visit.server.status.epoch;
  const auto both_heartbeats = [&] {
    visit.server.status.epoch = old_epoch + 1;
    visit.server.heartbeat();
    visit.poll(300ms);
    visit.server.status.epoch = old_epoch;
    visit.server.heartbeat();
    visit.poll(200ms);
  };
  both_heartbeats();  // the other one may have spoken its last word
  CHECK_FALSE(visit.core.is_contested());
  both_heartbeats();
  CHECK(visit.core.is_contested());
  CHECK(visit.core.epoch() == old_epoch + 1);
  CHECK(visit.core.statistics().rival_heartbeats == 1);
  CHECK(visit.submit_gravity().refused == Result::contested);

  for (int i = 0; i < 6; ++i) {  // the first one has gone
    visit.server.status.epoch = old_epoch + 1;
    visit.server.heartbeat();
    visit.poll(500ms);
  }
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
