// Hours of work in minutes: against a real daemon, with the real client library, over loopback.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <deque>
#include <fstream>
#include <random>
#include <set>

#include "tests/integration/daemon.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;

constexpr double kFlat = 1.01;

/// Memory of a process, sampled over a run: flat if, once the first quarter is done, it never again
/// rises above what it was then by more than 1 %.
class MemoryWatch {
 public:
  explicit MemoryWatch(int process) : process_(process) {}

  /// `done` of `all`: how far the run has come.
  void sample(int done, int all) {
    const long now_kB = anonymous_kB(process_);
    if (4 * done < all) return;
    if (settled_kB_ == 0) settled_kB_ = now_kB;
    most_kB_ = std::max(most_kB_, now_kB);
  }

  bool is_flat() const {
    return settled_kB_ > 0 &&
           static_cast<double>(most_kB_) <= kFlat * static_cast<double>(settled_kB_);
  }
  std::string text() const {
    return std::to_string(settled_kB_) + " kB after the warm-up, at most " +
           std::to_string(most_kB_) + " kB later";
  }

 private:
  int process_;
  long settled_kB_ = 0;
  long most_kB_ = 0;
};

// A million bodies.
constexpr int kClients = 4;
constexpr int kBatch = 40;  // bodies of one list
constexpr int kRounds = 6250;
static_assert(kClients * kBatch * kRounds == 1'000'000);

/// A body that a client has made, and what tells it from every other one.
struct Made {
  BodyId body;
  std::int64_t serial = 0;

  std::string name() const { return "body " + std::to_string(serial); }
  double mass_kg() const { return 1 + 1e-6 * static_cast<double>(serial); }
  double speed_mps() const { return 1e-6 * static_cast<double>(serial); }

  BodySpec spec() const {
    BodySpec s;
    s.name = name();
    s.mass_kg = mass_kg();
    s.shape = Shape::sphere(0.1);
    s.p_WBo = {0, 0, 10 * static_cast<double>(serial)};  // nobody meets anybody
    s.v_WBcm = {speed_mps(), 0, 0};
    return s;
  }
};

/// One of the clients and its bodies: batches that come as a whole, and go mixed with others.
struct Owner {
  std::unique_ptr<Client> client;
  std::deque<std::vector<Made>> batches;
  Ticket ticket;

  void send_spawn(std::int64_t& serial) {
    std::vector<Made>& batch = batches.emplace_back();
    std::vector<BodySpec> specs;
    for (int i = 0; i < kBatch; ++i) {
      batch.push_back({{}, ++serial});
      specs.push_back(batch.back().spec());
    }
    ticket = client->spawn(specs);
  }

  /// Half of the last but one batch, and what is left of the one before.
  void send_despawn(std::vector<BodyId>& removed) {
    removed.clear();
    if (batches.size() == 3) {
      for (const Made& made : batches.front()) removed.push_back(made.body);
      batches.pop_front();
    }
    if (batches.size() == 2) {
      std::vector<Made> kept;
      for (std::size_t i = 0; i < batches.front().size(); ++i) {
        const Made& made = batches.front()[i];
        if (i % 2 == 0) {
          kept.push_back(made);
        } else {
          removed.push_back(made.body);
        }
      }
      batches.front() = std::move(kept);
    }
    ticket = removed.empty() ? Ticket{} : client->despawn(removed);
  }
};

