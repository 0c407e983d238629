#include "protocol/codec.h"

#include <cradle/limits.h>

#include <algorithm>
#include <concepts>
#include <utility>

#include "protocol/wire_convert.h"

namespace cradle {
namespace {

/// Calls `f` with an empty message of the generated type that `kind` means.
template <class F>
auto with_wire_type(MessageKind kind, F&& f) {
  switch (kind) {
    case MessageKind::hello:
      return f(wire::hello_v1{});
    case MessageKind::spawn:
      return f(wire::spawn_v3{});
    case MessageKind::despawn:
      return f(wire::despawn_v1{});
    case MessageKind::push:
      return f(wire::wrench_v1{});
    case MessageKind::clear_wrenches:
      return f(wire::clear_wrenches_v1{});
    case MessageKind::set_motion:
      return f(wire::set_motion_v1{});
    case MessageKind::set_gravity:
      return f(wire::set_gravity_v1{});
    case MessageKind::control:
      return f(wire::control_v1{});
    case MessageKind::receipts:
      return f(wire::receipts_v1{});
    case MessageKind::status:
      return f(wire::world_status_v3{});
    case MessageKind::states:
      return f(wire::body_states_v1{});
    case MessageKind::events:
      break;
  }
  return f(wire::events_v2{});
}

/// Bytes of a message of `items` items: fixed + items * item.
struct Layout {
  int fixed = 0;
  int item = 0;  ///< 0: no items
};

template <class Wire>
Layout layout_of(Wire message) {
  if constexpr (requires { message.count; }) {
    message.count = 0;
    const int fixed = message.getEncodedSize();
    items_of(message).resize(1);
    message.count = 1;
    return {fixed, message.getEncodedSize() - fixed};
  } else {
    return {message.getEncodedSize(), 0};
  }
}

const Layout& layout(MessageKind kind) {
  static const auto layouts = [] {
    std::array<Layout, kMessageKinds> all;
    for (int k = 0; k < kMessageKinds; ++k) {
      all[static_cast<std::size_t>(k)] =
          with_wire_type(static_cast<MessageKind>(k), [](auto m) { return layout_of(m); });
    }
    return all;
  }();
  return layouts[static_cast<std::size_t>(kind)];
}

constexpr std::size_t kFingerprintBytes = 8;
constexpr std::size_t kCountBytes = 4;

/// The count, which comes right after the fingerprint; payload must be that long.
std::int64_t read_count(ByteView payload) {
  return static_cast<std::int32_t>(
      read_big_endian(payload.subspan(kFingerprintBytes, kCountBytes)));
}

template <class Wire>
Bytes encode_wire(const Wire& message) {
  Bytes bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// The generated decoder, run only on payloads whose size agrees with their count.
template <class Wire>
std::optional<Wire> decode_wire(MessageKind kind, ByteView payload) {
  if (!has_exact_size(kind, payload)) return std::nullopt;
  Wire message;
  const int used = message.decode(payload.data(), 0, static_cast<int>(payload.size()));
  if (used < 0) return std::nullopt;
  return message;
}

template <class Value, class Wire>
std::optional<Value> decode_as(MessageKind kind, ByteView payload) {
  const auto message = decode_wire<Wire>(kind, payload);
  Value value;
  if (!message || !from_wire(*message, value)) return std::nullopt;
  return value;
}

template <class Body, class Wire>
std::optional<Command> decode_command_as(MessageKind kind, ByteView payload) {
  const auto message = decode_wire<Wire>(kind, payload);
  Command command;
  Body body;
  if (!message || !from_wire(message->header, command.header) || !from_wire(*message, body)) {
    return std::nullopt;
  }
  command.body = std::move(body);
  return command;
}

}  // namespace

int items_per_datagram(MessageKind kind, int datagram_bytes) {
  const auto [fixed, item] = layout(kind);
  constexpr int kLongestChannelBytes = 64;
  const int room = datagram_bytes - kLongestChannelBytes - limits::kTrailerBytes - fixed;
  return item == 0 ? 1 : std::max(1, room / item);
}

SizeCheck check_size(MessageKind kind, ByteView payload) {
  const auto [fixed, item] = layout(kind);
  std::int64_t expected = fixed;
  if (item != 0) {
    if (payload.size() < kFingerprintBytes + kCountBytes) return SizeCheck::no_count;
    const std::int64_t count = read_count(payload);
    if (count < 0) return SizeCheck::bad_count;
    expected += count * item;
  }
  const auto size = static_cast<std::int64_t>(payload.size());
  const bool is_right = size == expected || size == expected + limits::kTrailerBytes;
  return is_right ? SizeCheck::right : SizeCheck::wrong_size;
}

bool has_exact_size(MessageKind kind, ByteView payload) {
  return check_size(kind, payload) == SizeCheck::right;
}

std::optional<CommandHeader> peek_header(MessageKind kind, ByteView payload) {
  const std::size_t at = kFingerprintBytes + (layout(kind).item == 0 ? 0 : kCountBytes);
  if (!is_command(kind) || payload.size() < at + 4 * sizeof(std::int64_t)) return std::nullopt;
  const auto field = [&](std::size_t i) {
    return static_cast<std::int64_t>(read_big_endian(payload.subspan(at + 8 * i, 8)));
  };
  CommandHeader header;
  const wire::command_header_v1 fields{field(0), field(1), field(2), field(3)};
  return from_wire(fields, header) ? std::optional(header) : std::nullopt;
}

MessageKind kind_of(const CommandBody& body) { return static_cast<MessageKind>(body.index()); }

int item_count(const CommandBody& body) {
  struct Count {
    std::size_t operator()(const Spawn& c) const { return c.bodies.size(); }
    std::size_t operator()(const Despawn& c) const { return c.bodies.size(); }
    std::size_t operator()(const Push& c) const { return c.wrenches.size(); }
    std::size_t operator()(const ClearWrenches& c) const { return c.bodies.size(); }
    std::size_t operator()(const SetMotion& c) const { return c.motions.size(); }
    std::size_t operator()(const Hello&) const { return 1; }
    std::size_t operator()(const SetGravity&) const { return 1; }
    std::size_t operator()(const Control&) const { return 1; }
  };
  return static_cast<int>(std::visit(Count{}, body));
}

std::int64_t encoded_size(const CommandBody& body) {
  const auto [fixed, item] = layout(kind_of(body));
  return fixed + (item == 0 ? 0 : std::int64_t{item} * item_count(body));
}

Bytes encode(const Command& command) {
  return std::visit(
      [&](const auto& body) {
        auto message = to_wire(body);
        message.header = to_wire(command.header);
        return encode_wire(message);
      },
      command.body);
}
Bytes encode(const Receipts& message) { return encode_wire(to_wire(message)); }
Bytes encode(const WorldStatus& message) { return encode_wire(to_wire(message)); }
Bytes encode(const StateChunk& message) { return encode_wire(to_wire(message)); }
Bytes encode(const Events& message) { return encode_wire(to_wire(message)); }

std::optional<Command> decode_command(MessageKind kind, ByteView payload) {
  switch (kind) {
    case MessageKind::hello:
      return decode_command_as<Hello, wire::hello_v1>(kind, payload);
    case MessageKind::spawn:
      return decode_command_as<Spawn, wire::spawn_v3>(kind, payload);
    case MessageKind::despawn:
      return decode_command_as<Despawn, wire::despawn_v1>(kind, payload);
    case MessageKind::push:
      return decode_command_as<Push, wire::wrench_v1>(kind, payload);
    case MessageKind::clear_wrenches:
      return decode_command_as<ClearWrenches, wire::clear_wrenches_v1>(kind, payload);
    case MessageKind::set_motion:
      return decode_command_as<SetMotion, wire::set_motion_v1>(kind, payload);
    case MessageKind::set_gravity:
      return decode_command_as<SetGravity, wire::set_gravity_v1>(kind, payload);
    case MessageKind::control:
      return decode_command_as<Control, wire::control_v1>(kind, payload);
    case MessageKind::receipts:
    case MessageKind::status:
    case MessageKind::states:
    case MessageKind::events:
      break;
  }
  return std::nullopt;
}

std::optional<Receipts> decode_receipts(ByteView payload) {
  return decode_as<Receipts, wire::receipts_v1>(MessageKind::receipts, payload);
}
std::optional<WorldStatus> decode_status(ByteView payload) {
  return decode_as<WorldStatus, wire::world_status_v3>(MessageKind::status, payload);
}
std::optional<StateChunk> decode_states(ByteView payload) {
  return decode_as<StateChunk, wire::body_states_v1>(MessageKind::states, payload);
}
std::optional<Events> decode_events(ByteView payload) {
  return decode_as<Events, wire::events_v2>(MessageKind::events, payload);
}

}  // namespace cradle
