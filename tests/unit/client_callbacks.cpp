#include <catch2/catch.hpp>
#include <stdexcept>

#include "tests/unit/client_fake_server.h"

using namespace cradle;
using namespace cradle::test;
using namespace std::chrono_literals;

TEST_CASE("what a callback throws is counted and kept, and the next callback runs") {
  Visit visit;
  visit.be_welcomed();
  int calls = 0;
  visit.core.callbacks.on_tick = [&](Tick tick) {
    ++calls;
    if (tick == 1) throw std::runtime_error("tick one");
    if (tick == 2) throw 2;
  };
  visit.server.chunk(chunk_of(1, 1, 9, {}));
  CHECK_NOTHROW(visit.poll());
  CHECK(visit.core.last_callback_error() == "tick one");
  visit.server.chunk(chunk_of(2, 1, 9, {}));
  visit.server.chunk(chunk_of(3, 1, 9, {}));
  CHECK_NOTHROW(visit.poll());
  CHECK(calls == 3);
  CHECK(visit.core.statistics().callback_exceptions == 2);
  CHECK(visit.core.last_callback_error() == "an exception that is not a std::exception");
  CHECK_FALSE(visit.core.is_in_callback());
}

TEST_CASE("callbacks run only in poll, after everything was received") {
  Visit visit;
  visit.be_welcomed();
  std::vector<Result> results;
  visit.core.callbacks.on_answer = [&](Ticket, const Answer& answer) {
    results.push_back(answer.result);
    CHECK(visit.core.mirror().find({1}) != nullptr);
  };
  visit.submit(Despawn{});
  CHECK(results.empty());
  visit.server.chunk(chunk_of(1, 1, 9, {state_of(1)}));
  visit.poll();
  CHECK(results == std::vector{Result::malformed});
}

TEST_CASE("a callback may send, cannot poll, and cannot keep poll busy for ever") {
  Visit visit;
  visit.be_welcomed();
  int calls = 0;
  visit.core.callbacks.on_answer = [&](Ticket, const Answer&) {
    ++calls;
    CHECK(visit.poll() == 0);
    visit.submit(Despawn{});  // refused at once: answered by the next callback
  };
  visit.server.answer(visit.send(), {});
  CHECK(visit.poll() == 1);
  CHECK(calls == 1);
  visit.poll();
  CHECK(calls == 2);
  CHECK(visit.core.statistics().callback_exceptions == 0);
}

TEST_CASE("waiting inside a callback ends at once") {
  FakeServer server;
  const auto connected = connected_client(server);
  REQUIRE(connected);
  Client& client = *connected;
  std::optional<Result> waited;
  client.on_tick([&](Tick) { waited = client.wait(client.spawn(ball()), 24h).result; });
  server.chunk(chunk_of(1, 1, 9, {}));
  client.poll();
  CHECK(waited == Result::timed_out);
}
