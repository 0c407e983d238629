#include <catch2/catch.hpp>
#include <limits>

#include "tests/unit/client_fake_server.h"

using namespace cradle;
using namespace cradle::test;
using namespace std::chrono_literals;

TEST_CASE(
    "a command carries client, sequence, epoch and target tick, and is answered by its receipt") {
  Visit visit;
  const std::int64_t client = visit.be_welcomed().client;
  const Ticket ticket = visit.submit(Spawn{{ball()}}, 120);
  REQUIRE(ticket);
  const auto heard = visit.server.heard();
  REQUIRE(heard.size() == 1);
  CHECK(heard[0].header == CommandHeader{client, 2, visit.server.status.epoch, 120});
  CHECK(std::get<Spawn>(heard[0].body).bodies == std::vector{ball()});

  visit.poll();
  CHECK_FALSE(visit.core.answer(ticket));
  visit.server.answer(heard[0].header, {Result::ok, {42}, 0}, 121);
  visit.poll();
  CHECK(visit.core.answer(ticket) == Answer{Result::ok, {42}, 0, 121});
}

TEST_CASE("a command is sent again, unchanged, until its receipt comes") {
  Visit visit;
  visit.be_welcomed();
  const Ticket ticket = visit.submit_gravity();
  const Command first = visit.server.heard().at(0);
  visit.poll();
  CHECK(visit.server.heard().empty());
  for (int i = 1; i <= 3; ++i) {
    visit.poll(1s);
    CHECK(visit.server.heard() == std::vector{first});
    CHECK(visit.core.statistics().resends == i);
  }
  visit.server.answer(first.header, {});
  visit.poll();
  visit.poll(1s);
  CHECK(visit.server.heard().empty());
  CHECK(visit.core.answer(ticket) == Answer{});
}

TEST_CASE("a second receipt for the same command changes nothing") {
  Visit visit;
  visit.be_welcomed();
  int answers = 0;
  visit.core.callbacks.on_answer = [&](Ticket, const Answer&) { ++answers; };
  const Ticket ticket = visit.submit(Spawn{{ball()}});
  const CommandHeader header = visit.server.heard().at(0).header;
  visit.server.answer(header, {Result::ok, {5}, 0}, 10);
  visit.server.answer(header, {Result::ok, {5}, 0}, 10);
  visit.server.answer(header, {Result::expired, {}, 0});
  visit.poll();
  CHECK(answers == 1);
  CHECK(visit.core.answer(ticket) == Answer{Result::ok, {5}, 0, 10});
  CHECK(visit.core.statistics().answers == 2);  // with hello's
}

TEST_CASE("receipts of other clients are not ours") {
  Visit visit;
  visit.be_welcomed();
  const Ticket ticket = visit.submit_gravity();
  CommandHeader header = visit.server.heard().at(0).header;
  header.client = header.client == 1 ? 2 : header.client - 1;
  visit.server.answer(header, {});
  CHECK(visit.poll() == 0);
  CHECK_FALSE(visit.core.answer(ticket));
}

TEST_CASE("queued, gap and busy are not the final answer") {
  Visit visit;
  visit.be_welcomed();
  const Ticket ticket = visit.submit_gravity();
  const CommandHeader header = visit.server.heard().at(0).header;
  for (const Result result : {Result::queued, Result::gap, Result::busy}) {
    visit.server.answer(header, {result, {}, 0}, 200);
    visit.poll();
    CHECK_FALSE(visit.core.answer(ticket));
  }
  visit.server.answer(header, {Result::ok, {}, 0}, 200);
  visit.poll();
  CHECK(visit.core.answer(ticket) == Answer{Result::ok, {}, 0, 200});
}

