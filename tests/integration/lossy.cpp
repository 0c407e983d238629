// Exactly once and in order over a network that loses, doubles and reorders, both ways.
#include "protocol/transport/lossy.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <map>
#include <thread>

#include "client/src/client_core.h"
#include "protocol/transport/in_process.h"
#include "server/daemon.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int kLossyClients = 4;
constexpr int kCommands = 2500;  // of each client
constexpr int kPerTick = 250;    // as many as the window lets wait, and a few more

/// A daemon in lockstep in a thread of its own, behind a bad network.
class Server {
 public:
  Server(InProcessBus& control, InProcessBus& states, const Lossiness& lossiness)
      : daemon_(options(), Scene{}, make_lossy(control.join(), lossiness), states.join()),
        thread_([this] { daemon_.run(stop_); }) {}
  ~Server() { end(); }

  /// The world after its end.
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
    return options;
  }

  int stop_ = ::eventfd(0, EFD_CLOEXEC);
  Daemon daemon_;
  std::thread thread_;
};

/// One client: every command names its tick, so that the world's history is fixed.
struct Player {
  std::unique_ptr<ClientCore> core;
  std::vector<Ticket> tickets;
  Ticket last;
  bool has_failed = false;
  int given = 0;
};

BodySpec body_of(int client, int command) {
  BodySpec spec;
  spec.shape = Shape::sphere(0.4);
  spec.mass_kg = 1;
  spec.p_WBo = {1.0 * (command % 50), 1.0 * client, 1.0 + command / 50};
  spec.name = std::to_string(client) + "-" + std::to_string(command);
  return spec;
}

struct Played {
  std::array<std::uint8_t, 8> hash{};
  std::int64_t bodies = 0;
  std::int64_t resends = 0;
};

/// Four clients give 10 000 spawns, 250 each before every tick, then the world steps.
Played play_lossy(const Lossiness& lossiness) {
  InProcessBus control;
  InProcessBus states;
  Server server(control, states, lossiness);
  std::vector<Player> players(kLossyClients);
  for (int i = 0; i < kLossyClients; ++i) {
    Lossiness own = lossiness;
    own.seed = lossiness.seed * 100 + static_cast<std::uint64_t>(i);
    Player& player = players[static_cast<std::size_t>(i)];
    player.core = std::make_unique<ClientCore>(
        "test", "player", make_lossy(control.join(), own),
        [&](int) {
          return OpenedTransport{states.join(), Result::ok, ""};
        },
        ClientCore::Identity{i + 1, 1});
    player.core->callbacks.on_answer = [&player](Ticket, const Answer& answer) {
      player.has_failed = player.has_failed || answer.result != Result::ok;
    };
  }
  const auto poll_until = [&](const auto& is_done) {
    const auto deadline = Clock::now() + 120s;
    while (!is_done()) {
      REQUIRE(Clock::now() < deadline);
      for (Player& player : players) player.core->poll(Clock::now());
      std::this_thread::sleep_for(200us);
    }
  };
  const auto all = [&](const auto& predicate) {
    return std::all_of(players.begin(), players.end(), predicate);
  };
  poll_until([&] {
    return all([](Player& p) { return p.core->welcome() == ClientCore::Welcome::given; });
  });

  constexpr int kTicks = kCommands / kPerTick;
  for (int tick = 1; tick <= kTicks; ++tick) {
    for (int i = 0; i < kLossyClients; ++i) {
      Player& player = players[static_cast<std::size_t>(i)];
      for (int k = 0; k < kPerTick; ++k) {
        const CommandBody body = Spawn{{body_of(i, player.given++)}};
        player.tickets.push_back(player.core->submit(body, tick, Clock::now()));
        REQUIRE(player.tickets.back());
      }
    }
    // Commands are taken in sequence: when one given after them is answered, the server has them.
    for (Player& player : players) {
      player.last = player.core->submit(SetGravity{{0, 0, -9.81}}, 0, Clock::now());
    }
    poll_until([&] { return all([](Player& p) { return p.core->answer(p.last).has_value(); }); });
    const Ticket step = players[0].core->submit(Control{ControlAction::step, 1}, 0, Clock::now());
    poll_until([&] {
      return players[0].core->answer(step).has_value() && all([](Player& p) {
               return std::all_of(p.tickets.end() - kPerTick, p.tickets.end(),
                                  [&](Ticket t) { return p.core->answer(t).has_value(); });
             });
    });
  }

  Played played;
  for (const Player& player : players) {
    played.resends += player.core->statistics().resends;
    CHECK_FALSE(player.has_failed);
    BodyId before;
    for (std::size_t k = 0; k < player.tickets.size(); ++k) {
      const auto answer = player.core->answer(player.tickets[k]);
      REQUIRE(answer);
      CHECK(answer->body > before);  // in the order in which they were given
      before = answer->body;
      CHECK(answer->tick == static_cast<Tick>(k / kPerTick) + 1);
    }
  }
  const World& world = server.end();
  played.hash = world.hash();
  played.bodies = world.body_count();
  return played;
}

}  // namespace

TEST_CASE("over a lossy network every command happens once, in order, and at its tick") {
  const Played perfect = play_lossy({});
  CHECK(perfect.bodies == kLossyClients * kCommands);
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u}) {
    CAPTURE(seed);
    const Played lossy =
        play_lossy({.seed = seed, .loss = 0.2, .duplication = 0.1, .reordering = 0.1});
    CHECK(lossy.bodies == perfect.bodies);
    CHECK(lossy.hash == perfect.hash);
    CHECK(lossy.resends > 0);
  }
}

TEST_CASE("over a network that is late as well, the same") {
  const Played perfect = play_lossy({});
  const Played late = play_lossy({.seed = 7,
                                  .loss = 0.2,
                                  .duplication = 0.1,
                                  .reordering = 0.1,
                                  .held_back_max = 8,
                                  .delay_max = 20ms});
  CHECK(late.bodies == perfect.bodies);
  CHECK(late.hash == perfect.hash);
}

TEST_CASE("a network that loses half of everything only slows the clients down") {
  const Played perfect = play_lossy({});
  const Played lossy = play_lossy({.seed = 6, .loss = 0.5, .duplication = 0.1, .reordering = 0.1});
  CHECK(lossy.hash == perfect.hash);
}

}  // namespace cradle
