// Servers and clients that end, come again, or come twice: each ends in a state that the client
// library reports.
#include <cradle/limits.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <thread>

#include "client/src/client_core.h"
#include "protocol/transport/in_process.h"
#include "server/daemon.h"
#include "server/exit_code.h"
#include "server/log.h"
#include "tests/integration/daemon.h"

using namespace cradle;
using namespace std::chrono_literals;

TEST_CASE("a daemon that is killed and started again finds its clients, who know") {
  auto server = std::make_unique<Process>(serve_arguments());
  const auto client = connect();
  REQUIRE(client);
  const BodyId ball = spawn_ball(*client, {0, 0, 5});
  REQUIRE(poll_until(*client, [&] { return client->find(ball) != nullptr; }));
  const std::int64_t first_epoch = client->epoch();
  std::vector<std::int64_t> restarts;
  client->on_restart([&](std::int64_t epoch) { restarts.push_back(epoch); });

  server->signal(SIGKILL);
  REQUIRE(server->wait(5s) == 128 + SIGKILL);
  const Ticket lost = client->despawn(ball);
  REQUIRE(lost);
  CHECK(client->wait(lost, 100ms).result == Result::timed_out);
  REQUIRE(poll_until(*client, [&] { return !client->is_alive(); }));

  server = std::make_unique<Process>(serve_arguments());
  REQUIRE(poll_until(*client, [&] { return !restarts.empty(); }));
  CHECK(client->answer(lost)->result == Result::world_restarted);
  CHECK(restarts == std::vector{client->epoch()});
  CHECK(client->epoch() != first_epoch);
  CHECK(client->bodies().empty());
  CHECK(client->is_alive());
  CHECK(spawn_ball(*client, {0, 0, 5}));
  CHECK(client->statistics().restarts == 1);
}

TEST_CASE(
    "a client that is killed and started again finds its bodies, with its number or another") {
  Process server(serve_arguments());
  const std::int64_t number = GENERATE(0, 42);
  const auto visit = [&](const char* name) {
    ClientOptions options;
    options.lcm_url = own_url();
    options.world = "test";
    options.name = name;
    options.number = number;
    return Client::connect(options, 20s);
  };
  Process first([&] {
    const Connection world = visit("first");
    if (!world.client) return 1;
    BodySpec spec = ball_spec({0, 0, 5});
    spec.name = "left";
    for (int i = 0; i < 10; ++i) world.client->spawn(ball_spec({2.0 * i, 3, 5}));
    if (!world.client->wait(world.client->spawn(spec), 10s)) return 2;
    world.client->spawn(ball_spec({0, 9, 5}), Client::at(1'000'000));  // never comes
    std::raise(SIGKILL);
    return 3;
  });
  REQUIRE(first.wait(30s) == 128 + SIGKILL);

  const Connection world = visit("second");
  REQUIRE(world.client);
  REQUIRE(poll_until(*world.client, [&] { return bool(world.client->find_by_name("left")); }));
  CHECK(world.client->find_by_name("left") == BodyId{11});
  CHECK(spawn_ball(*world.client, {0, 6, 5}) == BodyId{12});  // done, not taken for an old command
  CHECK(world.client->wait(world.client->despawn(world.client->find_by_name("left")), 10s));
}

TEST_CASE("of two live clients with one number, the first is told so, the second works") {
  Process server(serve_arguments());
  ClientOptions options;
  options.lcm_url = own_url();
  options.world = "test";
  options.number = 42;
  const Connection first = Client::connect(options, 20s);
  REQUIRE(first.client);
  const Connection second = Client::connect(options, 20s);
  REQUIRE(second.client);
  CHECK(spawn_ball(*second.client, {0, 0, 5}));
  const Ticket lost = first.client->spawn(ball_spec({0, 3, 5}));
  CHECK(first.client->wait(lost, 10s).result == Result::superseded);
  CHECK(spawn_ball(*second.client, {0, 6, 5}));
}

