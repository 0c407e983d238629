// LCM's short message, taken apart: what is not one whole short message is nothing.
#include <catch2/catch.hpp>
#include <random>

#include "protocol/transport/lc02_receiver.h"

namespace cradle::test {
namespace {

/// Magic, the sender's counter, channel with its zero, payload (LCM, "UDP multicast protocol").
Bytes datagram(const std::string& channel, const std::string& payload,
               const std::string& magic = "LC02") {
  const std::string text = magic + std::string("\0\0\0\7", 4) + channel + '\0' + payload;
  return {text.begin(), text.end()};
}

std::string text(ByteView bytes) { return {bytes.begin(), bytes.end()}; }

}  // namespace

TEST_CASE("a short message gives its channel and its payload") {
  const Bytes bytes = datagram("CRADLE_w_SPAWN", "payload");
  const auto message = parse_lc02(bytes);
  REQUIRE(message);
  CHECK(message->channel == "CRADLE_w_SPAWN");
  CHECK(text(message->payload) == "payload");
}

TEST_CASE("a payload may be empty or full of zeros, a channel may be empty") {
  const Bytes silent = datagram("A", "");
  REQUIRE(parse_lc02(silent));
  CHECK(parse_lc02(silent)->payload.empty());
  const Bytes zeros = datagram("A", std::string(300, '\0'));
  REQUIRE(parse_lc02(zeros));
  CHECK(parse_lc02(zeros)->payload.size() == 300);
  const Bytes unnamed = datagram("", "p");
  REQUIRE(parse_lc02(unnamed));
  CHECK(parse_lc02(unnamed)->channel.empty());
  CHECK(text(parse_lc02(unnamed)->payload) == "p");
}

TEST_CASE("channels of 63 bytes are read, of 64 and more are refused") {
  const std::string longest(63, 'c');  // LCM_MAX_CHANNEL_NAME_LENGTH
  const Bytes fits = datagram(longest, "p");
  REQUIRE(parse_lc02(fits));
  CHECK(parse_lc02(fits)->channel == longest);
  for (const std::size_t length : {64u, 65u, 300u}) {
    CHECK(!parse_lc02(datagram(std::string(length, 'c'), "p")));
  }
}

TEST_CASE("a message cut before its channel's zero is refused") {
  const Bytes whole = datagram("DATA", "p");
  for (std::size_t length = 0; length < 8 + 5; ++length) {
    CAPTURE(length);
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    CHECK(!parse_lc02(cut));
  }
}

TEST_CASE("other magics are refused, fragments among them") {
  for (const char* magic : {"LC03", "LC01", "lc02", "20CL", "\0\0\0\0"}) {
    CHECK(!parse_lc02(datagram("DATA", "p", std::string(magic, 4))));
  }
  // The fragment that makes liblcm 1.3.1 write 4 GiB beyond its buffer: LC03, sequence, size of the
  // message, offset 0xfffffff0, fragment 1 of 2, 32 bytes.
  Bytes fragment = {'L', 'C', '0',  '3',  0,    0,    0, 1, 0, 0,
                    0,   64,  0xff, 0xff, 0xff, 0xf0, 0, 1, 0, 2};
  fragment.resize(fragment.size() + 32, 'x');
  CHECK(!parse_lc02(fragment));
}

TEST_CASE("200 000 random datagrams give nothing, or a channel and payload inside them") {
  std::mt19937_64 random(31);
  int whole = 0;
  for (int round = 0; round < 200'000; ++round) {
    Bytes bytes(random() % 200);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random() % 8 == 0 ? 0 : random());
    if (bytes.size() >= 4 && random() % 4 != 0) std::copy_n("LC02", 4, bytes.begin());
    const auto message = parse_lc02(bytes);
    if (!message) continue;
    ++whole;
    const auto* const channel = reinterpret_cast<const std::uint8_t*>(message->channel.data());
    const auto* const begin = bytes.data();
    REQUIRE(message->channel.size() <= 63);
    REQUIRE(message->channel.find('\0') == std::string_view::npos);
    REQUIRE(channel == begin + 8);
    REQUIRE(8 + message->channel.size() + 1 + message->payload.size() == bytes.size());
    if (!message->payload.empty()) {
      REQUIRE(message->payload.data() == begin + 9 + message->channel.size());
    }
  }
  CHECK(whole > 50'000);  // most of those with the magic: the rule above was tried
}

}  // namespace cradle::test
