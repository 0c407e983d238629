// What lcm-logger records of a daemon: played to a client, and by lcm-logplayer to a live daemon.
#include <signal.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <map>
#include <thread>

#include "protocol/transport/lcm_transport.h"
#include "server/daemon.h"
#include "tests/integration/daemon.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

LcmUrl control_url() { return *parse_lcm_url(own_url()); }
std::string states_url() { return control_url().state_lane().text(); }

/// A folder for one test, gone after it.
struct RecordingFolder {
  ~RecordingFolder() { fs::remove_all(path); }
  std::string file(const std::string& name) const { return (path / name).string(); }
  fs::path path = new_folder();
};

/// A daemon of which two loggers record a ball's flight.
struct RecordedRun {
  RecordedRun() {
    Process daemon(serve_arguments());
    Process control_logger({"/usr/bin/lcm-logger", "--lcm-url=" + own_url(), control});
    Process states_logger({"/usr/bin/lcm-logger", "--lcm-url=" + states_url(), states});
    const auto client = connect();
    REQUIRE(client);
    const auto has_begun = [](const std::string& file) {
      std::error_code none;
      return fs::file_size(file, none) > 0 && !none;
    };
    REQUIRE(poll_until(*client, [&] { return has_begun(control) && has_begun(states); }));

    BodySpec spec = ball_spec({0, 0, 100});
    spec.name = "ball";
    ball = client->wait(client->spawn(spec), 5s).body;
    REQUIRE(ball);
    client->on_tick([&](Tick tick) {
      if (const BodyView* view = client->find(ball); view && view->tick == tick) {
        seen[tick] = view->state;
      }
    });
    Wrench kick;
    kick.body = ball;
    kick.quantity = WrenchQuantity::impulse;
    kick.value = {3, 0, 0};
    const Answer pushed = client->wait(client->push(kick), 5s);
    REQUIRE(pushed);
    REQUIRE(poll_until(*client, [&] { return client->tick() > pushed.tick + 60; }));
    REQUIRE(client->wait(client->despawn(ball), 5s));
    REQUIRE(poll_until(*client, [&] { return client->find(ball) == nullptr; }));
    const std::int64_t end_us = client->status().tick_time_us;
    REQUIRE(poll_until(*client, [&] { return client->status().tick_time_us > end_us; }));
    epoch = client->epoch();
    for (Process* logger : {&control_logger, &states_logger}) {
      std::this_thread::sleep_for(300ms);  // it writes every 100 ms
      logger->signal(SIGINT);
      REQUIRE(logger->wait(10s));
    }
  }

  RecordingFolder folder;
  std::string control = folder.file("control.log");
  std::string states = folder.file("states & more.log");
  BodyId ball;
  std::int64_t epoch = 0;
  std::map<Tick, BodyState> seen;
};

std::unique_ptr<Client> open(const std::string& url) {
  ClientOptions options;
  options.lcm_url = url;
  options.world = "test";
  Connection connection = Client::connect(options, 1s);
  CAPTURE(connection.message);
  REQUIRE(connection.client);
  return std::move(connection.client);
}

/// A live daemon within this process, whose world can be asked for its hash.
class LiveDaemon {
 public:
  LiveDaemon()
      : daemon_(options(), Scene{}, transport(control_url()),
                transport(control_url().state_lane())),
        thread_([this] { daemon_.run(stop_); }) {}
  ~LiveDaemon() { end(); }

  const World& end() {
    if (thread_.joinable()) {
      ::eventfd_write(stop_, 1);
      thread_.join();
      ::close(stop_);
    }
    return daemon_.world();
  }

 private:
  static Daemon::Options options() {
    Daemon::Options options;
    options.world = "test";
    options.lockstep = true;
    options.state_port = control_url().port + 1;
    return options;
  }
  static std::unique_ptr<Transport> transport(const LcmUrl& url) {
    return open_lcm_transport(url, Lane::send_and_receive).transport;
  }

  int stop_ = ::eventfd(0, EFD_CLOEXEC);
  Daemon daemon_;
  std::thread thread_;
};

struct Lived {
  std::array<std::uint8_t, 8> hash{};
  std::int64_t bodies = 0, applied = 0, refused = 0, strangers = 0, restarts = 0;
};

