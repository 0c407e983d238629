/// Bytes <-> values. Total functions: any bytes are answered, none allocate beyond the datagram.
///
/// A message is checked against the size that its count implies, plus nothing or the trailer
/// reserved for authentication, before generated code sees it, because generated decoders trust
/// their counts. Decoding checks form (enumerators, flags, zero padding, integers below 2^53); what
/// the numbers mean is checked where they are used (validate.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/channels.h"
#include "protocol/messages.h"

namespace cradle {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

/// Of eight bytes at most.
inline std::uint64_t read_big_endian(ByteView bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

/// Largest number of items that a message of this kind can hold in `datagram_bytes`, at least 1
/// for kinds without items.
int items_per_datagram(MessageKind kind, int datagram_bytes);

/// Whether the message's count is one that `payload`'s size agrees with.
enum class SizeCheck {
  right,
  no_count,    ///< too short to have one
  bad_count,   ///< below zero
  wrong_size,  ///< not what the count implies
};
SizeCheck check_size(MessageKind kind, ByteView payload);
bool has_exact_size(MessageKind kind, ByteView payload);

/// The header alone, without decoding the rest; nothing if there is no room for one, or if its
/// numbers are none that a receipt could repeat.
std::optional<CommandHeader> peek_header(MessageKind kind, ByteView payload);

/// Which message carries this command.
MessageKind kind_of(const CommandBody& body);

/// How many items its list has; 1 for commands without one.
int item_count(const CommandBody& body);

/// Bytes of its message.
std::int64_t encoded_size(const CommandBody& body);

Bytes encode(const Command& command);
Bytes encode(const Receipts& message);
Bytes encode(const WorldStatus& message);
Bytes encode(const StateChunk& message);
Bytes encode(const Events& message);

/// Nothing if the payload is malformed.
std::optional<Command> decode_command(MessageKind kind, ByteView payload);
std::optional<Receipts> decode_receipts(ByteView payload);
std::optional<WorldStatus> decode_status(ByteView payload);
std::optional<StateChunk> decode_states(ByteView payload);
std::optional<Events> decode_events(ByteView payload);

}  // namespace cradle