/// True if what `client` sees is exactly `alive`, each with its own name, mass and motion.
bool sees_exactly(const Client& client, const std::vector<Made>& alive) {
  if (client.bodies().size() != alive.size()) return false;
  for (std::size_t i = 0; i < alive.size(); ++i) {
    const Made& made = alive[i];
    const BodyView& view = client.bodies()[i];
    const Event* about = client.about(made.body);
    const bool is_right = view.state.body == made.body && about != nullptr &&
                          about->name == made.name() && about->mass_kg == made.mass_kg() &&
                          view.state.v_WBcm.x == made.speed_mps() &&
                          view.state.p_WBo.z == 10 * static_cast<double>(made.serial) &&
                          client.find_by_name(made.name()) == made.body;
    if (!is_right) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("endurance: a million bodies come and go, memory stays flat and no id is confused") {
  const Process daemon(serve_arguments({"--lockstep"}));
  std::array<Owner, kClients> owners;
  for (Owner& owner : owners) {
    owner.client = connect();
    REQUIRE(owner.client);
  }
  Client& first = *owners[0].client;
  REQUIRE(first.wait(first.set_gravity({}), 20s));
  MemoryWatch of_daemon(daemon.id());
  MemoryWatch of_clients(::getpid());

  std::int64_t serial = 0;
  BodyId newest;
  std::vector<BodyId> removed;
  std::vector<Made> alive;
  for (int round = 1; round <= kRounds; ++round) {
    CAPTURE(round);
    for (Owner& owner : owners) owner.send_spawn(serial);
    const BodyId newest_before = newest;
    std::set<BodyId> firsts;
    for (Owner& owner : owners) {
      const Answer made = owner.client->wait(owner.ticket, 60s);
      REQUIRE(made);
      REQUIRE(made.body > newest_before);  // no id twice
      REQUIRE(firsts.insert(made.body).second);
      std::vector<Made>& batch = owner.batches.back();
      for (int i = 0; i < kBatch; ++i) {
        batch[static_cast<std::size_t>(i)].body = {made.body.value + i};
      }
      newest = std::max(newest, batch.back().body);
    }
    const BodyId brief = spawn_ball(first, {-10, 0, 0});  // the newest one goes, too
    REQUIRE(brief > newest);
    REQUIRE(first.wait(first.despawn(brief), 60s));
    newest = brief;
    for (Owner& owner : owners) {
      owner.send_despawn(removed);
      if (!owner.ticket.number) continue;
      REQUIRE(owner.client->wait(owner.ticket, 60s));
      REQUIRE(owner.client->wait(owner.client->despawn(removed.back()), 60s).result ==
              Result::unknown_body);  // what is gone stays gone
    }
    const Answer stepped = first.wait(first.step(1), 60s);
    REQUIRE(stepped);

    alive.clear();
    for (const Owner& owner : owners) {
      for (const auto& batch : owner.batches) alive.insert(alive.end(), batch.begin(), batch.end());
    }
    std::sort(alive.begin(), alive.end(),
              [](const Made& a, const Made& b) { return a.body < b.body; });
    for (Owner& owner : owners) {
      REQUIRE(poll_until(*owner.client, [&] {
        return owner.client->tick() >= stepped.tick && sees_exactly(*owner.client, alive);
      }));
    }
    if (round % 50 == 0) {
      of_daemon.sample(round, kRounds);
      of_clients.sample(round, kRounds);
    }
  }
  CHECK(newest.value == serial + kRounds);  // every id from 1 on was given once
  for (Owner& owner : owners) {
    for (const auto& batch : owner.batches) {
      for (const Made& made : batch) owner.client->despawn(made.body);
      poll_until(*owner.client, [&] { return owner.client->find(batch.back().body) == nullptr; });
    }
  }
  CHECK(poll_until(first, [&] { return first.status().bodies == 0; }));
  WARN("daemon: " << of_daemon.text() << "; clients: " << of_clients.text());
  CHECK(of_daemon.is_flat());
  CHECK(of_clients.is_flat());
}

TEST_CASE("endurance: an hour of ticks in lockstep, memory stays flat and every body is itself") {
  constexpr int kTicks = 60 * 60 * 60;
  constexpr int kStride = 15;  // enough commands for every memory of past answers to fill early
  const Process daemon(serve_arguments({"--lockstep", "--scene", CRADLE_SCENE_DIR "/demo.toml"}));
  const auto client = connect();
  const auto watcher = connect();
  REQUIRE((client && watcher));
  std::vector<BodyId> balls;
  for (int i = 0; i < 20; ++i) balls.push_back(spawn_ball(*client, {0.1 * i, 0.05 * i, 2.0 + i}));
  REQUIRE(client->wait(client->step(1), 20s));
  REQUIRE(poll_until(*watcher, [&] { return watcher->tick() == 1; }));
  std::vector<BodyId> all;
  for (const BodyView& view : watcher->bodies()) all.push_back(view.state.body);
  REQUIRE(all.size() > balls.size());

  MemoryWatch of_daemon(daemon.id());
  MemoryWatch of_clients(::getpid());
  std::mt19937 random(1);
  for (Tick tick = 1; tick < kTicks + 1; tick += kStride) {
    CAPTURE(tick);
    std::vector<Motion> throws;  // back into the heap, so that contacts come and go for the hour
    for (int k = 0; k < 4; ++k) {
      Motion motion;
      motion.body = balls[random() % balls.size()];
      motion.sets_pose = motion.sets_velocity = true;
      motion.p_WBo = {0.1 * k, 0.2 * k, 4.0 + 2 * k};
      motion.w_WB = {1, 2, 3};
      throws.push_back(motion);
    }
    REQUIRE(client->wait(client->set_motion(throws), 60s));
    const Answer stepped = client->wait(client->step(kStride), 120s);
    REQUIRE(stepped);
    REQUIRE(stepped.tick == tick + kStride);
    REQUIRE(poll_until(*watcher, [&] { return watcher->tick() == stepped.tick; }));
    REQUIRE(std::equal(all.begin(), all.end(), watcher->bodies().begin(), watcher->bodies().end(),
                       [](BodyId id, const BodyView& view) { return view.state.body == id; }));
    const int done = static_cast<int>(stepped.tick);
    of_daemon.sample(done, kTicks);
    of_clients.sample(done, kTicks);
  }
  CHECK(client->tick() >= kTicks);
  CHECK(poll_until(*client, [&] { return client->status().contacts > 0; }));
  CHECK(client->status().quarantined == 0);
  WARN("daemon: " << of_daemon.text() << "; clients: " << of_clients.text());
  CHECK(of_daemon.is_flat());
  CHECK(of_clients.is_flat());
}

}  // namespace cradle
