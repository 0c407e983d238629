// Many client processes at once.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "tests/integration/daemon.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;

constexpr int kCrowd = 8;
constexpr int kBodiesOfEach = 20;

/// One of the crowd: spawns, pushes, reads back, despawns. The number of the first thing that goes
/// wrong, or 0.
int play(int number) {
  const auto client = connect();
  if (!client) return 1;
  std::set<BodyId> mine;
  // Half of them one by one, half in one batch; each client in a row of its own.
  std::vector<Ticket> tickets;
  const auto place = [&](int i) { return Vec3{3.0 * i, 100.0 * number, 1000}; };
  for (int i = 0; i < kBodiesOfEach / 2; ++i) tickets.push_back(client->spawn(ball_spec(place(i))));
  for (const Ticket& ticket : tickets) mine.insert(client->wait(ticket, 30s).body);
  std::vector<BodySpec> batch;
  for (int i = kBodiesOfEach / 2; i < kBodiesOfEach; ++i) batch.push_back(ball_spec(place(i)));
  const Answer made = client->wait(client->spawn(batch), 30s);
  if (!made) return 2;
  for (int i = 0; i < kBodiesOfEach / 2; ++i) mine.insert({made.body.value + i});
  if (mine.size() != kBodiesOfEach || mine.contains(BodyId{})) return 3;

  std::vector<Wrench> kicks;
  for (const BodyId body : mine) {
    Wrench kick;
    kick.body = body;
    kick.quantity = WrenchQuantity::impulse;
    kick.value = {0, 1.0 + number, 0};
    kicks.push_back(kick);
  }
  const Answer pushed = client->wait(client->push(kicks), 30s);
  if (!pushed) return 4;
  const bool is_seen = poll_until(*client, [&] {
    return std::all_of(mine.begin(), mine.end(), [&](BodyId body) {
      const BodyView* view = client->find(body);
      return view != nullptr && view->tick >= pushed.tick;
    });
  });
  if (!is_seen) return 5;
  for (const BodyId body : mine) {  // every one has its own client's push, once
    if (std::abs(client->find(body)->state.v_WBcm.y - (1.0 + number)) > 1e-12) return 6;
  }

  const std::vector<BodyId> all(mine.begin(), mine.end());
  const std::span<const BodyId> half(all.data(), all.size() / 2);
  if (!client->wait(client->despawn(half), 30s)) return 7;
  for (const BodyId body : std::span(all).subspan(half.size())) {
    if (!client->wait(client->despawn(body), 30s)) return 8;
  }
  const bool is_gone = poll_until(*client, [&] {
    return std::none_of(all.begin(), all.end(), [&](BodyId b) { return client->find(b); });
  });
  return is_gone ? 0 : 9;
}

}  // namespace

TEST_CASE("eight client processes spawn, push, read back and despawn at once") {
  const Process daemon(serve_arguments());
  const auto watcher = connect();
  REQUIRE(watcher);
  std::multiset<std::int64_t> spawned;
  std::multiset<std::int64_t> removed;
  watcher->on_event([&](const Event& event) {
    if (event.kind == EventKind::spawned) spawned.insert(event.body.value);
    if (event.kind == EventKind::removed) removed.insert(event.body.value);
  });
  std::vector<std::unique_ptr<Process>> crowd;
  for (int i = 0; i < kCrowd; ++i) {
    crowd.push_back(std::make_unique<Process>([i] { return play(i); }));
  }
  const auto is_over = [&] {
    return std::none_of(crowd.begin(), crowd.end(), [](auto& p) { return p->is_running(); });
  };
  REQUIRE(poll_until(*watcher, is_over, 120s));
  for (int i = 0; i < kCrowd; ++i) {
    CAPTURE(i, crowd[static_cast<std::size_t>(i)]->errors());
    CHECK(crowd[static_cast<std::size_t>(i)]->wait(0s).value_or(-1) == 0);
  }
  // A crowd that is quick is over before the status tells of any body: the last events count.
  CHECK(poll_until(*watcher, [&] {
    return removed.size() == kCrowd * kBodiesOfEach && watcher->status().bodies == 0;
  }));
  CHECK(watcher->statistics().events_lost == 0);
  CHECK(spawned.size() == kCrowd * kBodiesOfEach);
  CHECK(std::set<std::int64_t>(spawned.begin(), spawned.end()).size() == spawned.size());
  CHECK(spawned == removed);
}

}  // namespace cradle