TEST_CASE("round trips are measured, but not those of commands that wait for their tick") {
  Visit visit;
  visit.be_welcomed();
  const auto answer_after = [&](std::chrono::milliseconds delay) {
    const CommandHeader header = visit.send();
    visit.now += delay;
    visit.server.answer(header, {});
    visit.poll();
  };
  // hello took no time at all; RFC 6298: smoothed = 7/8 smoothed + 1/8 new.
  answer_after(16ms);
  CHECK(visit.core.statistics().round_trip_smoothed_s == Approx(0.016));
  answer_after(24ms);
  CHECK(visit.core.statistics().round_trip_last_s == Approx(0.024));
  CHECK(visit.core.statistics().round_trip_smoothed_s == Approx(0.017));
  answer_after(8ms);
  CHECK(visit.core.statistics().round_trip_max_s == Approx(0.024));

  const CommandHeader later = visit.send();
  visit.server.answer(later, {Result::queued, {}, 0}, 500);
  visit.poll(1s);
  visit.server.answer(later, {}, 500);
  visit.poll();
  CHECK(visit.core.statistics().round_trip_max_s == Approx(0.024));
}

TEST_CASE("what breaks a limit is refused at once, with its item, and not sent") {
  Visit visit;
  visit.be_welcomed();
  BodySpec endless = ball();
  endless.v_WBcm.y = std::numeric_limits<double>::infinity();
  const Ticket ticket = visit.submit(Spawn{{ball(), endless}});
  CHECK_FALSE(ticket);
  CHECK(ticket.refused == Result::not_finite);
  CHECK(visit.core.answer(ticket) == Answer{Result::not_finite, {}, 1, 0});

  CHECK(visit.submit(Despawn{{{0}}}).refused == Result::unknown_body);
  CHECK(visit.submit(Despawn{}).refused == Result::malformed);
  CHECK(visit.submit(SetGravity{{1e5, 0, 0}}).refused == Result::out_of_range);
  CHECK(visit.submit(SetGravity{}, -1).refused == Result::out_of_range);
  CHECK(visit.submit(Push{{Wrench{}}}).refused == Result::unknown_body);
  CHECK(visit.submit(Control{ControlAction::step, 0}).refused == Result::out_of_range);
  CHECK(visit.server.heard().empty());
}

TEST_CASE("a refused command leaves no gap in the sequence") {
  Visit visit;
  visit.be_welcomed();
  visit.submit(Despawn{});
  CHECK(visit.send().sequence == 2);
}

TEST_CASE("the largest list that fits a datagram is sent, one item more is too_large") {
  Visit visit;
  visit.be_welcomed();
  const auto most = static_cast<std::size_t>(visit.core.batch_limits().spawn);
  // 1400 bytes less channel and trailer, 348 bytes a body (body_spec_v3.lcm).
  CHECK(most == 3);
  CHECK(visit.submit(Spawn{std::vector(most, ball())}));
  CHECK(visit.submit(Spawn{std::vector(most + 1, ball())}).refused == Result::too_large);
  CHECK(visit.server.heard().size() == 1);
}

TEST_CASE("the window closes after kHeldCommands unanswered commands and opens with an answer") {
  Visit visit;
  visit.be_welcomed();
  for (int i = 0; i < limits::kHeldCommands; ++i) REQUIRE(visit.submit_gravity());
  CHECK(visit.submit_gravity().refused == Result::over_window);
  const auto heard = visit.server.heard();
  REQUIRE(heard.size() == static_cast<std::size_t>(limits::kHeldCommands));
  visit.server.answer(heard[0].header, {});
  visit.poll();
  CHECK(visit.submit_gravity());
}

TEST_CASE("the answers of the last 4096 commands are kept") {
  Visit visit;
  visit.be_welcomed();
  const Ticket first = visit.submit(Despawn{});  // refused at once: answered
  Ticket last;
  for (int i = 0; i < 4095; ++i) last = visit.submit(Despawn{});
  CHECK(visit.core.answer(first));
  last = visit.submit(Despawn{});
  CHECK_FALSE(visit.core.answer(first));
  CHECK(visit.core.answer(last));
}

