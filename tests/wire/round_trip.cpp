// What one process encodes, the other decodes; sizes, bytes and fingerprints as LCM prescribes.
#include <catch2/catch.hpp>
#include <map>

#include "tests/wire/layout.h"
#include "tests/wire/samples.h"

namespace cradle::test {
namespace {

std::uint64_t fingerprint_of(const Bytes& payload) { return read_field<std::uint64_t>(payload, 0); }

/// Checks that the doubles from `at` on are 1, 2, 3, ... `count`, as a test has given them.
void check_counting(const Bytes& payload, std::size_t at, int count) {
  for (int i = 1; i <= count; ++i, at += 8) {
    CAPTURE(i);
    CHECK(std::bit_cast<double>(read_field<std::uint64_t>(payload, at)) == i);
  }
}

// LCM's type hash, written from its documentation ("Type specification: fingerprint computation")
// as an oracle: not from the generated code.
std::int64_t hashed(std::int64_t value, char c) {
  const auto shifted = static_cast<std::int64_t>(static_cast<std::uint64_t>(value) << 8);
  return (shifted ^ (value >> 55)) + c;
}
std::int64_t hashed(std::int64_t value, std::string_view text) {
  value = hashed(value, static_cast<char>(text.size()));
  for (char c : text) value = hashed(value, c);
  return value;
}
std::uint64_t rotated(std::uint64_t value) { return value << 1 | value >> 63; }

}  // namespace

TEST_CASE("every message comes back equal from its bytes") {
  Samples samples(1);
  for (const MessageKind kind : kAllKinds) {
    for (std::size_t round = 0; round < 200; ++round) {
      const Message sent = samples.message(kind, round % 7);
      const Bytes bytes = bytes_of(sent);
      const auto received = decode(kind, bytes);
      CAPTURE(static_cast<int>(kind), round);
      REQUIRE(received);
      REQUIRE(*received == sent);
      REQUIRE(bytes_of(*received) == bytes);  // the sign of zero too
    }
  }
}

TEST_CASE("a command's header can be read without the rest") {
  Samples samples(2);
  for (const MessageKind kind : kAllKinds) {
    const Message message = samples.message(kind, 2);
    const auto header = peek_header(kind, bytes_of(message));
    CAPTURE(static_cast<int>(kind));
    REQUIRE(header.has_value() == is_command(kind));
    if (header) CHECK(*header == std::get<Command>(message).header);
    if (header) CHECK(kind_of(std::get<Command>(message).body) == kind);
  }
}

TEST_CASE("a message has its fixed part and its items, and their count after the fingerprint") {
  Samples samples(3);
  for (const MessageKind kind : kAllKinds) {
    const Layout layout = layout_of(kind);
    for (const std::size_t count : {0u, 1u, 2u, 5u}) {
      const Bytes bytes = bytes_of(samples.message(kind, count));
      CAPTURE(static_cast<int>(kind), count);
      CHECK(bytes.size() == layout.fixed + count * layout.item);
      if (layout.item == 0) continue;
      Bytes expected = bytes;
      write_field(expected, kCountAt, static_cast<std::int32_t>(count));
      CHECK(bytes == expected);
    }
  }
}

TEST_CASE("a datagram takes the items it is said to take, its channel and trailer, and no more") {
  constexpr std::size_t kLongestChannel = 64;  // LCM: 63 bytes and a zero
  for (const MessageKind kind : kAllKinds) {
    const Layout layout = layout_of(kind);
    for (const int datagram :
         {limits::kNetworkDatagramBytes, limits::kLoopbackDatagramBytes, 777}) {
      CAPTURE(static_cast<int>(kind), datagram);
      const auto most = static_cast<std::size_t>(items_per_datagram(kind, datagram));
      const std::size_t room =
          static_cast<std::size_t>(datagram) - kLongestChannel - limits::kTrailerBytes;
      CHECK(layout.fixed + most * layout.item <= room);
      if (layout.item == 0) {
        CHECK(most == 1);
      } else {
        CHECK(layout.fixed + (most + 1) * layout.item > room);
      }
    }
    CHECK(items_per_datagram(kind, 0) == 1);
  }
}

TEST_CASE("the bytes of a gravity command are those of LCM's encoding, by hand") {
  // Members and types of set_gravity_v1.lcm and command_header_v1.lcm; struct names do not count.
  std::int64_t header = 0x12345678;
  for (const char* member : {"client", "sequence", "epoch", "target_tick"}) {
    header = hashed(hashed(hashed(header, member), "int64_t"), char{0});  // no dimensions
  }
  std::int64_t own = hashed(hashed(0x12345678, "header"), char{0});  // a struct: no type name
  own = hashed(hashed(hashed(own, "gravity_mps2"), "double"), char{1});
  own = hashed(hashed(own, char{0}), "3");  // one dimension, constant
  const std::uint64_t fingerprint =
      rotated(static_cast<std::uint64_t>(own) + rotated(static_cast<std::uint64_t>(header)));

  Bytes expected(8);
  write_field(expected, 0, fingerprint);
  const Bytes rest = {
      0,    0,    0,    0,    0,    0,    0x01, 0x02,  // client 258
      0,    0,    0,    0,    0,    0,    0,    3,     // sequence 3
      0,    0x1F, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF,  // epoch 2^53 - 1
      0,    0,    0,    0,    0,    0,    0,    0,     // target tick 0
      0x3F, 0xF0, 0,    0,    0,    0,    0,    0,     // 1.0 in IEEE 754 binary64
      0x80, 0,    0,    0,    0,    0,    0,    0,     // -0.0
      0xC0, 0x24, 0,    0,    0,    0,    0,    0,     // -10.0
  };
  expected.insert(expected.end(), rest.begin(), rest.end());
  CHECK(encode(Command{{258, 3, limits::kIntegerMax, 0}, SetGravity{{1, -0.0, -10}}}) == expected);
}

TEST_CASE("numbers stand in the order of lcmtypes, or another language would read them as others") {
  const std::size_t list = layout_of(MessageKind::spawn).fixed;  // of every command with items
  BodySpec spec;
  spec.shape.parameters = {1, 2, 3, 4, 5, 6, 7, 8};
  spec.mass_kg = 9;
  spec.density_kgpm3 = 10;
  spec.inertia_kgm2 = {11, 12, 13};
  spec.inertia_products_kgm2 = {14, 15, 16};
  spec.p_BoBcm = {17, 18, 19};
  spec.material = {20, 21, 22, 23, CombineRule::minimum, CombineRule::maximum};
  spec.contact_tolerance_m = 24;
  spec.p_WBo = {25, 26, 27};
  spec.q_WB = {28, 29, 30, 31};
  spec.v_WBcm = {32, 33, 34};
  spec.w_WB = {35, 36, 37};
  check_counting(encode(Command{{}, Spawn{{spec}}}), list + 5 * 4, 37);

  Event event;
  event.shape.parameters = {1, 2, 3, 4, 5, 6, 7, 8};
  event.mass_kg = 9;
  event.p_BoBcm = {10, 11, 12};
  const std::size_t events = layout_of(MessageKind::events).fixed;
  check_counting(encode(Events{1, 0, {event}}), events + 3 * 8 + 4 * 4, 12);

  Wrench wrench;
  wrench.value = {1, 2, 3};
  wrench.point = {4, 5, 6};
  check_counting(encode(Command{{}, Push{{wrench}}}), list + 8 + 4 * 4 + 8, 6);

  const Motion motion{{1}, true, true, {1, 2, 3}, {4, 5, 6, 7}, {8, 9, 10}, {11, 12, 13}};
  check_counting(encode(Command{{}, SetMotion{{motion}}}), list + 2 * 8, 13);

  BodyState state;
  state.p_WBo = motion.p_WBo;
  state.q_WB = motion.q_WB;
  state.v_WBcm = motion.v_WBcm;
  state.w_WB = motion.w_WB;
  StateChunk chunk;
  chunk.states = {state};
  check_counting(encode(chunk), layout_of(MessageKind::states).fixed + 8 + 2 * 4, 13);
}

TEST_CASE("whole numbers stand in the order of lcmtypes") {
  const auto fields = [](const Bytes& payload, std::size_t at, std::size_t count,
                         std::size_t size) {
    std::vector<std::int64_t> all;
    for (std::size_t i = 0; i < count; ++i, at += size) {
      all.push_back(size == 8 ? read_field<std::int64_t>(payload, at)
                              : read_field<std::int32_t>(payload, at));
    }
    return all;
  };
  using Integers = std::vector<std::int64_t>;
  const Bytes receipts = encode(Receipts{9, {{1, 2, 3, {Result::late, {4}, 5}}}});
  CHECK(fields(receipts, 12, 5, 8) == Integers{9, 1, 2, 3, 4});
  CHECK(fields(receipts, 12 + 5 * 8, 2, 4) == Integers{16, 5});  // late is 16 in result.h

  const Wrench wrench{{1},
                      WrenchQuantity::acceleration,
                      WrenchFrame::body,
                      WrenchPoint::body_point,
                      WrenchDuration::ticks,
                      6,
                      {},
                      {}};
  const Bytes push = encode(Command{{}, Push{{wrench}}});
  const std::size_t item = layout_of(MessageKind::push).fixed;
  CHECK(fields(push, item, 1, 8) == Integers{1});
  CHECK(fields(push, item + 8, 4, 4) == Integers{4, 1, 2, 1});
  CHECK(fields(push, item + 8 + 16, 1, 8) == Integers{6});

  const Bytes states = encode(StateChunk{1, 2, 3, 4, 5, 6, {7}, {8}, {}});
  CHECK(fields(states, 12, 4, 8) == Integers{1, 2, 3, 4});
  CHECK(fields(states, 12 + 32, 2, 4) == Integers{5, 6});
  CHECK(fields(states, 12 + 40, 2, 8) == Integers{7, 8});
}

TEST_CASE("every message type keeps its fingerprint, and no two have the same") {
  // Computed from lcmtypes/*.lcm by a separate script after LCM's documentation. A type that
  // changes takes a new version suffix and a new line here. LCM's fingerprint ignores the names of
  // structs: types with equal fields would be taken for each other.
  const std::map<MessageKind, std::uint64_t> fingerprints = {
      {MessageKind::hello, 0x20313de645c23940},
      {MessageKind::spawn, 0xb90e55037bd681fc},
      {MessageKind::despawn, 0xfb089a43568ef3a7},
      {MessageKind::push, 0x3791bf690e5cf173},
      {MessageKind::clear_wrenches, 0xfa90d20358a4f3a7},
      {MessageKind::set_motion, 0x2e4276fb785412eb},
      {MessageKind::set_gravity, 0x9b3a32c20a4d49ff},
      {MessageKind::control, 0x6c721652a8ed25eb},
      {MessageKind::receipts, 0x1943e67d07f8584b},
      {MessageKind::status, 0xeb428718f0b860cf},
      {MessageKind::states, 0x6ed0b3155eee5823},
      {MessageKind::events, 0xe470df3044ac103c}};
  Samples samples(4);
  std::map<std::uint64_t, MessageKind> seen;
  for (const MessageKind kind : kAllKinds) {
    CAPTURE(static_cast<int>(kind));
    const std::uint64_t fingerprint = fingerprint_of(bytes_of(samples.message(kind, 1)));
    CHECK(fingerprint == fingerprints.at(kind));
    CHECK(seen.emplace(fingerprint, kind).second);
  }
}

TEST_CASE("a message is not taken for one of another kind") {
  Samples samples(5);
  for (const MessageKind sent : kAllKinds) {
    const Bytes bytes = bytes_of(samples.message(sent, 4));
    for (const MessageKind read_as : kAllKinds) {
      CAPTURE(static_cast<int>(sent), static_cast<int>(read_as));
      CHECK(decode(read_as, bytes).has_value() == (sent == read_as));
    }
  }
}

}  // namespace cradle::test
