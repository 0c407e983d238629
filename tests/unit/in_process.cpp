// A port inside one process.
#include "protocol/transport/in_process.h"

#include <atomic>
#include <catch2/catch.hpp>
#include <thread>

namespace cradle {
namespace {

using namespace std::chrono_literals;
using Heard = std::vector<std::pair<std::string, Bytes>>;

Heard heard_by(Transport& transport, std::chrono::microseconds timeout = 0us) {
  Heard heard;
  const int count = transport.receive(timeout, [&](std::string_view channel, ByteView payload) {
    heard.emplace_back(channel, Bytes(payload.begin(), payload.end()));
  });
  CHECK(count == static_cast<int>(heard.size()));
  return heard;
}

}  // namespace

TEST_CASE("everybody on a bus hears everything in order, the sender included") {
  InProcessBus bus;
  const auto a = bus.join();
  const auto b = bus.join();
  CHECK(a->send("one", Bytes{1, 2}));
  CHECK(b->send("two", Bytes{}));
  CHECK(a->send("three", Bytes{3}));
  const Heard expected = {{"one", {1, 2}}, {"two", {}}, {"three", {3}}};
  CHECK(heard_by(*a) == expected);
  CHECK(heard_by(*b) == expected);
  CHECK(heard_by(*a).empty());
}

TEST_CASE("a participant hears what is sent after it joined, on its own bus") {
  InProcessBus bus;
  InProcessBus other;
  const auto early = bus.join();
  early->send("before", Bytes{1});
  const auto late = bus.join();
  const auto elsewhere = other.join();
  early->send("after", Bytes{2});
  CHECK(heard_by(*late) == Heard{{"after", {2}}});
  CHECK(heard_by(*elsewhere).empty());
}

TEST_CASE("participants may leave, and the bus may go before them") {
  auto bus = std::make_unique<InProcessBus>();
  auto a = bus->join();
  const auto b = bus->join();
  a.reset();
  bus.reset();
  CHECK(b->send("still", Bytes{1}));
  CHECK(heard_by(*b) == Heard{{"still", {1}}});
}

TEST_CASE("a participant that does not listen loses what comes beyond its bound, counted") {
  constexpr int kWaiting = 65536;
  InProcessBus bus;
  const auto sender = bus.join();
  const auto sleeper = bus.join();
  for (int i = 0; i < kWaiting + 10; ++i) sender->send("flood", Bytes{});
  CHECK(sleeper->stats().dropped_by_kernel == 10);
  CHECK(sleeper->stats().received == 0);
  CHECK(heard_by(*sleeper).size() == kWaiting);
  CHECK(sleeper->stats().received == kWaiting);
  CHECK(sleeper->stats().sent == 0);
  CHECK(sender->stats().sent == kWaiting + 10);
  CHECK(sender->stats().send_failures == 0);
}

TEST_CASE("messages sent in several threads arrive once each, each thread's in order") {
  constexpr int kThreads = 4, kMessages = 500;
  InProcessBus bus;
  const auto listener = bus.join();
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&bus, t] {
      const auto own = bus.join();
      for (int i = 0; i < kMessages; ++i) {
        own->send(std::to_string(t), Bytes{static_cast<std::uint8_t>(i),  //
                                           static_cast<std::uint8_t>(i >> 8)});
      }
    });
  }
  std::vector<int> next(kThreads, 0);
  int total = 0;
  while (total < kThreads * kMessages) {
    for (const auto& [channel, payload] : heard_by(*listener, 10s)) {
      REQUIRE((payload[0] | payload[1] << 8) ==
              next[static_cast<std::size_t>(std::stoi(channel))]++);
      ++total;
    }
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(heard_by(*listener).empty());
}

}  // namespace cradle
