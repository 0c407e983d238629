// The real daemon as a process, real clients over real multicast on loopback.
#include "tests/integration/daemon.h"

#include <arpa/inet.h>
#include <signal.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "protocol/transport/lcm_url.h"

namespace cradle {

using namespace std::chrono_literals;

TEST_CASE("the daemon ends cleanly within a second of SIGTERM and of SIGINT") {
  for (const int number : {SIGTERM, SIGINT}) {
    Process daemon(serve_arguments());
    REQUIRE(connect());
    daemon.signal(number);
    CHECK(daemon.wait(1s).value_or(-1) == 0);
    CHECK(daemon.output().empty());
  }
}

TEST_CASE("a start that cannot succeed says why in one line and with its exit code") {
  struct Case {
    std::vector<std::string> arguments;
    int exit_code;
    std::string part;
  };
  const std::vector<Case> cases = {
      {{"cradled", "serve", "--lcm-url", "tcp://here"}, 64, "udpm://"},
      {serve_arguments({"--scene", "no-such-scene.toml"}), 66, "no-such-scene.toml"},
      {serve_arguments({"--config", "no-such-config.toml"}), 66, "no-such-config.toml"},
      {{"cradled", "serve", "--world", "bad name"}, 64, "bad name"},
      {{"cradled", "serve", "--rate", "0.001"}, 64, "rate"},
      {{"cradled", "no-such-command"}, 64, ""},
  };
  for (const Case& c : cases) {
    const Finished finished = run(c.arguments, 10s);
    CAPTURE(c.part, finished.errors);
    CHECK(finished.exit_code == c.exit_code);
    CHECK(line_count(finished.errors) == 1);
    CHECK(finished.errors.find(c.part) != std::string::npos);
  }
}

TEST_CASE("without a multicast route the daemon says what to type") {
  const Finished can = run({"/usr/bin/unshare", "-rn", "true"}, 10s);
  if (can.exit_code != 0) {
    WARN("no network namespaces here");
    return;
  }
  const Finished finished =
      run({"/usr/bin/unshare", "-rn", CRADLE_BIN_DIR "/cradled", "serve"}, 10s);
  CHECK(finished.exit_code == 69);
  CHECK(line_count(finished.errors) == 1);
  CHECK(finished.errors.find("ip route add 224.0.0.0/4 dev lo") != std::string::npos);
}

TEST_CASE("where somebody keeps the port for himself the daemon says to choose another") {
  const auto url = parse_lcm_url(own_url());
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(url->port));
  REQUIRE(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  const Finished finished = run(serve_arguments(), 10s);
  ::close(socket);
  CHECK(finished.exit_code == 69);
  CHECK(line_count(finished.errors) == 1);
  CHECK(finished.errors.find("port " + std::to_string(url->port)) != std::string::npos);
  CHECK(finished.errors.find("choose another") != std::string::npos);
}

TEST_CASE("a client spawns a body, pushes it, sees it move, and takes it away") {
  const Process daemon(serve_arguments());
  const auto client = connect();
  REQUIRE(client);
  const BodyId ball = spawn_ball(*client, {0, 0, 100});
  REQUIRE(ball);
  Wrench kick;
  kick.body = ball;
  kick.quantity = WrenchQuantity::impulse;
  kick.value = {3, 0, 0};
  const Answer pushed = client->wait(client->push(kick), 5s);
  REQUIRE(pushed);
  REQUIRE(poll_until(*client, [&] {
    const BodyView* view = client->find(ball);
    return view != nullptr && view->tick >= pushed.tick + 30;
  }));
  // The body weighs a kilogram and flies freely: v = J / m, x = v t.
  const BodyView view = *client->find(ball);
  CHECK(view.state.v_WBcm.x == Approx(3).epsilon(1e-12));
  const double seconds = static_cast<double>(view.tick - pushed.tick + 1) / 60;
  CHECK(view.state.p_WBo.x == Approx(3 * seconds).epsilon(1e-9));

  REQUIRE(client->wait(client->despawn(ball), 5s));
  CHECK(poll_until(*client, [&] { return client->find(ball) == nullptr; }));
  CHECK(client->wait(client->despawn(ball), 5s).result == Result::unknown_body);
}

TEST_CASE("status tells the rate, the bodies and the clients") {
  const Process daemon(serve_arguments({"--rate", "120"}));
  const auto a = connect();
  const auto b = connect();
  REQUIRE((a && b));
  spawn_ball(*a, {});
  REQUIRE(poll_until(*a, [&] { return a->status().clients == 2 && a->status().bodies == 1; }));
  const WorldStatus& s = a->status();
  CHECK(s.rate_hz == 120);
  CHECK(s.name == "test");
  CHECK(s.protocol_version == 2);
  CHECK(s.controllable);
  CHECK(s.receive_buffer_bytes > 0);
  CHECK(s.commands_applied >= 3);
  REQUIRE(poll_until(*a, [&] { return a->status().tick > 60; }));
  CHECK(a->status().real_time_factor > 0);
}

TEST_CASE("under overload time slows down, and the status says so") {
  // Two thousand cubes cannot be stepped ten thousand times a second.
  const Process daemon(
      serve_arguments({"--rate", "10000", "--scene", CRADLE_SCENE_DIR "/pile.toml"}));
  const auto client = connect(60s);
  REQUIRE(client);
  REQUIRE(poll_until(
      *client, [&] { return client->status().overruns > 0; }, 60s));
  REQUIRE(poll_until(
      *client, [&] { return client->status().overloaded; }, 60s));
  REQUIRE(poll_until(
      *client, [&] { return client->status().real_time_factor < 0.99; }, 60s));
  // It still answers.
  CHECK(client->wait(client->set_gravity({0, 0, -1}), 60s));
}

TEST_CASE("in lockstep the world steps when told to, and the answer comes when it has") {
  const Process daemon(serve_arguments({"--lockstep"}));
  const auto a = connect();
  const auto b = connect();
  REQUIRE((a && b));
  CHECK(a->status().lockstep);
  const BodyId ball = spawn_ball(*a, {0, 0, 100});
  poll_until(
      *a, [] { return false; }, 300ms);
  CHECK(a->tick() == 0);

  const Answer first = a->wait(a->step(10), 5s);
  REQUIRE(first);
  CHECK(first.tick == 10);
  REQUIRE(poll_until(*a, [&] { return a->tick() == 10; }));
  const double t = 10.0 / 60;
  CHECK(a->find(ball)->state.p_WBo.z == Approx(100 - 0.5 * 9.81 * t * t).epsilon(1e-14));

  const Answer second = b->wait(b->step(5), 5s);  // any client that may control
  REQUIRE(second);
  CHECK(second.tick == 15);
  const Ticket one = a->step(100);
  const Ticket two = a->step(100);
  CHECK(a->wait(one, 10s).tick == 115);
  CHECK(a->wait(two, 10s).tick == 215);
  REQUIRE(poll_until(*a, [&] { return a->tick() == 215; }));
  CHECK(a->statistics().chunks_lost == 0);  // the states of every tick have come
}

TEST_CASE("a command for a later tick is queued, then takes effect exactly there") {
  const Process daemon(serve_arguments({"--lockstep"}));
  const auto client = connect();
  REQUIRE(client);
  BodySpec spec;
  spec.mass_kg = 1;
  spec.p_WBo = {0, 0, 10};
  const Ticket later = client->spawn(spec, Client::at(20));
  const Ticket sooner = client->spawn(spec, Client::at(10));
  REQUIRE(client->wait(client->step(9), 5s));
  CHECK_FALSE(client->answer(sooner));
  REQUIRE(client->wait(client->step(21), 5s));
  const Answer at_10 = client->wait(sooner, 5s);
  const Answer at_20 = client->wait(later, 5s);
  CHECK(at_10.tick == 10);
  CHECK(at_20.tick == 20);
  CHECK(at_10.body < at_20.body);
  REQUIRE(poll_until(*client, [&] { return client->tick() == 30; }));
  // Alive for 21 and 11 ticks.
  for (const auto& [body, ticks] : {std::pair{at_10.body, 21}, std::pair{at_20.body, 11}}) {
    const double t = ticks / 60.0;
    CHECK(client->find(body)->state.p_WBo.z == Approx(10 - 0.5 * 9.81 * t * t).epsilon(1e-14));
  }
  CHECK(client->wait(client->spawn(spec, Client::at(5)), 5s).result == Result::late);
}

TEST_CASE("a paused world stands still, steps on command, and goes on") {
  const Process daemon(serve_arguments());
  const auto client = connect();
  REQUIRE(client);
  CHECK(client->wait(client->step(1), 5s).result == Result::not_allowed);  // it is running
  const Answer paused = client->wait(client->pause(), 5s);
  REQUIRE(paused);
  const BodyId ball = spawn_ball(*client, {0, 0, 50});
  REQUIRE(
      poll_until(*client, [&] { return client->find(ball) != nullptr; }));  // seen though paused
  const Tick tick = client->tick();
  const Answer stepped = client->wait(client->step(3), 5s);
  REQUIRE(stepped);
  CHECK(stepped.tick == tick + 3);
  REQUIRE(poll_until(*client, [&] { return client->tick() == tick + 3; }));
  REQUIRE(client->wait(client->resume(), 5s));
  CHECK(poll_until(*client, [&] { return client->tick() > tick + 10; }));
}

TEST_CASE("what the configuration forbids is refused") {
  const std::string file = "cradle-test-" + std::to_string(::getpid()) + ".toml";
  std::ofstream(file) << "allow_control = false\nallow_shutdown = false\n";
  const Process daemon(serve_arguments({"--config", file}));
  const auto client = connect();
  REQUIRE(client);
  CHECK_FALSE(client->status().controllable);
  CHECK(client->wait(client->pause(), 5s).result == Result::not_allowed);
  CHECK(client->wait(client->shutdown(), 5s).result == Result::not_allowed);
  std::remove(file.c_str());
}

TEST_CASE("a world takes as many bodies as its configuration says") {
  const std::string file = "cradle-test-" + std::to_string(::getpid()) + ".toml";
  std::ofstream(file) << "bodies_max = 2\n";
  const Process daemon(serve_arguments({"--config", file}));
  const auto client = connect();
  REQUIRE(client);
  CHECK(spawn_ball(*client, {}));
  CHECK(spawn_ball(*client, {2, 0, 0}));
  const Answer third = client->wait(client->spawn(ball_spec({4, 0, 0})), 5s);
  CHECK(third.result == Result::over_quota);
  std::remove(file.c_str());
}

TEST_CASE("a slow world is found, answers and describes itself at once") {
  const Process daemon(
      serve_arguments({"--scene", CRADLE_SCENE_DIR "/pile.toml", "--lockstep", "--rate", "1"}));
  const auto client = connect(5s);  // the heartbeat comes twice a second, however slow the ticks
  REQUIRE(client);
  CHECK(poll_until(*client, [&] {
    return client->bodies().size() > 2000 &&
           std::all_of(client->bodies().begin(), client->bodies().end(), [&](const BodyView& view) {
             return client->about(view.state.body) != nullptr;
           });
  }));
}

TEST_CASE("a client may end the daemon if the configuration lets it") {
  const std::string file = "cradle-test-" + std::to_string(::getpid()) + ".toml";
  std::ofstream(file) << "allow_shutdown = true\n";
  Process daemon(serve_arguments({"--config", file}));
  const auto client = connect();
  REQUIRE(client);
  CHECK(client->wait(client->shutdown(), 5s));
  CHECK(daemon.wait(5s).value_or(-1) == 0);
  std::remove(file.c_str());
}

TEST_CASE("a body thrown beyond the limits is quarantined, told, and the world lives on") {
  const Process daemon(serve_arguments());
  const auto client = connect();
  REQUIRE(client);
  const BodyId doomed = spawn_ball(*client, {0, 0, 1});
  const BodyId steady = spawn_ball(*client, {5, 0, 1});
  std::vector<Event> told;
  client->on_event([&](const Event& event) {
    if (event.kind == EventKind::quarantined) told.push_back(event);
  });
  Wrench push;
  push.body = doomed;
  push.value = {1e15, 0, 0};
  REQUIRE(client->wait(client->push(push), 5s));
  REQUIRE(poll_until(*client, [&] { return !told.empty(); }));
  CHECK(told[0].body == doomed);
  CHECK(told[0].reason == Result::out_of_range);
  CHECK(client->wait(client->push(push), 5s).result == Result::wrong_kind);
  const Tick now = client->tick();
  REQUIRE(poll_until(*client, [&] { return client->tick() > now + 10; }));
  CHECK(client->find(doomed)->state.quarantined);
  CHECK(client->find(steady)->state.p_WBo.z < 1);
  CHECK(poll_until(*client, [&] { return client->status().quarantined == 1; }));
}

TEST_CASE("a client that comes late learns what is there") {
  const Process daemon(serve_arguments({"--scene", CRADLE_SCENE_DIR "/demo.toml", "--lockstep"}));
  const auto client = connect();
  REQUIRE(client);
  REQUIRE(poll_until(*client, [&] { return client->status().bodies > 0; }));
  const auto bodies = static_cast<std::size_t>(client->status().bodies);
  REQUIRE(poll_until(*client, [&] { return client->bodies().size() == bodies; }));
  CHECK(poll_until(*client, [&] {
    return std::all_of(client->bodies().begin(), client->bodies().end(), [&](const BodyView& view) {
      return client->about(view.state.body) != nullptr;
    });
  }));
}

TEST_CASE("the same lockstep run twice gives the same states to the last bit") {
  std::map<std::int64_t, BodyState> runs[2];
  for (auto& states : runs) {
    const Process daemon(serve_arguments({"--scene", CRADLE_SCENE_DIR "/demo.toml", "--lockstep"}));
    const auto client = connect();
    REQUIRE(client);
    const Ticket spawned = client->spawn(ball_spec({0.3, 0, 6}), Client::at(30));
    REQUIRE(client->wait(client->step(200), 30s));
    REQUIRE(client->wait(spawned, 5s));
    REQUIRE(poll_until(*client, [&] { return client->tick() == 200; }));
    for (const BodyView& view : client->bodies()) states[view.state.body.value] = view.state;
  }
  CHECK(runs[0].size() > 3);
  CHECK(runs[0] == runs[1]);
}

}  // namespace cradle
