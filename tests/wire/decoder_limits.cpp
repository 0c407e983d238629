// No decoder allocates more than its limit, at any count that a datagram can have, nor anything for
// a count beyond what came.
#include <catch2/catch.hpp>

#include "protocol/transport/lc02_receiver.h"
#include "tests/wire/allocations.h"
#include "tests/wire/layout.h"
#include "tests/wire/samples.h"

namespace cradle::test {
namespace {

constexpr std::size_t kUdpPayloadMax = 65507;  // IPv4: 65535 less both headers

bool has_name(MessageKind kind) {
  return kind == MessageKind::hello || kind == MessageKind::spawn || kind == MessageKind::status ||
         kind == MessageKind::events;
}

/// The dearest message of `items` items: every name is as long as it can be. Names come last.
Bytes dearest(MessageKind kind, std::size_t items) {
  Samples samples(51);
  Bytes bytes = bytes_of(samples.message(kind, items));
  const auto [fixed, item] = layout_of(kind);
  const std::size_t next = item == 0 ? bytes.size() : item;
  for (std::size_t end = fixed + item; has_name(kind) && end <= bytes.size(); end += next) {
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(end - kNameBytes), limits::kNameBytes,
                std::uint8_t{'n'});
    bytes[end - 1] = 0;
  }
  return bytes;
}

/// What decoding asks the allocator for; the table of sizes, made once, is not counted.
std::size_t cost(MessageKind kind, ByteView payload, bool is_message) {
  has_exact_size(kind, payload);
  const std::size_t before = allocated_bytes();
  const bool is_decoded = decode(kind, payload).has_value();
  const std::size_t allocated = allocated_bytes() - before;
  CHECK(is_decoded == is_message);
  return allocated;
}

std::vector<std::size_t> boundary_counts(MessageKind kind) {
  const auto [fixed, item] = layout_of(kind);
  if (item == 0) return {0};
  const auto fitting = [&](int datagram_bytes) {
    return static_cast<std::size_t>(items_per_datagram(kind, datagram_bytes));
  };
  return {0,
          1,
          2,
          fitting(limits::kNetworkDatagramBytes),
          fitting(limits::kNetworkDatagramBytes) + 1,
          fitting(limits::kLoopbackDatagramBytes),
          fitting(limits::kLoopbackDatagramBytes) + 1,
          (kUdpPayloadMax - fixed) / item};
}

}  // namespace

TEST_CASE("every decoder keeps its limit at every boundary of its count") {
  for (const MessageKind kind : kAllKinds) {
    for (const std::size_t count : boundary_counts(kind)) {
      Bytes payload = dearest(kind, count);
      CAPTURE(static_cast<int>(kind), count);
      REQUIRE(payload.size() <= kUdpPayloadMax);
      CHECK(cost(kind, payload, true) <= decoder_limit(payload.size()));
      payload.resize(payload.size() + limits::kTrailerBytes);
      CHECK(cost(kind, payload, true) <= decoder_limit(payload.size()));
    }
  }
}

TEST_CASE("a count one beyond the items that came allocates nothing, at every boundary") {
  for (const MessageKind kind : kAllKinds) {
    if (layout_of(kind).item == 0) continue;
    for (const std::size_t count : boundary_counts(kind)) {
      Bytes payload = dearest(kind, count);
      CAPTURE(static_cast<int>(kind), count);
      write_field(payload, kCountAt, static_cast<std::int32_t>(count) + 1);
      CHECK(cost(kind, payload, false) == 0);
      if (count == 0) continue;
      write_field(payload, kCountAt, static_cast<std::int32_t>(count) - 1);
      CHECK(cost(kind, payload, false) == 0);
    }
  }
}

TEST_CASE("a message refused for what it says costs no more than a whole one") {
  for (const MessageKind kind : kAllKinds) {
    if (layout_of(kind).item == 0) continue;
    Bytes payload = dearest(kind, boundary_counts(kind).back());
    std::fill(payload.begin() + kCountAt + 4, payload.end(), std::uint8_t{0xff});
    CAPTURE(static_cast<int>(kind));
    CHECK(cost(kind, payload, false) <= decoder_limit(payload.size()));
  }
}

TEST_CASE("taking a datagram apart, and looking at a header, allocate nothing") {
  for (const MessageKind kind : kAllKinds) {
    Bytes datagram = {'L', 'C', '0', '2', 0, 0, 0, 1, 'A', 0};
    const Bytes payload = dearest(kind, 3);
    datagram.insert(datagram.end(), payload.begin(), payload.end());
    has_exact_size(kind, payload);  // as in cost()
    const std::size_t before = allocated_bytes();
    const auto message = parse_lc02(datagram);
    const bool is_whole = message && has_exact_size(kind, message->payload);
    if (message) peek_header(kind, message->payload);
    const std::size_t allocated = allocated_bytes() - before;
    CHECK(allocated == 0);
    CHECK(is_whole);
  }
}

}  // namespace cradle::test
