// Many client processes at once, and hostile ones.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <set>
#include <thread>

#include "protocol/transport/lcm_url.h"
#include "tests/integration/daemon.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;

constexpr int kClients = 8;
constexpr int kBodies = 20;

/// One of the crowd: spawns, pushes, reads back, despawns. The number of the first thing that goes
/// wrong, or 0.
int play(int number) {
  const auto client = connect();
  if (!client) return 1;
  std::set<BodyId> mine;
  // Half of them one by one, half in one batch; each client in a row of its own.
  std::vector<Ticket> tickets;
  const auto place = [&](int i) { return Vec3{3.0 * i, 100.0 * number, 1000}; };
  for (int i = 0; i < kBodies / 2; ++i) tickets.push_back(client->spawn(ball_spec(place(i))));
  for (const Ticket& ticket : tickets) mine.insert(client->wait(ticket, 30s).body);
  std::vector<BodySpec> batch;
  for (int i = kBodies / 2; i < kBodies; ++i) batch.push_back(ball_spec(place(i)));
  const Answer made = client->wait(client->spawn(batch), 30s);
  if (!made) return 2;
  for (int i = 0; i < kBodies / 2; ++i) mine.insert({made.body.value + i});
  if (mine.size() != kBodies || mine.contains(BodyId{})) return 3;

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

/// Sends datagrams as anyone on the host could.
class Attacker {
 public:
  explicit Attacker(const LcmUrl& url) : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    address_.sin_family = AF_INET;
    address_.sin_port = htons(static_cast<std::uint16_t>(url.port));
    inet_pton(AF_INET, url.group.c_str(), &address_.sin_addr);
  }
  ~Attacker() { ::close(socket_); }
  Attacker(const Attacker&) = delete;
  Attacker& operator=(const Attacker&) = delete;

  void send(const std::vector<std::uint8_t>& bytes) const {
    ::sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&address_),
             sizeof address_);
  }

 private:
  int socket_;
  sockaddr_in address_{};
};