/// A client's life with a world of its own, while `meanwhile` happens in the network.
Lived live(const std::function<void(Client&)>& meanwhile) {
  LiveDaemon daemon;
  const auto client = connect();
  REQUIRE(client);
  const std::int64_t epoch = client->epoch();
  const BodyId mine = spawn_ball(*client, {0, 0, 50});
  REQUIRE(client->wait(client->step(30), 20s));
  meanwhile(*client);
  REQUIRE(client->wait(client->step(30), 20s));
  REQUIRE(poll_until(*client, [&] { return client->tick() == 60; }));
  CHECK(client->epoch() == epoch);
  REQUIRE(client->bodies().size() == 1);
  CHECK(client->bodies()[0].state.body == mine);
  CHECK(client->name(mine).empty());
  const WorldStatus before = client->status();
  REQUIRE(poll_until(*client, [&] { return client->status() != before; }));
  const WorldStatus& status = client->status();
  const ClientStatistics statistics = client->statistics();
  Lived lived{{},
              status.bodies,
              status.commands_applied,
              status.commands_refused,
              statistics.strangers,
              statistics.restarts};
  lived.hash = daemon.end().hash();
  return lived;
}

}  // namespace

TEST_CASE("what lcm-logger records of a run, a client of the files sees again to the last bit") {
  const RecordedRun run;
  const auto client = open(recording_url(run.control, run.states, 0));
  std::map<Tick, BodyState> seen;
  std::vector<Event> events;
  client->on_event([&](const Event& event) {
    if (event.kind != EventKind::described) events.push_back(event);
  });
  client->on_tick([&](Tick tick) {
    if (const BodyView* view = client->find(run.ball); view && view->tick == tick) {
      seen[tick] = view->state;
    }
  });
  CHECK(client->spawn(ball_spec({})).refused == Result::recording);
  while (!client->has_ended()) client->poll();
  CHECK(client->epoch() == run.epoch);
  int common = 0;
  for (const auto& [tick, state] : seen) {
    const auto found = run.seen.find(tick);
    if (found == run.seen.end()) continue;
    ++common;
    CHECK(state == found->second);
  }
  CHECK(common > 30);  // lcm-logger may lose some
  REQUIRE(events.size() == 2);
  CHECK(events[0].name == "ball");
  CHECK(events[1].kind == EventKind::removed);
  CHECK(client->find(run.ball) == nullptr);
  CHECK(client->statistics().datagrams_rejected == 0);
  CHECK(client->status().name == "test");

  const Finished replayed =
      cradle::run({"cradle", "replay", run.control, run.states, "--fast", "--world", "test"});
  CAPTURE(replayed.output, replayed.errors);
  CHECK(replayed.exit_code == 0);
  CHECK(replayed.output.find("end of the recording") != std::string::npos);
  CHECK(replayed.output.find("ball gone") != std::string::npos);
  const Finished states_alone =
      cradle::run({"cradle", "replay", run.states, "--speed", "10", "--world", "test"});
  CHECK(states_alone.exit_code == 0);
  CHECK(states_alone.output.find("end of the recording") != std::string::npos);
  const Finished pushed = cradle::run({"cradle", "push", "1", "--force", "1", "0", "0", "--world",
                                       "test", "--lcm-url", "file://" + run.control});
  CHECK(pushed.exit_code == 1);
  CHECK(pushed.errors == "cradle: refused: recording\n");
  const Finished wrong = cradle::run({"cradle", "replay", CRADLE_SOURCE_DIR "/README.md"});
  CHECK(wrong.exit_code == 69);
  CHECK(line_count(wrong.errors) == 1);
}

TEST_CASE("a recording played into a live world is refused, counted, and confuses no client") {
  const RecordedRun run;
  const Lived alone = live([](Client&) {});
  const Lived disturbed = live([&](Client& client) {
    const auto played = [](const std::string& url, const std::string& file) {
      return std::vector<std::string>{"/usr/bin/lcm-logplayer", "--lcm-url=" + url, "--speed=2",
                                      file};
    };
    Process control(played(own_url(), run.control));
    Process states(played(states_url(), run.states));
    REQUIRE(poll_until(
        client, [&] { return !control.is_running() && !states.is_running(); }, 60s));
    CHECK(control.wait(0ms) == 0);
    CHECK(states.wait(0ms) == 0);
  });
  CHECK(disturbed.hash == alone.hash);
  CHECK(disturbed.bodies == 1);
  CHECK(alone.refused == 0);
  CHECK(disturbed.refused >= 4);  // hello, spawn, push, despawn
  CHECK(disturbed.strangers >= 2);
  CHECK(alone.strangers == 0);
  CHECK(disturbed.restarts == 0);
  CHECK(disturbed.applied == alone.applied);
}

}  // namespace cradle