TEST_CASE("a command that overtakes hello is sent again, not given up") {
  Visit visit;
  visit.server.heartbeat();
  visit.poll();
  const Ticket ticket = visit.submit_gravity();
  const auto heard = visit.server.heard();
  REQUIRE(heard.size() == 2);
  visit.server.answer(heard[1].header, {Result::unknown_client, {}, 0});
  visit.server.answer(heard[0].header, {});
  visit.poll();
  CHECK_FALSE(visit.core.answer(ticket));
  visit.poll(1s);
  CHECK(visit.server.heard() == std::vector{heard[1]});
}

TEST_CASE("a silent client repeats hello under its last number, which takes no number") {
  Visit visit;
  visit.be_welcomed();
  visit.server.answer(visit.send(), {});
  visit.poll();
  visit.live_for(1500ms);
  CHECK(visit.server.heard().empty());
  visit.live_for(500ms);
  const auto heard = visit.server.heard();
  REQUIRE(heard.size() == 1);
  CHECK(std::holds_alternative<Hello>(heard[0].body));
  CHECK(heard[0].header.sequence == 2);
  CHECK(visit.send().sequence == 3);
}

TEST_CASE("a hello is never said under the number of a command that waits for its answer") {
  Visit visit;
  visit.be_welcomed();
  const CommandHeader waiting = visit.send();
  const std::int64_t own = visit.server.status.epoch;
  for (int i = 0; i < 10; ++i) {  // strangers make a client ask who is there
    visit.server.status.epoch = own + 1;
    visit.server.heartbeat();
    visit.poll(300ms);
    visit.server.status.epoch = own;
    visit.server.heartbeat();
    visit.poll(300ms);
  }
  int repetitions = 0;
  for (const Command& heard : visit.server.heard()) {
    CHECK_FALSE(std::holds_alternative<Hello>(heard.body));
    CHECK(heard.header == waiting);
    ++repetitions;
  }
  CHECK(repetitions > 10);
  visit.server.answer(waiting, {});
  visit.poll();
  visit.server.status.epoch = own + 1;
  visit.server.heartbeat();
  visit.poll(300ms);
  const auto heard = visit.server.heard();
  REQUIRE(heard.size() == 1);
  CHECK(std::holds_alternative<Hello>(heard[0].body));  // now the number is answered
}

TEST_CASE("a client that the server has forgotten says hello again and goes on") {
  Visit visit;
  visit.be_welcomed();
  SECTION("told so by a receipt") {
    const Ticket lost = visit.submit_gravity();
    visit.server.answer(visit.server.heard().at(0).header, {Result::unknown_client, {}, 0});
    visit.poll();
    CHECK(visit.core.answer(lost) == Answer{Result::unknown_client, {}, 0, 0});
    const auto heard = visit.server.heard();
    REQUIRE(heard.size() == 1);
    CHECK(std::holds_alternative<Hello>(heard[0].body));
    CHECK(heard[0].header.sequence == 3);
  }
  SECTION("guessed after a long time without poll") {
    visit.now += 20s;
    visit.submit_gravity();
    const auto heard = visit.server.heard();
    REQUIRE(heard.size() == 2);
    CHECK(std::holds_alternative<Hello>(heard[0].body));
    CHECK(heard[0].header.sequence == 2);
    CHECK(heard[1].header.sequence == 3);
  }
}

TEST_CASE("waiting ends with the answer, or with timed_out and the ticket still good") {
  FakeServer server;
  const auto connected = connected_client(server);
  REQUIRE(connected);
  Client& client = *connected;

  const Ticket ticket = client.spawn(ball());
  CHECK(client.wait(ticket, 1ms).result == Result::timed_out);
  server.answer(server.heard().at(0).header, {Result::ok, {9}, 0}, 3);
  CHECK(client.wait(ticket, 10s) == Answer{Result::ok, {9}, 0, 3});
  CHECK(client.wait(ticket, 0ms) == Answer{Result::ok, {9}, 0, 3});
  CHECK(client.wait(client.despawn(BodyId{}), 10s).result == Result::unknown_body);
}