void append(std::vector<std::uint8_t>& bytes, std::uint64_t value, int size) {
  for (int i = size - 1; i >= 0; --i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

/// An LC02 short message, or an LC03 fragment header, as a hostile sender writes them.
std::vector<std::uint8_t> short_message(const std::string& channel, std::size_t payload_bytes,
                                        std::uint8_t fill) {
  std::vector<std::uint8_t> bytes = {'L', 'C', '0', '2', 0, 0, 0, 1};
  bytes.insert(bytes.end(), channel.begin(), channel.end());
  bytes.push_back(0);
  bytes.insert(bytes.end(), payload_bytes, fill);
  return bytes;
}

std::vector<std::uint8_t> fragment(std::uint32_t size, std::uint32_t offset, std::uint16_t number,
                                   std::uint16_t count, const std::string& channel) {
  std::vector<std::uint8_t> bytes = {'L', 'C', '0', '3'};
  append(bytes, 7, 4);
  append(bytes, size, 4);
  append(bytes, offset, 4);
  append(bytes, number, 2);
  append(bytes, count, 2);
  if (number == 0) {
    bytes.insert(bytes.end(), channel.begin(), channel.end());
    bytes.push_back(0);
  }
  bytes.insert(bytes.end(), 32, 0xAA);
  return bytes;
}

/// The pair that crashes every subscriber of liblcm 1.3.1, and its relatives.
std::vector<std::vector<std::uint8_t>> crafted() {
  const std::string spawn = "CRADLE_test_SPAWN";
  std::vector<std::vector<std::uint8_t>> all = {
      {},
      {'L'},
      {'L', 'C', '0', '2'},
      {'L', 'C', '0', '2', 0, 0, 0, 0},
      fragment(100000, 0, 0, 2, spawn),
      fragment(100000, 0xfffffff0, 1, 2, spawn),  // the write out of bounds
      fragment(0xffffffff, 0, 0, 1, spawn),
      fragment(60000, 0, 0, 1, spawn),
      fragment(1u << 28, 0, 0, 65535, spawn),
      short_message(std::string(300, 'A'), 10, 0),
      short_message("", 10, 0),
      short_message(spawn, 0, 0),
      short_message(spawn, 84, 0xff),
      short_message(spawn, 60000, 0x7f),
      std::vector<std::uint8_t>(64, 'A'),
      std::vector<std::uint8_t>(65000, 0),
  };
  for (const char* kind : {"HELLO", "SPAWN", "DESPAWN", "WRENCH", "CLEAR", "MOTION", "GRAVITY",
                           "CONTROL", "RECEIPTS", "STATUS", "STATES", "EVENTS"}) {
    for (const std::size_t size :
         {std::size_t{0}, std::size_t{8}, std::size_t{12}, std::size_t{1400}}) {
      for (const int fill : {0x00, 0x7f, 0x80, 0xff}) {
        all.push_back(short_message(std::string("CRADLE_test_") + kind, size,
                                    static_cast<std::uint8_t>(fill)));
      }
    }
  }
  return all;
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
  for (int i = 0; i < kClients; ++i) {
    crowd.push_back(std::make_unique<Process>([i] { return play(i); }));
  }
  const auto is_over = [&] {
    return std::none_of(crowd.begin(), crowd.end(), [](auto& p) { return p->is_running(); });
  };
  REQUIRE(poll_until(*watcher, is_over, 120s));
  for (int i = 0; i < kClients; ++i) {
    CAPTURE(i, crowd[static_cast<std::size_t>(i)]->errors());
    CHECK(crowd[static_cast<std::size_t>(i)]->wait(0s).value_or(-1) == 0);
  }
  REQUIRE(poll_until(*watcher, [&] { return watcher->status().bodies == 0; }));
  CHECK(watcher->statistics().events_lost == 0);
  CHECK(spawned.size() == kClients * kBodies);
  CHECK(std::set<std::int64_t>(spawned.begin(), spawned.end()).size() == spawned.size());
  CHECK(spawned == removed);
}

TEST_CASE("hostile datagrams leave daemon and client alive and answering") {
  Process daemon(serve_arguments());
  const auto client = connect();
  REQUIRE(client);
  const LcmUrl url = *parse_lcm_url(own_url());
  const Attacker control(url);
  const Attacker states(url.state_lane());
  for (const auto& datagram : crafted()) {
    control.send(datagram);
    states.send(datagram);
  }
  CHECK(client->wait(client->set_gravity({0, 0, -5}), 20s));
  const long memory_before_kB = daemon.resident_kB();

  std::mt19937 random(1);
  std::uniform_int_distribution<int> byte(0, 255);
  std::uniform_int_distribution<std::size_t> length(0, 200);
  const auto kinds = crafted();
  for (int i = 0; i < 100'000; ++i) {
    std::vector<std::uint8_t> datagram;
    if (i % 2 == 0) {
      datagram.resize(length(random));
      for (auto& b : datagram) b = static_cast<std::uint8_t>(byte(random));
    } else {  // something nearly right, with a few bytes changed
      datagram = kinds[static_cast<std::size_t>(i) % kinds.size()];
      if (datagram.size() > 2000) datagram.resize(2000);
      for (int k = 0; k < 4 && !datagram.empty(); ++k) {
        datagram[length(random) % datagram.size()] = static_cast<std::uint8_t>(byte(random));
      }
    }
    (i % 3 == 0 ? states : control).send(datagram);
    if (i % 1000 == 0) client->poll();
  }
  CHECK(client->wait(client->set_gravity({0, 0, -9}), 20s));
  const BodyId ball = spawn_ball(*client, {0, 0, 3});
  REQUIRE(ball);
  CHECK(poll_until(*client, [&] { return client->find(ball) != nullptr; }));
  CHECK(poll_until(*client, [&] { return client->status().datagrams_rejected > 1000; }));
  CHECK(client->statistics().datagrams_rejected > 1000);
  CHECK(daemon.is_running());
  CHECK(daemon.resident_kB() < memory_before_kB + 20'000);  // inbox and buffers, not a leak
}

}  // namespace cradle
