#include <catch2/catch.hpp>

#include "tests/unit/client_fake_server.h"

using namespace cradle;
using namespace cradle::test;
using namespace std::chrono_literals;

namespace {

std::vector<std::int64_t> ids(const WorldMirror& mirror) {
  std::vector<std::int64_t> list;
  for (const BodyView& view : mirror.bodies()) list.push_back(view.state.body.value);
  return list;
}

Event event_of(EventKind kind, std::int64_t body, std::string name) {
  Event event;
  event.kind = kind;
  event.body = {body};
  event.name = std::move(name);
  return event;
}

constexpr WorldMirror::Time kNow{};
using Ids = std::vector<std::int64_t>;

}  // namespace

TEST_CASE("a chunk brings the states of its bodies, in order of ids, with tick and age") {
  Visit visit;
  visit.be_welcomed();
  visit.server.chunk(chunk_of(5, 1, 100, {state_of(3, 0.5), state_of(8)}, 0, 2));
  visit.server.chunk(chunk_of(5, 101, 200, {state_of(150)}, 1, 2));
  visit.server.chunk(chunk_of(9, 101, 200, {state_of(150)}, 1, 2));
  CHECK(visit.poll() == 3);
  const WorldMirror& mirror = visit.core.mirror();
  CHECK(ids(mirror) == Ids{3, 8, 150});
  REQUIRE(mirror.find({3}));
  CHECK(mirror.find({3})->state == state_of(3, 0.5));
  CHECK(mirror.find({3})->tick == 5);
  CHECK(mirror.find({3})->received_at == visit.now);
  CHECK(mirror.find({4}) == nullptr);
  CHECK(visit.core.tick() == 9);
  CHECK(mirror.tick_time_us() == 90'000);
}

TEST_CASE("bodies in a chunk's range that it does not list are gone, those beyond it stay") {
  WorldMirror mirror;
  mirror.take(chunk_of(1, 1, 9, {state_of(2), state_of(4), state_of(6), state_of(8)}), kNow);
  mirror.take(chunk_of(2, 3, 7, {state_of(5), state_of(6)}, 0, 2), kNow);
  CHECK(ids(mirror) == Ids{2, 5, 6, 8});
  mirror.take(chunk_of(3, 1, 9, {}), kNow);
  CHECK(ids(mirror).empty());
}

TEST_CASE("an old chunk changes no newer body and brings none back") {
  WorldMirror mirror;
  mirror.take(chunk_of(7, 1, 9, {state_of(1, 0.7), state_of(2, 0.7)}), kNow);
  mirror.take(chunk_of(8, 1, 9, {state_of(1, 0.8)}), kNow);
  SECTION("listing a body that is gone") {
    mirror.take(chunk_of(7, 1, 9, {state_of(1, 0.7), state_of(2, 0.7)}), kNow);
  }
  SECTION("listing only what still is") { mirror.take(chunk_of(7, 1, 9, {state_of(1)}), kNow); }
  SECTION("listing nothing") { mirror.take(chunk_of(7, 1, 9, {}), kNow); }
  CHECK(ids(mirror) == Ids{1});
  CHECK(mirror.find({1})->state.p_WBo.x == 0.8);
  CHECK(mirror.find({1})->tick == 8);
  CHECK(mirror.counters().chunks_stale == 1);
}

TEST_CASE("an old chunk still helps the bodies whose newer one was lost") {
  WorldMirror mirror;
  mirror.take(chunk_of(1, 1, 5, {state_of(1)}, 0, 2), kNow);
  mirror.take(chunk_of(1, 6, 9, {state_of(7)}, 1, 2), kNow);
  mirror.take(chunk_of(3, 1, 5, {state_of(1)}, 0, 2), kNow);
  mirror.take(chunk_of(2, 6, 9, {state_of(7, 0.2)}, 1, 2), kNow);
  CHECK(mirror.find({7})->state.p_WBo.x == 0.2);
  CHECK(mirror.find({7})->tick == 2);
}

TEST_CASE("a repeated tick shows what changed in it") {
  // A paused world tells the same tick again after a despawn or a set_motion.
  WorldMirror mirror;
  mirror.take(chunk_of(4, 1, 9, {state_of(1), state_of(2)}), kNow);
  mirror.take(chunk_of(4, 1, 9, {state_of(2, 0.5)}), kNow);
  CHECK(ids(mirror) == Ids{2});
  CHECK(mirror.find({2})->state.p_WBo.x == 0.5);
  mirror.take(chunk_of(4, 1, 9, {state_of(2, 0.6)}), kNow);
  CHECK(mirror.find({2})->state.p_WBo.x == 0.6);
}

TEST_CASE(
    "chunks that are missing when a newer tick comes are lost; before the first tick none is") {
  WorldMirror mirror;
  mirror.take(chunk_of(10, 7, 9, {}, 2, 3), kNow);  // joined in the middle: 0 and 1 were before us
  mirror.take(chunk_of(11, 1, 3, {}, 0, 3), kNow);
  CHECK(mirror.counters().chunks_lost == 0);
  mirror.take(chunk_of(11, 7, 9, {}, 2, 3), kNow);
  mirror.take(chunk_of(11, 7, 9, {}, 2, 3), kNow);  // twice: still no chunk 1
  mirror.take(chunk_of(12, 1, 3, {}, 0, 3), kNow);
  CHECK(mirror.counters().chunks_lost == 1);
  mirror.take(chunk_of(15, 1, 3, {}, 0, 3), kNow);  // 2 of tick 12, and all of 13 and 14
  CHECK(mirror.counters().chunks_lost == 1 + 2 + 2 * 3);
  CHECK(mirror.counters().chunks_received == 6);
}

TEST_CASE("a tick is reported once, in order, when it is complete or overtaken") {
  Visit visit;
  visit.be_welcomed();
  std::vector<Tick> ticks;
  visit.core.callbacks.on_tick = [&](Tick tick) { ticks.push_back(tick); };
  visit.server.chunk(chunk_of(1, 1, 4, {}, 0, 2));
  visit.poll();
  CHECK(ticks.empty());
  visit.server.chunk(chunk_of(1, 5, 9, {}, 1, 2));
  visit.server.chunk(chunk_of(1, 5, 9, {}, 1, 2));
  visit.server.chunk(chunk_of(2, 5, 9, {}, 1, 2));  // its other half is lost
  visit.poll();
  CHECK(ticks == std::vector<Tick>{1});
  visit.server.chunk(chunk_of(3, 1, 9, {}));
  visit.server.chunk(chunk_of(2, 1, 4, {}, 0, 2));
  visit.poll();
  CHECK(ticks == std::vector<Tick>{1, 2, 3});
}

TEST_CASE("jitter is the mean difference between wall time and simulated time, without pauses") {
  WorldMirror mirror;
  mirror.take(chunk_of(1, 1, 9, {}), kNow);  // ticks are 10 ms apart
  mirror.take(chunk_of(2, 1, 9, {}), kNow + 10ms);
  CHECK(mirror.counters().tick_jitter_s == Approx(0).margin(1e-12));
  mirror.take(chunk_of(3, 1, 9, {}), kNow + 36ms);  // 16 ms late, weight 1/16 (RFC 3550)
  CHECK(mirror.counters().tick_jitter_s == Approx(1e-3));
  mirror.take(chunk_of(4, 1, 9, {}), kNow + 10s);  // a pause
  CHECK(mirror.counters().tick_jitter_s == Approx(1e-3));
}

TEST_CASE("chunks that contradict themselves, are malformed or of another epoch change nothing") {
  Visit visit;
  visit.be_welcomed();
  visit.server.chunk(chunk_of(1, 1, 9, {state_of(1)}));
  visit.poll();
  visit.server.chunk(chunk_of(2, 9, 1, {}));
  visit.server.chunk(chunk_of(2, 1, 9, {}, 0, limits::kBodies + 1));
  visit.server.chunk(chunk_of(2, 1, 9, {state_of(2), state_of(1)}));  // not ascending
  visit.poll();
  CHECK(visit.core.statistics().datagrams_rejected == 3);
  const std::int64_t epoch = std::exchange(visit.server.status.epoch, 99);
  visit.server.chunk(chunk_of(3, 1, 9, {}));
  visit.server.status.epoch = epoch;
  visit.poll();
  CHECK(ids(visit.core.mirror()) == Ids{1});
  CHECK(visit.core.tick() == 1);
}

TEST_CASE("events are handed on once, and numbers that are skipped are counted as lost") {
  Visit visit;
  visit.be_welcomed();
  std::vector<std::string> names;
  visit.core.callbacks.on_event = [&](const Event& event) { names.push_back(event.name); };
  const auto named = [](const char* name) { return event_of(EventKind::spawned, 1, name); };
  visit.server.events(20, {named("a"), named("b")});
  visit.server.events(21, {named("b"), named("c")});
  visit.server.events(20, {named("a")});
  visit.server.events(26, {named("d")});
  const std::int64_t epoch = std::exchange(visit.server.status.epoch, 99);
  visit.server.events(27, {named("of another epoch")});
  visit.server.status.epoch = epoch;
  visit.poll();
  CHECK(names == std::vector<std::string>{"a", "b", "c", "d"});
  CHECK(visit.core.statistics().events_received == 4);
  CHECK(visit.core.statistics().events_lost == 3);  // 23, 24, 25
}

TEST_CASE("a name is known from the event that told it until the body is gone") {
  WorldMirror mirror;
  mirror.take(Events{1, 1, {event_of(EventKind::described, 4, "ball")}});
  mirror.take(Events{1, 2, {event_of(EventKind::spawned, 5, "box")}});
  mirror.take(chunk_of(1, 1, 9, {state_of(4), state_of(5)}), kNow);
  CHECK(mirror.find_by_name("ball") == BodyId{4});
  CHECK(mirror.find_by_name("box") == BodyId{5});
  REQUIRE(mirror.about({5}));
  CHECK(mirror.about({5})->name == "box");
  SECTION("by an event") { mirror.take(Events{1, 3, {event_of(EventKind::removed, 5, "box")}}); }
  SECTION("by a chunk, if the event was lost") {
    mirror.take(chunk_of(2, 1, 9, {state_of(4)}), kNow);
  }
  CHECK_FALSE(mirror.find_by_name("box"));
  CHECK(mirror.about({5}) == nullptr);
  CHECK(mirror.find_by_name("ball") == BodyId{4});
}

TEST_CASE("a name that passed to another body stays with it when the first is forgotten") {
  WorldMirror mirror;
  mirror.take(Events{1, 1, {event_of(EventKind::spawned, 4, "ball")}});
  mirror.take(chunk_of(1, 1, 9, {state_of(4)}), kNow);
  mirror.take(Events{1, 3, {event_of(EventKind::spawned, 5, "ball")}});  // number 2 was lost
  mirror.take(chunk_of(2, 1, 9, {state_of(5)}), kNow);
  CHECK(mirror.find_by_name("ball") == BodyId{5});
}

TEST_CASE("a client shows bodies by id and by name, and how far each is behind the newest tick") {
  FakeServer server;
  const auto connected = connected_client(server);
  REQUIRE(connected);
  Client& client = *connected;
  server.events(1, {event_of(EventKind::described, 4, "ball")});
  server.chunk(chunk_of(10, 1, 4, {state_of(4)}, 0, 2));
  server.chunk(chunk_of(30, 5, 9, {state_of(5)}, 1, 2));
  client.poll(10s);
  REQUIRE(client.find({4}));
  CHECK(client.bodies().size() == 2);
  CHECK(client.tick() == 30);
  CHECK(client.time_s() == Approx(0.3));                  // ticks of chunk_of are 10 ms apart
  CHECK(client.age_s(*client.find({4})) == Approx(0.2));  // at 100 Hz
  CHECK(client.age_s(*client.find({5})) == 0);
  CHECK(client.wall_age_s(*client.find({4})) == 0);  // it came with the last poll
  CHECK(client.find_by_name("ball") == BodyId{4});
  CHECK(client.name({4}) == "ball");
  CHECK(client.name({5}).empty());
  CHECK(client.about({5}) == nullptr);
}
