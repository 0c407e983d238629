// Every decoder: the first byte chooses the kind of message, the rest is its payload. Whatever the
// bytes are, they are refused, or they are the message that has these very bytes; and no decoder
// allocates more than its limit.
#include <cstddef>

#include "protocol/validate.h"
#include "tests/fuzz/input.h"
#include "tests/wire/allocations.h"
#include "tests/wire/samples.h"

namespace cradle::fuzz {
namespace {

void check_command(MessageKind kind, ByteView payload, const Command& command) {
  const auto header = peek_header(kind, payload);
  require(header && *header == command.header, "the header alone is that of the command");
  validate(command.body);
}

void check(MessageKind kind, ByteView payload) {
  const bool has_size = has_exact_size(kind, payload);
  peek_header(kind, payload);
  const std::size_t before = test::allocated_bytes();
  const auto message = test::decode(kind, payload);
  const std::size_t allocated = test::allocated_bytes() - before;
  require(allocated <= (has_size ? test::decoder_limit(payload.size()) : 0),
          "a decoder allocates at most its limit, and nothing for a size that lies");
  if (!message) return;
  require(has_size, "what is decoded had its size checked");
  if (is_command(kind)) check_command(kind, payload, std::get<Command>(*message));
  const Bytes again = test::bytes_of(*message);
  const ByteView kept = payload.first(std::min(payload.size(), again.size()));
  require(payload.size() == again.size() || payload.size() == again.size() + limits::kTrailerBytes,
          "a message has its bytes, or these and the trailer");
  require(std::equal(kept.begin(), kept.end(), again.begin(), again.end()),
          "what is decoded has the very bytes it came from");
}

}  // namespace
}  // namespace cradle::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace cradle;
  if (size == 0) return 0;
  const auto kind = static_cast<MessageKind>(data[0] % kMessageKinds);
  // A copy of its own, so that the address sanitizer sees a byte read too many.
  const Bytes payload(data + 1, data + size);
  fuzz::check(kind, payload);
  return 0;
}
