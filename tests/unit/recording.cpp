// Playing recordings: pace, merging, and a client of one.
#include "protocol/transport/recording.h"

#include <catch2/catch.hpp>

#include "client/src/client_impl.h"
#include "tests/unit/client_fake_server.h"
#include "tests/unit/recordings.h"

using namespace cradle;
using namespace cradle::test;
using namespace std::chrono_literals;

namespace {

const Recording::Time kRecordingStart{std::chrono::hours(1)};

/// Ticks of the chunks that are due by `now`.
std::vector<Tick> play(Recording& recording, Recording::Time now) {
  std::vector<Tick> ticks;
  recording.play(now);
  recording.receive(
      0us, [&](auto, ByteView payload) { ticks.push_back(decode_states(payload).value().tick); });
  return ticks;
}

Bytes states_of_tick(Tick tick, std::int64_t epoch = 7, std::int64_t body = 1) {
  StateChunk chunk = chunk_of(tick, 1, 9, {state_of(body, static_cast<double>(tick))});
  chunk.epoch = epoch;
  return encode(chunk);
}

Bytes heartbeat(std::int64_t epoch = 7) {
  WorldStatus status;
  status.protocol_version = kProtocolVersion;
  status.epoch = epoch;
  status.rate_hz = 100;
  status.name = "arena";
  return encode(status);
}

Log& add_states(Log& log, std::int64_t time_us, Tick tick, std::int64_t epoch = 7) {
  return log.add(time_us, "CRADLE_arena_STATES", states_of_tick(tick, epoch));
}

Connection open(const std::string& url) {
  ClientOptions options;
  options.lcm_url = url;
  options.world = "arena";
  return Client::connect(options, 20s);
}

}  // namespace

TEST_CASE("the URL of a recording has a path, a speed and one more path") {
  const auto url = parse_recording_url("file:///a/b%3fc.log?speed=2.5&states=x%25y%26");
  REQUIRE(url);
  CHECK(url->path == "/a/b?c.log");
  CHECK(url->states_path == "x%y&");
  CHECK(url->speed == 2.5);
  const auto again = parse_recording_url(url->text());
  REQUIRE(again);
  CHECK(again->path == url->path);
  CHECK(again->states_path == url->states_path);
  CHECK(again->speed == url->speed);
  CHECK(parse_recording_url("file://run.log")->speed == 1);
  for (const char* bad :
       {"file://", "file://?speed=1", "file://a?", "file://a?speed=", "file://a?speed=-1",
        "file://a?speed=1001", "file://a?speed=1e-9", "file://a?speed=nan", "file://a?speed=inf",
        "file://a?sped=1", "file://a?states=", "file://a%2", "file://a%zz", "file://a%00",
        "udpm://a"}) {
    CAPTURE(bad);
    CHECK(!parse_recording_url(bad));
  }
}

