// Bytes that no honest sender makes: cut, extended, flipped, with counts that lie. Everything is
// answered, nothing allocates beyond the datagram. Worth most under the sanitizers.
#include <catch2/catch.hpp>
#include <limits>

#include "tests/wire/allocations.h"
#include "tests/wire/layout.h"
#include "tests/wire/samples.h"

namespace cradle::test {
namespace {

constexpr std::size_t kTrailer = limits::kTrailerBytes;

struct Decoded {
  std::optional<Message> message;
  std::size_t allocated = 0;
};

Decoded decode_and_count(MessageKind kind, ByteView payload) {
  has_exact_size(kind, payload);  // its table of sizes is made once
  const std::size_t before = allocated_bytes();
  auto message = decode(kind, payload);
  return {std::move(message), allocated_bytes() - before};
}

}  // namespace

TEST_CASE("a message cut anywhere is refused") {
  Samples samples(11);
  for (const MessageKind kind : kAllKinds) {
    for (const std::size_t items : {0u, 3u}) {
      const Bytes whole = bytes_of(samples.message(kind, items));
      for (std::size_t length = 0; length < whole.size(); ++length) {
        // A copy of its own, so that the address sanitizer sees a byte read too many.
        const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
        CAPTURE(static_cast<int>(kind), items, length);
        REQUIRE(!has_exact_size(kind, cut));
        REQUIRE(!decode(kind, cut));
        peek_header(kind, cut);
      }
    }
  }
}

TEST_CASE("a message may be followed by a trailer, and by nothing else") {
  Samples samples(12);
  for (const MessageKind kind : kAllKinds) {
    const Message sent = samples.message(kind, 3);
    Bytes extended = bytes_of(sent);
    for (std::size_t extra = 1; extra <= 64; ++extra) {
      extended.push_back(static_cast<std::uint8_t>(samples.bits()));
      CAPTURE(static_cast<int>(kind), extra);
      CHECK(has_exact_size(kind, extended) == (extra == kTrailer));
      const auto received = decode(kind, extended);
      CHECK(received.has_value() == (extra == kTrailer));
      if (received) CHECK(*received == sent);
    }
  }
}

TEST_CASE("any flipped bit is refused or gives the message that has these very bytes") {
  Samples samples(13);
  for (const MessageKind kind : kAllKinds) {
    const Bytes whole = bytes_of(samples.message(kind, 3));
    for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
      Bytes flipped = whole;
      flipped[bit / 8] = static_cast<std::uint8_t>(flipped[bit / 8] ^ (1u << bit % 8));
      const auto [message, allocated] = decode_and_count(kind, flipped);
      CAPTURE(static_cast<int>(kind), bit);
      REQUIRE(allocated <= decoder_limit(flipped.size()));
      if (bit / 8 < kFingerprintBytes) REQUIRE(!message);
      if (message) REQUIRE(bytes_of(*message) == flipped);
    }
  }
}

TEST_CASE("counts that lie are refused before anything is allocated") {
  Samples samples(14);
  for (const MessageKind kind : kAllKinds) {
    if (layout_of(kind).item == 0) continue;
    for (const std::int32_t honest : {0, 3}) {
      Bytes lying = bytes_of(samples.message(kind, static_cast<std::size_t>(honest)));
      // Powers of two, because their products with an item's size wrap to nothing in 32 bits.
      for (const std::int32_t count :
           {-1, std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max(),
            1 << 24, 1 << 28, 1 << 29, 1 << 30, honest + 1, honest - 1}) {
        write_field(lying, kCountAt, count);
        CAPTURE(static_cast<int>(kind), count);
        CHECK(!has_exact_size(kind, lying));
        const auto [message, allocated] = decode_and_count(kind, lying);
        CHECK(!message);
        CHECK(allocated == 0);
      }
    }
  }
}

TEST_CASE("negative counts are refused where the size would agree with them") {
  Samples samples(16);
  int tried = 0;
  for (const MessageKind kind : kAllKinds) {
    const auto [fixed, item] = layout_of(kind);
    for (std::size_t missing = 1; item > 0 && missing * item <= fixed + kTrailer; ++missing) {
      for (const std::size_t size : {fixed - missing * item, fixed + kTrailer - missing * item}) {
        if (size < kCountAt + 4 || size > fixed + kTrailer) continue;
        Bytes payload = bytes_of(samples.message(kind, 1));
        payload.resize(size);
        write_field(payload, kCountAt, -static_cast<std::int32_t>(missing));
        CAPTURE(static_cast<int>(kind), missing, size);
        CHECK(!has_exact_size(kind, payload));
        CHECK(!decode(kind, payload));
        ++tried;
      }
    }
  }
  CHECK(tried > 0);
}

TEST_CASE("random bytes behind an honest fingerprint and count are answered") {
  Samples samples(15);
  for (const MessageKind kind : kAllKinds) {
    const Bytes honest = bytes_of(samples.message(kind, 2));
    const std::size_t keep = kFingerprintBytes + (layout_of(kind).item == 0 ? 0 : 4);
    for (int round = 0; round < 5000; ++round) {
      Bytes noisy = honest;
      // Few bytes leave most fields legal; many leave none so.
      for (std::size_t left = 1 + samples.below(16) * samples.below(16); left > 0; --left) {
        noisy[keep + samples.below(noisy.size() - keep)] =
            static_cast<std::uint8_t>(samples.bits());
      }
      const auto [message, allocated] = decode_and_count(kind, noisy);
      CAPTURE(static_cast<int>(kind), round);
      REQUIRE(allocated <= decoder_limit(noisy.size()));
      if (message) REQUIRE(bytes_of(*message) == noisy);
      peek_header(kind, noisy);
    }
  }
}

}  // namespace cradle::test
