// The bounded queue between the network and the tick.
#include "server/inbox.h"

#include <cradle/limits.h>
#include <cradle/version.h>
#include <poll.h>

#include <catch2/catch.hpp>
#include <thread>

namespace cradle {
namespace {

Bytes gravity(std::int64_t sequence) {
  return encode(Command{{7, sequence, 9, 0}, SetGravity{{0, 0, -1}}});
}

bool is_readable(const Inbox& inbox) {
  pollfd waiting{inbox.file_descriptor(), POLLIN, 0};
  return ::poll(&waiting, 1, 0) == 1;
}

}  // namespace

TEST_CASE("what is put into the inbox is drained once, in the order of arrival") {
  Inbox inbox;
  inbox.put(MessageKind::set_gravity, gravity(2));
  inbox.put(MessageKind::set_gravity, gravity(1));
  const auto contents = inbox.drain();
  REQUIRE(contents.commands.size() == 2);
  CHECK(contents.commands[0].payload == gravity(2));
  CHECK(contents.commands[1].payload == gravity(1));
  CHECK(contents.commands[0].kind == MessageKind::set_gravity);
  CHECK(inbox.drain().commands.empty());
}

TEST_CASE("a payload of the wrong size is counted and kept out") {
  Inbox inbox;
  Bytes payload = gravity(1);
  payload.pop_back();
  inbox.put(MessageKind::set_gravity, payload);
  inbox.put(MessageKind::spawn, gravity(1));  // its count says something else
  inbox.put(MessageKind::hello, {});
  inbox.put(MessageKind::spawn, Bytes(11));                         // no room for a count
  inbox.put(MessageKind::despawn, Bytes(200, std::uint8_t{0xff}));  // a count of -1
  const Inbox::Counters counters = inbox.counters();
  CHECK(counters.wrong_size == 3);
  CHECK(counters.no_count == 1);
  CHECK(counters.bad_count == 1);
  CHECK(counters.rejected() == 5);
  CHECK(counters.dropped == 0);
  CHECK(!is_readable(inbox));
  CHECK(inbox.drain().commands.empty());
}

TEST_CASE("a full inbox keeps the headers of what it cannot take, and counts what is beyond that") {
  constexpr int kHeaders = 4096;
  Inbox inbox;
  const int most = limits::kInboxDatagrams;
  for (int i = 1; i <= most + kHeaders + 3; ++i) inbox.put(MessageKind::set_gravity, gravity(i));
  CHECK(inbox.counters().dropped == 3);
  const auto contents = inbox.drain();
  CHECK(contents.commands.size() == static_cast<std::size_t>(most));
  REQUIRE(contents.overflow.size() == kHeaders);
  CHECK(contents.overflow.front() == CommandHeader{7, most + 1, 9, 0});
  CHECK(contents.overflow.back() == CommandHeader{7, most + kHeaders, 9, 0});
  inbox.put(MessageKind::set_gravity, gravity(1));
  CHECK(inbox.drain().commands.size() == 1);
}

TEST_CASE("an inbox is full, too, when its commands have too many bytes together") {
  const Bytes large = encode(Command{{7, 1, 9, 0}, Despawn{std::vector<BodyId>(8000, BodyId{1})}});
  const auto fitting = static_cast<std::size_t>(limits::kInboxBytes) / large.size();
  REQUIRE(fitting < static_cast<std::size_t>(limits::kInboxDatagrams));
  Inbox inbox;
  for (int round = 0; round < 2; ++round) {  // draining makes room for as much again
    for (std::size_t i = 0; i < fitting + 2; ++i) inbox.put(MessageKind::despawn, large);
    const auto contents = inbox.drain();
    CHECK(contents.commands.size() == fitting);
    CHECK(contents.overflow.size() == 2);
  }
  CHECK(inbox.counters().dropped == 0);
}

TEST_CASE("the inbox wakes whoever polls it until it is drained") {
  Inbox inbox;
  CHECK(!is_readable(inbox));
  inbox.put(MessageKind::set_gravity, gravity(1));
  inbox.put(MessageKind::set_gravity, gravity(2));
  CHECK(is_readable(inbox));
  inbox.drain();
  CHECK(!is_readable(inbox));
}

TEST_CASE("nothing is lost or doubled between a thread that puts and one that drains") {
  constexpr std::size_t kCount = 5000;
  Inbox inbox;
  std::thread receiver([&] {
    for (std::size_t i = 1; i <= kCount; ++i) {
      inbox.put(MessageKind::set_gravity, gravity(static_cast<std::int64_t>(i)));
    }
  });
  std::vector<Bytes> seen;
  while (seen.size() < kCount) {
    for (RawCommand& raw : inbox.drain().commands) seen.push_back(std::move(raw.payload));
  }
  receiver.join();
  for (std::size_t i = 0; i < kCount; ++i) {
    REQUIRE(seen[i] == gravity(static_cast<std::int64_t>(i) + 1));
  }
}

}  // namespace cradle