TEST_CASE("a second daemon of a world on one host says so and ends, the first goes on") {
  Process server(serve_arguments());
  const auto client = connect();
  REQUIRE(client);
  const std::int64_t epoch = client->epoch();

  const Finished second = run(serve_arguments());
  CHECK(second.exit_code == kExitTaken);
  CHECK(line_count(second.errors) == 1);
  CHECK(second.errors.find("another daemon serves world \"test\"") != std::string::npos);

  Process other(
      {"cradled", "serve", "--lcm-url", own_url(), "--world", "other"});  // a port, two worlds
  CHECK(spawn_ball(*client, {0, 0, 5}));
  CHECK(client->epoch() == epoch);
  CHECK_FALSE(client->is_contested());
  CHECK(other.is_running());
  server.signal(SIGTERM);
  REQUIRE(server.wait(5s) == 0);
  Process heir(serve_arguments());  // the lock ended with its holder
  REQUIRE(poll_until(*client, [&] { return client->epoch() != epoch && client->is_alive(); }));
}

namespace {

Daemon::Options test_world() {
  Daemon::Options options;
  options.world = "test";
  return options;
}

}  // namespace

TEST_CASE("a daemon hears another one of its world on the network, before it starts and after") {
  InProcessBus control;
  InProcessBus states;
  Daemon first(test_world(), Scene{}, control.join(), states.join());
  CHECK(first.look_around(true).hears_itself);
  CHECK_FALSE(first.look_around(true).has_rival);
  Daemon second(test_world(), Scene{}, control.join(), states.join());

  const int stop = ::eventfd(0, EFD_CLOEXEC);
  set_log_level("info");  // makes the log before two threads want it at once
  std::thread serving([&] { first.run(stop); });
  CHECK(second.look_around(true).has_rival);
  std::thread rival([&] { second.run(stop); });  // as when two networks are joined

  ClientCore core("test", "witness", control.join(), [&](int) {
    return OpenedTransport{states.join(), Result::ok, ""};
  });
  const auto deadline = std::chrono::steady_clock::now() + 20s;
  const auto is_seen = [&] { return core.is_contested() && core.status().contested; };
  while (!is_seen() && std::chrono::steady_clock::now() < deadline) {
    core.poll(std::chrono::steady_clock::now());
    std::this_thread::sleep_for(1ms);
  }
  CHECK(core.is_contested());
  CHECK(core.status().contested);
  CHECK(core.submit(SetGravity{}, 0, std::chrono::steady_clock::now()).refused ==
        Result::contested);
  ::eventfd_write(stop, 1);
  serving.join();
  rival.join();
  ::close(stop);
}

TEST_CASE("a world that has no room for clients is seen by spectators all the same") {
  InProcessBus control;
  InProcessBus states;
  Daemon daemon(test_world(), Scene{}, control.join(), states.join());
  const int stop = ::eventfd(0, EFD_CLOEXEC);
  std::thread serving([&] { daemon.run(stop); });
  const auto join = [&](const ClientCore::Identity& identity) {
    return std::make_unique<ClientCore>(
        "test", "visitor", control.join(),
        [&](int) {
          return OpenedTransport{states.join(), Result::ok, ""};
        },
        identity);
  };
  std::vector<std::unique_ptr<ClientCore>> clients;
  for (int i = 0; i < limits::kClients; ++i) clients.push_back(join({}));
  const auto poll_all_until = [&](const auto& is_done) {
    const auto deadline = std::chrono::steady_clock::now() + 20s;
    while (!is_done() && std::chrono::steady_clock::now() < deadline) {
      for (const auto& client : clients) client->poll(std::chrono::steady_clock::now());
      std::this_thread::sleep_for(1ms);
    }
  };
  const auto are_welcome = [&] {
    return std::all_of(clients.begin(), clients.end(), [](const auto& client) {
      return client->welcome() == ClientCore::Welcome::given;
    });
  };
  poll_all_until(are_welcome);
  CHECK(are_welcome());

  clients.push_back(join({}));
  poll_all_until([&] { return clients.back()->welcome() == ClientCore::Welcome::forgotten; });
  CHECK(clients.back()->hello_result() == Result::over_quota);
  clients.push_back(join({0, 1, true}));
  const ClientCore& spectator = *clients.back();
  poll_all_until([&] { return spectator.status().clients == limits::kClients; });
  CHECK(spectator.status().clients == limits::kClients);
  CHECK(clients.back()->submit(SetGravity{}, 0, std::chrono::steady_clock::now()).refused ==
        Result::not_allowed);
  ::eventfd_write(stop, 1);
  serving.join();
  ::close(stop);
}