TEST_CASE("a recording is played at its own pace, times its speed") {
  Log log;
  for (Tick tick = 0; tick < 5; ++tick) add_states(log, 1'000'000 + 100'000 * tick, tick);
  const TemporaryFile file(log.bytes);
  Recording recording({file.path(), "", 2}, "arena", kRecordingStart);
  CHECK(play(recording, kRecordingStart) == std::vector<Tick>{0});
  CHECK(recording.until_next(kRecordingStart) == 50ms);
  CHECK(play(recording, kRecordingStart + 49ms).empty());
  CHECK(play(recording, kRecordingStart + 50ms) == std::vector<Tick>{1});
  CHECK(recording.time() == kRecordingStart + 100ms);
  CHECK_FALSE(recording.has_ended());
  CHECK(play(recording, kRecordingStart + 1h) == std::vector<Tick>{2, 3, 4});
  CHECK(recording.has_ended());
}

TEST_CASE("at speed 0 each call brings one message") {
  Log log;
  for (Tick tick = 0; tick < 3; ++tick) add_states(log, 500'000 * tick, tick);
  const TemporaryFile file(log.bytes);
  Recording recording({file.path(), "", 0}, "arena", kRecordingStart);
  for (Tick tick = 0; tick < 3; ++tick) {
    CHECK(play(recording, kRecordingStart) == std::vector<Tick>{tick});
    CHECK(recording.time() == kRecordingStart + 500ms * tick);
  }
  CHECK(play(recording, kRecordingStart).empty());
}

TEST_CASE("two files are merged by time, and times that jump do not stop the play") {
  Log states, control;
  add_states(states, 1'000'000, 1);
  add_states(states, 3'000'000, 3);
  add_states(states, -9, 4);
  add_states(states, 9'007'199'254'740'991, 5);
  add_states(states, 7, 6);
  control.add(2'000'000, "CRADLE_arena_STATES", states_of_tick(2));  // to tell the order
  const TemporaryFile states_file(states.bytes), control_file(control.bytes);
  Recording recording({control_file.path(), states_file.path(), 1}, "arena", kRecordingStart);
  CHECK(play(recording, kRecordingStart + 2s) == std::vector<Tick>{1, 2, 3, 4});
  CHECK(play(recording, kRecordingStart + 7s) ==
        std::vector<Tick>{5, 6});  // 5 s later, not 285 years
}

TEST_CASE("a client of a recording sees its ticks, is refused commands, and learns of the end") {
  Log control, states;
  control.add(0, "CRADLE_other_STATUS", heartbeat());
  control.add(1, "CRADLE_arena_STATUS", heartbeat());
  Event event;
  event.body = {1};
  event.name = "stone";
  control.add(2, "CRADLE_arena_EVENTS", encode(Events{7, 5, {event}}));
  for (Tick tick = 3; tick < 9; ++tick) add_states(states, tick, tick);
  states.bytes += "damaged";
  const TemporaryFile control_file(control.bytes), states_file(states.bytes);
  const Connection opened = open(recording_url(control_file.path(), states_file.path(), 0));
  REQUIRE(opened.client);
  Client& client = *opened.client;
  CHECK(client.is_recording());
  CHECK(client.is_alive());

  CHECK(client.spawn(ball()).refused == Result::recording);
  CHECK(client.wait(client.set_gravity({}), 10s).result == Result::recording);
  CHECK(client.shutdown().refused == Result::recording);

  std::vector<Tick> ticks;
  client.on_tick([&](Tick tick) {
    ticks.push_back(tick);
    CHECK(client.find({1})->state.p_WBo.x == static_cast<double>(tick));
  });
  while (!client.has_ended()) CHECK(client.poll() == 1);
  CHECK(ticks == std::vector<Tick>{3, 4, 5, 6, 7});  // before the damage
  CHECK(client.name({1}) == "stone");
  CHECK(client.status().rate_hz == 100);
  CHECK_FALSE(client.is_alive());
  CHECK(client.bodies().size() == 1);
  CHECK(client.statistics().datagrams_rejected == 1);
  CHECK(client.statistics().commands_sent == 0);
  CHECK(client.statistics().send_failures == 0);
}

TEST_CASE("the recording of a state port alone shows the motion of bodies without description") {
  Log log;
  for (Tick tick = 100; tick < 105; ++tick) add_states(log, 10'000 * tick, tick);
  const TemporaryFile file(log.bytes);
  const Connection opened = open("file://" + file.path() + "?speed=0");
  REQUIRE(opened.client);
  while (!opened.client->has_ended()) opened.client->poll();
  CHECK(opened.client->tick() == 104);
  CHECK(opened.client->find({1})->state.p_WBo.x == 104);
  CHECK(opened.client->about({1}) == nullptr);
  CHECK(opened.client->epoch() == 7);
}

TEST_CASE("a server that began anew in a recording does so for its client") {
  Log log;
  add_states(log, 0, 500, 7);
  add_states(log, 1, 1, 8);
  add_states(log, 2, 501, 7);  // a straggler
  add_states(log, 3, 2, 8);
  const TemporaryFile file(log.bytes);
  const Connection opened = open("file://" + file.path() + "?speed=0");
  REQUIRE(opened.client);
  std::vector<std::int64_t> epochs;
  opened.client->on_restart([&](std::int64_t epoch) { epochs.push_back(epoch); });
  while (!opened.client->has_ended()) opened.client->poll();
  CHECK(epochs == std::vector<std::int64_t>{8});
  CHECK(opened.client->tick() == 2);
}

TEST_CASE("files without a recording of the world are refused with the reason") {
  Log other;
  other.add(0, "CRADLE_other_STATUS", heartbeat());
  const TemporaryFile text("no recording\n"), wrong_world(other.bytes);
  CHECK(open("file://" + text.path()).result == Result::bad_recording);
  CHECK(open("file:///no/such/file").result == Result::bad_recording);
  CHECK(open("file:///no/such/file").message == "/no/such/file: No such file or directory");
  CHECK(open("file://" + wrong_world.path()).result == Result::no_world);
  CHECK(open("file://" + wrong_world.path()).message.find("heard instead: other") !=
        std::string::npos);
  CHECK(open("file://" + text.path() + "?speed=x").result == Result::bad_url);

  Log future;
  WorldStatus status;
  status.protocol_version = kProtocolVersion + 1;
  status.epoch = 3;
  future.add(0, "CRADLE_arena_STATUS", encode(status));
  const TemporaryFile future_file(future.bytes);
  CHECK(open("file://" + future_file.path()).result == Result::bad_version);
}
